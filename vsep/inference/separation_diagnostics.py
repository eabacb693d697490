"""Diagnostics of a separation step: the evidence lower bound, and condition (27)."""

import math

import numpy as np

from vsep._typing import ComplexArray
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.elbo import noise_bound, weights_bound
from vsep.inference.objects.object_only import expected_error
from vsep.inference.objects.workspace import ObjectWorkspace
from vsep.signal.atoms import project


def separation_bound(
    residual: ComplexArray,
    objects: ObjectWorkspace,
    interference: InterferenceWorkspace,
    noise_precision: float,
    num_used: int,
) -> float:
    """Evidence lower bound (19) of a step.

    Parameters
    ----------
    residual : (P, N) complex
        r_beta, the frame to fit without the objects.
    objects, interference : workspaces
        After the step.
    noise_precision : float
        lambda.
    num_used : int
        Samples that count.
    """
    traces = objects.active.trace() + interference.trace
    error = expected_error(residual - interference.signal, traces)
    active, filtered = objects.active, interference.correction
    # Terms of q(beta) and q(gamma_beta), then of q(alpha) and q(gamma_alpha)
    bound = interference.weights_bound + weights_bound(
        active.amplitudes,
        np.diagonal(active.covariance).real,
        active.precisions,
        active.log_determinant,
    )
    if filtered.num_splines:  # of the filter's coefficients
        bound += weights_bound(
            filtered.amplitudes,
            np.diagonal(filtered.covariance).real,
            filtered.precisions,
            float(np.linalg.slogdet(filtered.covariance)[1]),
        )
    return bound + noise_bound(num_used, noise_precision, error)  # likelihood and q(lambda)


def separability_ratio_db(objects: ObjectWorkspace, interference: InterferenceWorkspace) -> float:
    """Condition (27): 20 log10 of ||Phi^H Phi alpha|| over ||Phi^H U Psi beta||."""
    count, signal = len(objects.ids), interference.signal
    active = objects.active
    own = active.gram[:count, :count] @ active.amplitudes[:count]  # Phi^H Phi alpha
    # Phi^H U Psi beta; of one antenna from the rows with bursts alone
    if objects.is_stationary and objects.num_antennas == 1:
        (beat, doppler), rows = objects.factors, interference.table.interfered
        other = project(signal[rows], beat, doppler[:, rows])
    else:
        other = objects.products(signal)
    energies = float(np.vdot(own, own).real), float(np.vdot(other, other).real)
    if 0.0 in energies:
        return float("nan")
    return 10.0 * math.log10(energies[0] / energies[1])

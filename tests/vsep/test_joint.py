"""The joint posterior against its dense definition, and against the factorised one."""

import numpy as np
import pytest

from tests.vsep.conftest import central_differences
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.run import run
from vsep.inference.core.schedule import ROBUST
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.joint import JointSeparator
from vsep.inference.joint_columns import JointColumns
from vsep.inference.objects.uncertainty import dispersion_std
from vsep.presets.scenes import simulate_preset
from vsep.signal.template import SignalModel
from vsep.units import from_db


def problem(name, sir_db, seed):
    scenario, observation = simulate_preset(
        name, snr_db=60.0 if "2" in name else 30.0, sir_db=sir_db, seed=seed
    )
    radar = scenario.radar
    model = SignalModel.of_radar(radar, scenario.anti_aliasing_filter)
    return model, observation.received


@pytest.fixture(scope="module")
def settled():
    model, received = problem("simulation-2-b", -10.0, 3)
    return model, received, run(JointSeparator(model=model), received).state


def columns_of(model, received, state):
    threshold = float(from_db(ROBUST.interference_threshold_db))
    work = InterferenceWorkspace(model, ROBUST, threshold, state.bursts)
    return JointColumns(received, state.objects, work, state.noise_precision)


def dense_dictionary(model, state):
    """[Phi, U Psi] of the stacked frame, straight from (9)-(12)."""
    ramps, samples = np.arange(model.num_ramps), np.arange(model.num_samples)
    atoms = [
        np.kron(np.exp(-2j * np.pi * d * ramps), np.exp(-2j * np.pi * b * samples))
        / np.sqrt(model.num_ramps * model.num_samples)
        for b, d in zip(state.objects.beats, state.objects.dopplers, strict=True)
    ]
    for burst in state.bursts:
        template = model.template(np.array([burst.start_frequency]), np.array([burst.slope]))[0]
        for k in burst.active_bins:
            column = np.zeros(model.shape, dtype=complex)
            line = np.exp(-2j * np.pi * k * samples / model.num_grid_bins)
            column[burst.ramp] = template * line / np.sqrt(model.num_samples)
            atoms.append(column.ravel())
    return np.stack(atoms, axis=1)


def test_posterior_is_that_of_the_concatenated_dictionary(settled):
    model, received, state = settled
    atoms = dense_dictionary(model, state)
    precisions = np.concatenate(
        [state.objects.precisions, *[burst.precisions for burst in state.bursts]]
    )
    precision_matrix = state.noise_precision * atoms.conj().T @ atoms + np.diag(precisions)
    covariance = np.linalg.inv(precision_matrix)
    mean = state.noise_precision * covariance @ atoms.conj().T @ received.ravel()
    columns = columns_of(model, received, state)
    deviations = np.sqrt(np.diagonal(covariance).real)
    # Condition numbers up to 1e5 times rounding: far below a thousandth of a deviation.
    scaled = (columns.active.covariance - covariance) / np.outer(deviations, deviations)
    assert np.max(np.abs(scaled)) < 1e-6
    assert np.max(np.abs(columns.active.amplitudes - mean) / deviations) < 1e-4
    count = state.objects.num_components
    np.testing.assert_allclose(state.objects.amplitudes, mean[:count], rtol=1e-6)


def test_chirp_gradient_of_the_joint_evidence_equals_finite_differences(settled):
    model, received, state = settled
    columns = columns_of(model, received, state)
    chirps, cost = columns.interference.table.chirps, columns.chirp_cost(0)
    start, slope = chirps.start_frequency[0] + 1e-4, chirps.slope[0] * 1.001
    reference = -start / slope

    def value(frequency_step, slope_step):
        template = model.template(
            np.array([start + frequency_step - slope_step * reference]),
            np.array([slope + slope_step]),
        )
        return cost.values(np.zeros(1, int), template)[0]

    template, derivatives = model.template_jet(start, slope, reference)
    _, (gradient,), (curvature,) = cost.slopes(np.zeros(1, int), template[None], derivatives[None])
    differences = central_differences(value, (1e-6, 1e-8))
    np.testing.assert_allclose(gradient, differences, rtol=1e-3)
    assert np.all(np.linalg.eigvalsh(curvature) > 0)


@pytest.mark.parametrize("sir_db", [-20.0, 5.0])
def test_joint_and_factorised_agree_where_sources_hardly_correlate(sir_db):
    model, received = problem("simulation-1", sir_db, 5)
    joint = run(JointSeparator(model=model), received)
    factorised = run(FactorisedSeparator(model=model), received)
    assert joint.objects.num_components == factorised.objects.num_components
    std = dispersion_std(joint.objects, joint.state.noise_precision, model.shape)
    # The sources' correlation moves the estimate by less than the burst's share of its variance.
    assert np.all(np.abs(joint.objects.beats - factorised.objects.beats) < 0.3 * std.beats)


def test_joint_run_converges_and_finds_the_bursts(settled):
    _, received, state = settled
    assert state.interfered_ramps == (0, 2, 4, 6)
    rest = received - state.object_signal - state.interference_signal
    assert np.mean(np.abs(rest) ** 2) * state.noise_precision == pytest.approx(1.0, abs=0.05)

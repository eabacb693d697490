r"""Evidence for two estimates of the objects on the same samples.

Estimates that were made from different samples of a frame cannot be compared by the bounds of
their runs: a bound that covers a burst rewards the description of the burst, one that ignores its
samples does not contain them. Both are therefore scored on the samples D that both of them used,
``r_D = Phi_D(Z) alpha + noise``, where only the places Z of the L objects are taken from them. The
score of Z is the evidence lower bound (19) at its maximum over q(alpha), q(gamma) and q(lambda),

    1/gamma_l = omega_l^2 - rho_l  where positive,    lambda = |D| / <||r_D - Phi_D alpha||^2> ,

with rho_l, omega_l of (23)-(24). An object without evidence in D (omega_l^2 <= rho_l) has no
weight; the bound (19) holds a constant 1 for it, since ``1 + log(gamma C) -> 1``, which is
subtracted for every object: objects that D does not know of change nothing.

The places were fitted, and to data of which D is a part. With Fisher information J of all data and
``J_D = s J`` of D, the deviation of a place is ``J^-1 g`` with the gradient g of all data, and

    E[log p(r_D | Z-hat) - log p(r_D | Z)] = tr(J_D J^-1) - tr(J_D J^-1) / 2 = s k / 2

for k real parameters. Of new data of the size of D it would be ``-s k / 2``. The difference s k,
2 s nats an object, is subtracted, as in Akaike's criterion: without it, places that were fitted to
D alone (s = 1) would win over better ones that other samples have told as well.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.core.elbo import noise_bound, weights_bound
from vsep.inference.core.state import ObjectComponents
from vsep.signal.atoms import dense_atoms
from vsep.signal.template import SignalModel

ROUNDS = 30
CONSTANT = 1.0  # that (19) holds for an object without evidence, in nats
PLACE_PARAMETERS = 2.0  # beat and Doppler frequency
BLOCK = 64  # atoms that are held in memory at a time
FIRST_PRECISION = 1e-9  # gamma to begin with, in units of lambda: next to a flat prior


def evidence_of_places(
    objects: ObjectComponents,
    received: ComplexArray,
    used: BoolArray,
    model: SignalModel,
    share: float,
) -> float:
    """Score of the objects' places on some samples of a frame, in nats.

    Parameters
    ----------
    objects : ObjectComponents
        Only their places count.
    received : (A P, N) complex
        The frame; antennas have weights of their own.
    used : (A P, N) bool
        The samples D, at least two of every antenna.
    model : SignalModel
        Size, and how objects move through range cells.
    share : float
        s, the share of D in what the places were fitted to.

    Returns
    -------
    float
        To be compared with scores on the same samples only.
    """
    rows = (model.num_antennas, *model.shape)
    frames, masks = received.reshape(rows), used.reshape(rows)
    scores = [
        _largest_bound(*_projected(objects, frame, mask, model), int(np.count_nonzero(mask)))
        for frame, mask in zip(frames, masks, strict=True)
    ]
    return sum(scores) - PLACE_PARAMETERS * share * objects.num_components


def _projected(
    objects: ObjectComponents, received: ComplexArray, used: BoolArray, model: SignalModel
) -> tuple[ComplexArray, ComplexArray, float]:
    """Phi_D^H Phi_D (L, L), Phi_D^H r_D (L,) and ||r_D||^2."""
    count, data = objects.num_components, received[used]
    gram = np.empty((count, count), dtype=np.complex128)
    products = np.empty(count, dtype=np.complex128)
    blocks = [slice(start, min(start + BLOCK, count)) for start in range(0, count, BLOCK)]

    def atoms(block: slice) -> ComplexArray:
        places = objects.beats[block], objects.dopplers[block]
        return dense_atoms(*places, model.shape, model.migration)[:, used]

    for number, block in enumerate(blocks):
        own = atoms(block).conj()
        products[block] = own @ data
        for other in blocks[number:]:
            gram[block, other] = own @ (own.conj() if other is block else atoms(other)).T
            gram[other, block] = gram[block, other].conj().T
    return gram, products, float(np.vdot(data, data).real)


def _largest_bound(
    gram: ComplexArray, products: ComplexArray, energy: float, num_used: int
) -> float:
    """Bound (19) at its maximum, without the constants of the objects."""
    kept = np.arange(len(products))
    precision = num_used / max(energy, np.finfo(float).tiny)  # lambda
    precisions: FloatArray = np.full(len(kept), FIRST_PRECISION * precision)
    for _ in range(ROUNDS):
        if not len(kept):
            break
        own, data = gram[np.ix_(kept, kept)], products[kept]
        covariance = _inverse(precision * own, precisions)
        mean = precision * covariance @ data
        precision = num_used / _error(own, data, energy, mean, covariance)
        variance = np.diagonal(covariance).real
        rho = 1.0 / (1.0 / variance - precisions)  # (23)
        omega_squared = np.abs(rho * mean / variance) ** 2  # (24)
        evident = omega_squared > rho
        kept = kept[evident]
        precisions = 1.0 / (omega_squared - rho)[evident]
    if not len(kept):
        return noise_bound(num_used, num_used / energy, energy)
    own, data = gram[np.ix_(kept, kept)], products[kept]
    covariance = _inverse(precision * own, precisions)
    mean = precision * covariance @ data
    log_determinant = float(np.linalg.slogdet(covariance)[1])
    weights = weights_bound(mean, np.diagonal(covariance).real, precisions, log_determinant)
    error = _error(own, data, energy, mean, covariance)
    return weights - CONSTANT * len(kept) + noise_bound(num_used, precision, error)


def _error(
    gram: ComplexArray,
    products: ComplexArray,
    energy: float,
    mean: ComplexArray,
    covariance: ComplexArray,
) -> float:
    """Return <||r_D - Phi_D alpha||^2>."""
    explained = 2.0 * float(np.vdot(mean, products).real)
    moments = np.outer(mean, mean.conj()) + covariance
    return energy - explained + float(np.sum(gram.T * moments).real)


def _inverse(gram: ComplexArray, precisions: FloatArray) -> ComplexArray:
    """Return the covariance (59), Hermitian."""
    factor = cho_factor(gram + np.diag(precisions))
    return np.asarray(cho_solve(factor, np.eye(len(precisions))), dtype=np.complex128)

"""Where the bursts are: exhaustive search for one chirp per ramp, and refinement of (71).

With one channel component the cost (71) is the single-component SNR
``lambda |a^H r|^2 / ||a||^2``. For a fixed slope the template is a shifted kernel, so all burst
centres of all ramps cost one correlation by FFT; slopes are spaced uniformly in 1/slope, which
spaces the phase error at the band's edge uniformly.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import fft

from vsep._arrays import ComplexArray, FloatArray, IntArray, frozen
from vsep.inference.sbl import ActiveSet
from vsep.signal.template import SignalModel

SHORTEST_BURST = 6.0  # samples; shorter ones are clicks without a shape
LONGEST_BURST = 2.0  # ramps; longer ones cover a part of the band only and look like a tone
EDGE_PHASE = 0.25  # rad/pi: phase error at the half-amplitude edge between neighbouring slopes
CENTRE_MARGIN = 0.25  # share of a ramp by which a burst's centre may lie outside of it
RIDGE = 1e-9  # relative, keeps the Newton step finite where the channel absorbs a parameter
LEAST_OVERLAP = 0.25  # share of the burst's energy that must lie inside the ramp


@dataclass(frozen=True, slots=True, eq=False)
class ChirpCandidates:
    """Best single chirp of each ramp: arrays of length P.

    ``score`` is ``|a^H r|^2 / ||a||^2``, the SNR times 1/lambda.
    """

    start_frequency: FloatArray
    slope: FloatArray
    score: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SlopeBank:
    """Kernels of all searched slopes.

    Attributes
    ----------
    slopes : (S,) float
        Cycles per sample squared, both signs.
    centres : (C,) int
        Burst centres in samples.
    spectra : (S, F) complex
        Conjugate spectra of the kernels.
    inverse_energy : (S, C) float
        1/||a||^2 inside the ramp; zero where too little of the burst lies inside.
    """

    slopes: FloatArray
    centres: IntArray
    spectra: ComplexArray
    inverse_energy: FloatArray


@lru_cache(maxsize=16)
def slope_bank(model: SignalModel) -> SlopeBank:
    """Kernels for every slope worth searching; the same for all frames of one model."""
    num_samples = model.num_samples
    width = 2.0 * model.normalised_cutoff
    spacing = 2.0 * EDGE_PHASE / model.normalised_cutoff**2
    inverse_slopes = np.arange(SHORTEST_BURST / width, LONGEST_BURST * num_samples / width, spacing)
    slopes: FloatArray = np.concatenate([1.0 / inverse_slopes, -1.0 / inverse_slopes])
    margin = int(CENTRE_MARGIN * num_samples)
    centres = np.arange(-margin, num_samples + margin)
    reach = num_samples + margin
    offsets = np.arange(-reach, reach)  # kernel support: any sample seen from any centre
    rate = model.sample_rate_hz
    envelope = model.anti_aliasing_filter.modified_response(
        slopes[:, None] * offsets * rate, slopes[:, None] * rate**2
    )
    kernels = np.exp(1j * np.pi * slopes[:, None] * offsets**2) * envelope
    size = fft.next_fast_len(num_samples + len(offsets))
    shifted = np.zeros((len(slopes), size), dtype=np.complex128)
    shifted[:, offsets % size] = kernels
    cumulative = np.cumsum(np.abs(kernels) ** 2, axis=1)
    last = num_samples - 1 - centres + reach
    first = -1 - centres + reach
    energy = cumulative[:, np.clip(last, 0, None)] - np.where(
        first >= 0, cumulative[:, np.clip(first, 0, None)], 0.0
    )
    enough = energy >= LEAST_OVERLAP * energy.max(axis=1, keepdims=True)
    inverse_energy = np.where(enough, 1.0 / np.where(enough, energy, 1.0), 0.0)
    return SlopeBank(
        slopes=frozen(slopes),
        centres=frozen(centres),
        spectra=frozen(fft.fft(shifted, axis=1).conj()),
        inverse_energy=frozen(inverse_energy),
    )


def find_single_chirps(residual: ComplexArray, model: SignalModel) -> ChirpCandidates:
    """Best single chirp of every ramp of a (P, N) residual, by one FFT a slope and ramp.

    Costs O(S P N log N) for S slopes.
    """
    bank = slope_bank(model)
    size = bank.spectra.shape[1]
    spectra = fft.fft(residual, size, axis=1)
    positions = bank.centres % size
    found = []
    for spectrum in spectra:
        correlation = fft.ifft(spectrum * bank.spectra, axis=1)[:, positions]
        score = (correlation.real**2 + correlation.imag**2) * bank.inverse_energy
        row, column = np.unravel_index(int(np.argmax(score)), score.shape)
        slope = bank.slopes[row]
        found.append((-slope * bank.centres[column], slope, score[row, column]))
    start_frequency, slope, score = np.array(found).T
    return ChirpCandidates(start_frequency.copy(), slope.copy(), score.copy())


class ChannelGrid:
    """Line spectra on the channel grid of one ramp: ``psi_k = exp(-j 2 pi k n / K) / sqrt(N)``."""

    def __init__(self, num_samples: int, num_bins: int) -> None:
        self.num_samples = num_samples
        self.num_bins = num_bins

    def atoms(self, bins: IntArray) -> ComplexArray:
        """(N, K) active columns of Psi."""
        turns = np.outer(np.arange(self.num_samples), bins) % self.num_bins
        twiddle = np.exp(-2j * np.pi * np.arange(self.num_bins) / self.num_bins)
        return np.asarray(twiddle[turns] / np.sqrt(self.num_samples))

    def gram_lags(self, template: ComplexArray) -> ComplexArray:
        """Gram entry of two channel atoms as a function of their bin difference, one FFT."""
        lags = fft.ifft(np.abs(template) ** 2, self.num_bins)
        return np.asarray(lags * (self.num_bins / self.num_samples))

    def projections(self, template: ComplexArray, residual: ComplexArray) -> ComplexArray:
        """(U Psi)^H r of every bin of the grid, one FFT."""
        spectrum = fft.ifft(template.conj() * residual, self.num_bins)
        return np.asarray(spectrum * (self.num_bins / np.sqrt(self.num_samples)))


def channel_posterior(
    grid: ChannelGrid,
    template: ComplexArray,
    residual: ComplexArray,
    bins: IntArray,
    precisions: FloatArray,
    noise_precision: float,
) -> ActiveSet:
    """Weight posterior (60)-(62) of the active bins of one ramp."""
    lags = grid.gram_lags(template)
    gram = lags[(bins[:, None] - bins[None, :]) % grid.num_bins]
    projections = grid.projections(template, residual)[bins]
    return ActiveSet(gram, projections, precisions, noise_precision)


def chirp_cost(active: ActiveSet) -> float:
    """Cost (71) of one ramp: ``log|C| + lambda h^H beta`` with the projections h."""
    _, logdet = np.linalg.slogdet(active.covariance)
    fit = np.vdot(active.projections, active.amplitudes).real
    return float(logdet + active.noise_precision * fit)


def refine_chirp(
    parameters: tuple[float, float],
    model: SignalModel,
    grid: ChannelGrid,
    residual: ComplexArray,
    bins: IntArray,
    precisions: FloatArray,
    noise_precision: float,
    *,
    max_steps: int = 1,
) -> tuple[float, float]:
    """Climb (71) in (frequency at the burst's centre, slope) by damped Gauss-Newton steps.

    The gradient is exact: with ``y = Psi beta`` and ``c = diag(Psi C Psi^H)`` it is
    ``2 lambda Re sum da (r* y - a* (|y|^2 + c))``. The curvature is that of the residual after
    projection on the channel, which is positive definite.

    Parameters
    ----------
    parameters : tuple of float
        Start frequency and slope, normalised.
    bins, precisions : (K,) arrays
        Active bins and their prior precisions, held fixed.

    Returns
    -------
    tuple of float
        Start frequency and slope; the cost never falls.
    """
    start_frequency, slope = parameters
    atoms = grid.atoms(bins)
    for _ in range(max_steps):
        centre = -start_frequency / slope
        reference = float(np.clip(centre, 0.0, model.num_samples - 1.0))
        template, derivatives = model.template_jet(start_frequency, slope, reference)
        active = channel_posterior(grid, template, residual, bins, precisions, noise_precision)
        gradient, curvature = chirp_cost_slopes(template, derivatives, atoms, active, residual)
        ridge = np.diag(RIDGE * np.diagonal(curvature))
        step = np.linalg.solve(curvature + ridge, gradient)
        # Longest step: a tenth of the burst in position, a tenth of the slope.
        scale = max(
            1.0,
            abs(step[0]) / (0.2 * model.normalised_cutoff),
            abs(step[1]) / (0.1 * abs(slope)),
        )
        step = step / scale
        cost = chirp_cost(active)
        for _ in range(5):
            trial_slope = slope + step[1]
            trial_start = start_frequency + step[0] - step[1] * reference
            trial_template = model.template(np.array([trial_start]), np.array([trial_slope]))[0]
            trial = channel_posterior(
                grid, trial_template, residual, bins, precisions, noise_precision
            )
            if chirp_cost(trial) >= cost:
                start_frequency, slope = float(trial_start), float(trial_slope)
                break
            step = 0.25 * step
        else:
            break
    return start_frequency, slope


def chirp_cost_slopes(
    template: ComplexArray,
    derivatives: ComplexArray,
    atoms: ComplexArray,
    active: ActiveSet,
    residual: ComplexArray,
) -> tuple[FloatArray, FloatArray]:
    """Exact gradient (2,) and Gauss-Newton curvature (2, 2) of (71), by the template's derivatives.

    Parameters
    ----------
    template : (N,) complex
        Diagonal of U.
    derivatives : (2, N) complex
        Its derivatives by the two parameters.
    atoms : (N, K) complex
        Active columns of Psi.
    active : ActiveSet
        Posterior of their weights at this template.
    residual : (N,) complex
        Received ramp minus the object estimate.
    """
    noise_precision = active.noise_precision
    line = atoms @ active.amplitudes
    uncertainty = np.einsum("nk,nk->n", atoms @ active.covariance, atoms.conj()).real
    pull = residual.conj() * line - template.conj() * (np.abs(line) ** 2 + uncertainty)
    gradient = 2.0 * noise_precision * (derivatives @ pull).real
    moved = derivatives * line
    crossed = (moved * template.conj()) @ atoms.conj()
    curvature = (moved @ moved.conj().T).real
    curvature -= noise_precision * (crossed @ active.covariance.T @ crossed.conj().T).real
    return gradient, 2.0 * noise_precision * curvature

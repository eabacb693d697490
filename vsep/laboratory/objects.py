"""All objects that appear in any cell of a map: their lines, and which of them a cell has.

Cells differ in the number of objects (later ones are left out) and in the delay of the first one.
So a few dozen lines serve all cells, and the inner products of two of them are made once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray, wrap_frequency
from vsep.signal.atoms import Factors, gram_between, line_factors, line_slopes
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Channel

# Directions in which the objects' atoms have less than this share of their energy count as one.
_DEPENDENT = 1e-12


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ObjectTable:
    """Lines of all objects, and the derivatives of the weighted lines.

    Attributes
    ----------
    amplitudes : (U,) complex
        Weights of the lines.
    beat_lines, doppler_lines : (U, N), (U, P) complex
        Factors of the unit-norm atoms.
    beat_slopes, doppler_slopes : (U, N), (U, P) complex
        Their derivatives by the frequency.
    products : (C U, C U) complex
        Inner products of the atoms, of the weighted atoms' derivatives by the beat frequency and,
        if there are several ramps (C = 3, else 2), by the Doppler frequency.
    """

    amplitudes: ComplexArray
    beat_lines: ComplexArray
    doppler_lines: ComplexArray
    beat_slopes: ComplexArray
    doppler_slopes: ComplexArray
    products: ComplexArray

    @property
    def num_lines(self) -> int:
        """U."""
        return len(self.amplitudes)

    @property
    def num_kinds(self) -> int:
        """C: atom, derivative by the beat frequency, and by the Doppler frequency if there is."""
        return 2 if self.doppler_lines.shape[1] == 1 else 3

    def columns(self, members: IntArray) -> IntArray:
        """(..., C L) columns of `products` of (..., L) members: atoms first."""
        return np.concatenate([members + k * self.num_lines for k in range(self.num_kinds)], -1)

    def gram(self, members: IntArray) -> ComplexArray:
        """(O, L, L) inner products of the atoms of (O, L) members."""
        return self.products[members[:, :, None], members[:, None, :]]

    def own_projections(self, members: IntArray) -> tuple[FloatArray, FloatArray]:
        """(O,) energies of the object signal, and of its projections Phi^H Phi alpha."""
        weights = self.amplitudes[members]
        projected = (self.gram(members) @ weights[:, :, None])[:, :, 0]
        energy = np.sum(weights.conj() * projected, axis=1).real
        return energy, np.sum(np.abs(projected) ** 2, axis=1)

    def whitening(self, members: IntArray) -> ComplexArray:
        """(O, L, L) matrices that make the atoms of (O, L) members orthonormal."""
        strengths, directions = np.linalg.eigh(self.gram(members))
        known = strengths > _DEPENDENT * strengths[:, -1:]
        inverse = np.where(known, 1.0 / np.sqrt(np.where(known, strengths, 1.0)), 0.0)
        return np.asarray(directions * inverse[:, None, :])


def make_table(radar: ChirpSequence, objects: Channel, delays_s: Sequence[float]) -> ObjectTable:
    """Make the table of a scene's objects, followed by the first one at other delays.

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    objects : Channel
        As many as the fullest cell has.
    delays_s : sequence of float
        Other delays of the first object.
    """
    moved = np.asarray(delays_s, dtype=np.float64)
    repeated = np.concatenate([np.arange(objects.num_paths), np.zeros(len(moved), dtype=np.int64)])
    delays = np.concatenate([objects.delays_s, moved])
    beats = wrap_frequency(radar.beat_from_delay(delays))
    dopplers = wrap_frequency(radar.doppler_from_hz(objects.dopplers_hz[repeated]))
    amplitudes = objects.weights[repeated]
    beat_lines = line_factors(beats, radar.num_samples)
    doppler_lines = line_factors(dopplers, radar.num_ramps)
    beat_slopes, doppler_slopes = line_slopes(beat_lines), line_slopes(doppler_lines)
    kinds: list[Factors] = [
        (beat_lines, doppler_lines),
        (amplitudes[:, None] * beat_slopes, doppler_lines),
        (amplitudes[:, None] * beat_lines, doppler_slopes),
    ]
    kinds = kinds[: 2 if radar.num_ramps == 1 else 3]
    columns = np.concatenate([k[0] for k in kinds]), np.concatenate([k[1] for k in kinds])
    return ObjectTable(
        amplitudes=amplitudes,
        beat_lines=beat_lines,
        doppler_lines=doppler_lines,
        beat_slopes=beat_slopes,
        doppler_slopes=doppler_slopes,
        products=gram_between(columns, columns),
    )

"""All objects that appear in any cell of a map: their lines, and the products of these.

Cells differ in the number of objects (later ones are left out) and in the delay of the first one.
So a few dozen lines serve all cells: those of the other objects, then the first one at all delays.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray
from vsep.separability.products import Products
from vsep.signal.atoms import Factors, gram_between, line_factors, line_slopes
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Channel
from vsep.units import wrap_frequency


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ObjectTable:
    """Lines of all objects, and the derivatives of the weighted lines."""

    num_others: int  #: F, objects beside the first one; their lines come first
    amplitudes: ComplexArray  #: (U,) weights of the lines
    #: (U, N) factors of the unit-norm atoms
    beat_lines: ComplexArray
    doppler_lines: ComplexArray
    #: (U, N) their derivatives by the frequency
    beat_slopes: ComplexArray
    doppler_slopes: ComplexArray
    #: of the atoms, of the weighted atoms' derivatives by the beat frequency and, if there are
    #: several ramps (C = 3, else 2), by the Doppler frequency; B is 1
    products: Products

    @property
    def num_lines(self) -> int:
        """U."""
        return len(self.amplitudes)

    @property
    def num_kinds(self) -> int:
        """C: atom, derivative by the beat frequency, and by the Doppler frequency if there is."""
        return 2 if self.doppler_lines.shape[1] == 1 else 3


def make_table(radar: ChirpSequence, objects: Channel, delays_s: Sequence[float]) -> ObjectTable:
    """Make the table of a scene's objects.

    `radar`: the victim; `objects`: as many as the fullest cell has; `delays_s`: delays of the first
    object; its own if there is none.
    """
    others = np.arange(1, objects.num_paths)
    moved = np.array(delays_s if len(delays_s) else objects.delays_s[:1], dtype=np.float64)
    chosen = np.concatenate([others, np.zeros(len(moved), dtype=np.int64)])
    delays = np.concatenate([objects.delays_s[others], moved])
    beats = wrap_frequency(radar.beat_from_delay(delays))
    dopplers = wrap_frequency(radar.doppler_from_hz(objects.dopplers_hz[chosen]))
    amplitudes = objects.weights[chosen]
    beat_lines = line_factors(beats, radar.num_samples)
    doppler_lines = line_factors(dopplers, radar.num_ramps)
    beat_slopes, doppler_slopes = line_slopes(beat_lines), line_slopes(doppler_lines)
    kinds: list[Factors] = [
        (beat_lines, doppler_lines),
        (amplitudes[:, None] * beat_slopes, doppler_lines),
        (amplitudes[:, None] * beat_lines, doppler_slopes),
    ]
    kinds = kinds[: 2 if radar.num_ramps == 1 else 3]
    return ObjectTable(
        num_others=len(others),
        amplitudes=amplitudes,
        beat_lines=beat_lines,
        doppler_lines=doppler_lines,
        beat_slopes=beat_slopes,
        doppler_slopes=doppler_slopes,
        products=_products(kinds, len(others)),
    )


def _products(kinds: list[Factors], num_others: int) -> Products:
    others = tuple(np.concatenate([kind[n][:num_others] for kind in kinds]) for n in range(2))
    last = tuple(np.concatenate([kind[n][num_others:] for kind in kinds]) for n in range(2))
    shape = 1, len(kinds), num_others, len(kinds)
    by_line = [last[n].reshape(len(kinds), -1, last[n].shape[1]) for n in range(2)]
    within = [np.einsum("cdn,edn->ced", one.conj(), one) for one in by_line]
    return Products(
        among=gram_between((others[0], others[1]), (others[0], others[1])).reshape(
            *shape, num_others
        ),
        across=gram_between((others[0], others[1]), (last[0], last[1])).reshape(*shape, -1)
        if num_others
        else np.zeros((*shape, by_line[0].shape[1]), dtype=np.complex128),
        within=(within[0] * within[1])[None],
    )

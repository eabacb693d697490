"""The layers that need no estimator, for every pair of an interferer and a set of objects.

Condition (27) in both readings, the coherence of the two bases and the loss of the Cramer-Rao
bound. All come from inner products of a few lines with the bursts; nothing of the size of a frame
is made for a pair. None depends on the SNR, and of the levels only (27) does, dB by dB.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.separability.bounds import bound_losses
from vsep.separability.bursts import (
    BurstRows,
    Interferers,
    make_bursts,
    on_lines,
    stack_by_key,
    sum_by_key,
)
from vsep.separability.coherence import coherences
from vsep.separability.condition import conditions
from vsep.separability.objects import ObjectTable
from vsep.separability.products import make_products
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Channel

# So many complex numbers are at work at a time: what the processor keeps at hand.
_BLOCK = 200_000


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PairLayers:
    """Layers at SIR 0 dB, each (B, S, number of counts, D).

    They are of B interferers with S numbers of ramps, and of numbers of objects at D delays of the
    first one.
    """

    whole_db: FloatArray  #: (27) as a ratio of norms over all objects
    weakest_db: FloatArray  #: (27) object by object, the smallest ratio
    coherence: FloatArray  #: cosine of the smallest principal angle between span Phi and span U Psi
    #: mean bound on the variance of beat and Doppler frequency, interference unknown over known
    bound_loss_db: FloatArray


def pair_layers(
    radar: ChirpSequence,
    channel: Channel,
    interferers: Interferers,
    table: ObjectTable,
    counts: Sequence[int],
) -> PairLayers:
    """Evaluate all layers for interferers times sets of objects.

    `radar`: the victim; `channel`: paths from every interferer to the victim; `interferers`: who
    makes bursts, with how many ramps; `table`: lines of all objects; `counts`: numbers of objects.
    An interferer without bursts has NaN; the loss is infinite where the bound is.
    """
    columns = table.num_kinds * table.num_lines
    row = (channel.num_paths + 2) * (columns + radar.num_samples)
    each = row * min(radar.num_ramps, interferers.ramp_counts[-1])
    pairs = len(interferers.ramp_counts) * (columns + 1) * table.num_kinds * table.num_others
    step = max(1, _BLOCK // (each + pairs))
    parts = []
    for start in range(0, len(interferers.sequences), step):
        rows = make_bursts(radar, channel, interferers.select(slice(start, start + step)))
        parts.append(_layers(rows, table, counts, len(interferers.ramp_counts)))
    layers = np.concatenate(parts, axis=1)
    shape = 4, -1, len(interferers.ramp_counts), *layers.shape[2:]
    whole, weakest, coherence, loss = layers.reshape(shape)
    return PairLayers(whole_db=whole, weakest_db=weakest, coherence=coherence, bound_loss_db=loss)


def _layers(
    rows: BurstRows, table: ObjectTable, counts: Sequence[int], num_segments: int
) -> FloatArray:
    """All four layers, (4, number of keys, number of counts, D)."""
    products = on_lines(rows, table)
    spans = make_products(stack_by_key(products[:, :-2], rows), table.num_others)
    bent = make_products(stack_by_key(_as_real(products[:, -2:]), rows), table.num_others)
    spans, bent = spans.summed(num_segments), bent.summed(num_segments)
    met = sum_by_key(_met(rows, table), rows).reshape(-1, num_segments, table.num_lines)
    energies = sum_by_key(np.sum(np.abs(rows.signals) ** 2, axis=1), rows)
    energies = np.cumsum(energies.reshape(-1, num_segments), axis=1).ravel()
    other = np.abs(np.cumsum(met, axis=1).reshape(-1, table.num_lines)) ** 2
    layers = np.stack(
        [
            *conditions(table, other / np.maximum(energies, 1e-300)[:, None], counts),
            coherences(table.products, spans, counts),
            bound_losses(table.products, spans, bent, counts),
        ]
    )
    layers[:, energies == 0.0] = np.nan
    return layers


def _met(rows: BurstRows, table: ObjectTable) -> ComplexArray:
    """(M, U) products of bursts with the atoms, conjugates of phi^H U Psi beta."""
    return np.asarray(
        (rows.signals.conj() @ table.beat_lines.T) * table.doppler_lines.T[rows.ramps]
    )


def _as_real(products: ComplexArray) -> FloatArray:
    """Real products with the columns of the real parameters; (M, 2, C, U) get one kind more."""
    return np.concatenate(
        [products[:, :, :1].real, -products[:, :, :1].imag, products[:, :, 1:].real], axis=2
    )

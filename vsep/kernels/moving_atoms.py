"""Atoms of objects that move through range cells, and inner products of them.

At a constant velocity the phase of sample n in ramp p is ``-2 pi (beat n + doppler y)``, with

    y(n, p) = (p' + r n') (1 + mu n) + (P - 1) / 2,    mu = k T_s / f_0,    r = T_s / T_p,

p' and n' counted from the middle of frame and ramp: ``mu n`` is the migration, ``r n'`` the Doppler
within a ramp. The beat is that at mid-frame. The phase is linear in both frequencies, so that inner
products of two atoms depend on the differences of their frequencies only; over the ramps they are
Dirichlet kernels in closed form, a sum over the samples is left.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.cis import cis
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import ComplexParts, empty_rows, split

SERIES = 0.05  # of P sin(pi theta): below, sums over the ramps are taken from their series


class Migration(NamedTuple):
    """How delay and Doppler frequency of a moving object are coupled."""

    coupling: float  #: mu; zero for objects that stay in their cells
    ramp_share: float  #: r
    folds: int  #: intervals of Doppler frequency that are searched to either side of the first


STATIONARY = Migration(0.0, 0.0, 0)


@compiled
def is_moving(migration: Migration | None) -> bool:
    """Whether there is migration: kernels are compiled without the code of moving atoms for None.

    Of a function's argument Numba knows before it compiles what follows.
    """
    return migration is not None


@compiled
def fold_width(migration: Migration, num_samples: int) -> float:
    """Doppler frequency by which an atom's phase turns once from ramp to ramp in mid-ramp."""
    return 1.0 / (1.0 + 0.5 * migration.coupling * (num_samples - 1))


@compiled
def ramp_sums(theta: float, num_ramps: int) -> tuple[float, float, float]:
    """Sum ``cos(2 pi theta p')``, ``p' sin(...)`` and ``p'^2 cos(...)`` over the ramps."""
    once, often = cis(0.5 * theta), cis(0.5 * num_ramps * theta)
    sine, cosine = once.imag, once.real
    square = float(num_ramps) * num_ramps
    if abs(num_ramps * sine) > SERIES:
        # D = sin(P u) / sin(u) with u = pi theta, and its derivatives by u
        kernel = often.imag / sine
        slope = (num_ramps * often.real - kernel * cosine) / sine
        bend = (kernel * sine - square * often.imag - 2.0 * slope * cosine) / sine
        return kernel, -0.5 * slope, -0.25 * bend
    # At multiples of pi, for an even number of ramps, all phases are turned by half a cycle.
    sign = -1.0 if cosine < 0.0 and num_ramps % 2 == 0 else 1.0
    e = sine * sine
    angle = sine * (1.0 + e * (1.0 / 6.0 + 0.075 * e)) * (1.0 if cosine > 0.0 else -1.0)
    second = num_ramps * (square - 1.0) / 12.0  # sum of p'^2, then p'^4 and p'^6
    fourth = second * (3.0 * square - 7.0) / 20.0
    sixth = second * (3.0 * square * square - 18.0 * square + 31.0) / 112.0
    e = angle * angle
    return (
        sign * (num_ramps - e * (2.0 * second - e * (2.0 / 3.0 * fourth - 4.0 / 45.0 * e * sixth))),
        sign * angle * (2.0 * second - e * (4.0 / 3.0 * fourth - 4.0 / 15.0 * e * sixth)),
        sign * (second - e * (2.0 * fourth - 2.0 / 3.0 * e * sixth)),
    )


@compiled
def sum_samples(
    point: tuple[float, float],
    migration: Migration,
    num_ramps: int,
    scale: float,
    sums: ComplexParts,
    products: ComplexParts,
    column: int,
    num_rows: int,
) -> None:
    """Sum over the samples what was summed over the ramps with weights 1, p' and p'^2.

    Parameters
    ----------
    point : (float, float)
        Beat and Doppler frequency.
    migration, num_ramps
        Of the atom.
    scale : float
        Norm of the products.
    sums : (3 or 1, N) complex
        Sums over the ramps.
    products : (6 or 1, ...) complex
        The column that is written: the value, first (b, d) and second derivatives (bb, bd, dd).
    column : int
        Its index.
    num_rows : int
        6, or 1 for the value only.
    """
    beat, doppler = point
    coupling, share, _ = migration
    num_samples = sums.real.shape[1]
    middle = 0.5 * (num_samples - 1)
    value = by_beat = by_doppler = twice_beat = mixed = twice_doppler = 0.0j
    for n in range(num_samples):
        x, growth = n - middle, 1.0 + coupling * n
        line = cis(beat * n + doppler * (share * x * growth + 0.5 * (num_ramps - 1)))
        zeroth = complex(sums.real[0, n], sums.imag[0, n]) * line
        value += zeroth
        if num_rows > 1:
            along = share * x
            # y' = growth (p' + along), y'^2 = growth (2 along y' + growth (p'^2 - along^2))
            first = complex(sums.real[1, n], sums.imag[1, n]) * line
            first = growth * (first + along * zeroth)
            second = complex(sums.real[2, n], sums.imag[2, n]) * line
            second = growth * (2.0 * along * first + growth * (second - along * along * zeroth))
            by_beat += x * zeroth
            by_doppler += first
            twice_beat += x * x * zeroth
            mixed += x * first
            twice_doppler += second
    write_product(scale * value, products, 0, column)
    if num_rows > 1:
        # The conjugate atom has the derivatives (+j 2 pi x)^i (+j 2 pi y')^k.
        turn = 2j * np.pi * scale
        write_product(turn * by_beat, products, 1, column)
        write_product(turn * by_doppler, products, 2, column)
        turn *= 2j * np.pi
        write_product(turn * twice_beat, products, 3, column)
        write_product(turn * mixed, products, 4, column)
        write_product(turn * twice_doppler, products, 5, column)


@compiled
def write_product(value: complex, products: ComplexParts, row: int, column: int) -> None:
    """Write one value of a matrix."""
    products.real[row, column], products.imag[row, column] = value.real, value.imag


@compiled
def pair_products(
    point: tuple[float, float],
    others: FloatArray,
    migration: Migration,
    num_ramps: int,
    sums: ComplexParts,
    products: ComplexParts,
    num_rows: int,
) -> None:
    """Write inner products of an atom with others (L, 2), as `sum_samples` does, (6 or 1, L)."""
    num_samples = sums.real.shape[1]
    scale = 1.0 / (float(num_samples) * num_ramps)
    for k in range(len(others)):
        beat, doppler = point[0] - others[k, 0], point[1] - others[k, 1]
        for n in range(num_samples):
            values = ramp_sums(doppler * (1.0 + migration.coupling * n), num_ramps)
            sums.real[0, n], sums.imag[0, n] = values[0], 0.0
            if num_rows > 1:
                sums.real[1, n], sums.imag[1, n] = 0.0, values[1]
                sums.real[2, n], sums.imag[2, n] = values[2], 0.0
        sum_samples((beat, doppler), migration, num_ramps, scale, sums, products, k, num_rows)


@compiled
def fold_loss(migration: Migration, num_ramps: int, num_samples: int) -> float:
    """Power that an atom in the next interval of Doppler frequency misses, to what it explains."""
    sums, product = empty_rows(3, num_samples), empty_rows(6, 1)
    beside = -migration.ramp_share, fold_width(migration, num_samples)
    pair_products(beside, np.zeros((1, 2)), migration, num_ramps, sums, product, 1)
    kept: float = product.real[0, 0] ** 2 + product.imag[0, 0] ** 2
    return 1.0 / kept - 1.0


@compiled
def frame_products(
    point: tuple[float, float],
    migration: Migration,
    num_ramps: int,
    signals: ComplexParts,
    courses: ComplexParts,
    products: ComplexParts,
    num_rows: int,
) -> None:
    """Write inner products of an atom with signals (A P, N), as `sum_samples` does, (6 or 1, A).

    ``courses`` (3 A + 2, N) is memory: sums over the ramps, then the atom's conjugate in a ramp
    and what turns it from ramp to ramp.
    """
    num_samples = signals.real.shape[1]
    num_antennas = len(signals.real) // num_ramps
    turn, phase = 3 * num_antennas, 3 * num_antennas + 1
    for n in range(num_samples):
        doppler = point[1] * (1.0 + migration.coupling * n)
        step, start = cis(doppler), cis(-0.5 * (num_ramps - 1) * doppler)
        courses.real[turn, n], courses.imag[turn, n] = step.real, step.imag
        courses.real[phase, n], courses.imag[phase, n] = start.real, start.imag
        for row in range(turn):
            courses.real[row, n] = courses.imag[row, n] = 0.0
    e, f = courses.real[turn], courses.imag[turn]
    c, d = courses.real[phase], courses.imag[phase]
    for p in range(num_ramps):
        offset = p - 0.5 * (num_ramps - 1)
        for antenna in range(num_antennas):
            row = antenna * num_ramps + p
            a, b = signals.real[row], signals.imag[row]
            zeroth = courses.real[3 * antenna], courses.imag[3 * antenna]
            first = courses.real[3 * antenna + 1], courses.imag[3 * antenna + 1]
            second = courses.real[3 * antenna + 2], courses.imag[3 * antenna + 2]
            if num_rows == 1:
                for n in range(num_samples):
                    zeroth[0][n] += a[n] * c[n] - b[n] * d[n]
                    zeroth[1][n] += a[n] * d[n] + b[n] * c[n]
            else:
                for n in range(num_samples):
                    real, imag = a[n] * c[n] - b[n] * d[n], a[n] * d[n] + b[n] * c[n]
                    zeroth[0][n] += real
                    zeroth[1][n] += imag
                    first[0][n] += offset * real
                    first[1][n] += offset * imag
                    second[0][n] += offset * offset * real
                    second[1][n] += offset * offset * imag
        for n in range(num_samples):
            real = c[n] * e[n] - d[n] * f[n]
            d[n] = c[n] * f[n] + d[n] * e[n]
            c[n] = real
    scale = 1.0 / np.sqrt(float(num_samples) * num_ramps)
    for antenna in range(num_antennas):
        sums = ComplexParts(
            courses.real[3 * antenna : 3 * antenna + 3], courses.imag[3 * antenna : 3 * antenna + 3]
        )
        sum_samples(point, migration, num_ramps, scale, sums, products, antenna, num_rows)


@compiled
def moving_products(
    points: FloatArray, migration: Migration, num_ramps: int, signals: ComplexArray
) -> ComplexArray:
    """(K, A) inner products of atoms at points (K, 2) with A signals (A P, N)."""
    parts, num_antennas = split(signals), len(signals) // num_ramps
    courses = empty_rows(3 * num_antennas + 2, signals.shape[1])
    row = empty_rows(1, num_antennas)
    products = np.empty((len(points), num_antennas), dtype=np.complex128)
    for k in range(len(points)):
        point = points[k, 0], points[k, 1]
        frame_products(point, migration, num_ramps, parts, courses, row, 1)
        for a in range(num_antennas):
            products[k, a] = complex(row.real[0, a], row.imag[0, a])
    return products


@compiled
def moving_jets(
    points: FloatArray, migration: Migration, num_ramps: int, num_samples: int, num_rows: int
) -> ComplexArray:
    """Inner products of all atoms at points (K, 2) with each other, (6 or 1, K, K).

    ``[0]`` is the Gram matrix; the others are its derivatives by the frequencies of the first atom.
    """
    size = len(points)
    sums, row = empty_rows(3, num_samples), empty_rows(6, size)
    jets = np.empty((num_rows, size, size), dtype=np.complex128)
    for k in range(size):
        point = points[k, 0], points[k, 1]
        pair_products(point, points[: k + 1], migration, num_ramps, sums, row, num_rows)
        for s in range(num_rows):
            for i in range(k + 1):
                value = complex(row.real[s, i], row.imag[s, i])
                jets[s, k, i] = value
                # A first derivative by the other atom's frequency has the other sign.
                jets[s, i, k] = -value.conjugate() if 0 < s < 3 else value.conjugate()
        jets[0, k, k] = jets[0, k, k].real  # exactly
    return jets


@compiled
def add_moving_signals(
    points: FloatArray,
    weights: ComplexArray,
    migration: Migration | None,
    num_ramps: int,
    total: ComplexParts,
) -> None:
    """Add atoms at points (K, 2) with weights (K, A) to signals (A P, N)."""
    if migration is None:
        return
    num_samples = total.real.shape[1]
    courses = empty_rows(2, num_samples)
    c, d, e, f = courses.real[0], courses.imag[0], courses.real[1], courses.imag[1]
    scale = 1.0 / np.sqrt(float(num_samples) * num_ramps)
    for k in range(len(points)):
        beat, doppler = points[k, 0], points[k, 1]
        for n in range(num_samples):
            growth, x = 1.0 + migration.coupling * n, n - 0.5 * (num_samples - 1)
            half = 0.5 * (num_ramps - 1)
            y = (migration.ramp_share * x - half) * growth + half
            start, step = cis(-beat * n - doppler * y), cis(-doppler * growth)
            c[n], d[n] = scale * start.real, scale * start.imag
            e[n], f[n] = step.real, step.imag
        for p in range(num_ramps):
            for antenna in range(weights.shape[1]):
                a, b = weights[k, antenna].real, weights[k, antenna].imag
                row = antenna * num_ramps + p
                for n in range(num_samples):
                    total.real[row, n] += a * c[n] - b * d[n]
                    total.imag[row, n] += a * d[n] + b * c[n]
            for n in range(num_samples):
                real = c[n] * e[n] - d[n] * f[n]
                d[n] = c[n] * f[n] + d[n] * e[n]
                c[n] = real


@compiled
def moving_signals(
    points: FloatArray,
    weights: ComplexArray,
    migration: Migration,
    num_ramps: int,
    num_samples: int,
) -> ComplexArray:
    """Signals (A P, N) of atoms at points (K, 2) with weights (K, A)."""
    shape = weights.shape[1] * num_ramps, num_samples
    total = ComplexParts(np.zeros(shape), np.zeros(shape))
    add_moving_signals(points, weights, migration, num_ramps, total)
    signals = np.empty(shape, dtype=np.complex128)
    for row in range(shape[0]):
        for n in range(num_samples):
            signals[row, n] = complex(total.real[row, n], total.imag[row, n])
    return signals

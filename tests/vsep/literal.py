"""Algorithm 1 written straight from its equations: dense matrices, inverses, differences.

Nothing here is fast and nothing is shared with the kernels: atoms are columns of length PN, U is a
matrix, covariances are inverses, gradients are differences. It is what the speed of the estimator
is a ratio to, and what its results are compared with. One burst a ramp.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.special import fresnel

from vsep.inference.bursts.chirp_refinement import MAX_SHIFT, MAX_STRETCH
from vsep.inference.bursts.chirp_search import slope_bank
from vsep.inference.bursts.search import CLEARLY_BETTER, START_STEPS
from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo
from vsep.inference.core.schedule import schedule_by_name
from vsep.inference.core.state import BurstComponents, ObjectComponents
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.workspace import ADDITION_WINDOW
from vsep.kernels.candidates import ABSORBED_SHARE, CANDIDATE_PEAKS, NEW_COMPONENT_STEPS
from vsep.units import from_db, wrap_frequency

MAX_STEP = 0.25  # of a resolution cell
NO_GAIN = 1e-6  # nats


def response(frequency, slope, inner, outer):
    """Gbar of a raised cosine, every part of it a Fresnel integral."""

    edges = np.array([-outer, -inner, inner, outer]).reshape(4, *[1] * frequency.ndim)

    def integral(shift):
        limits = edges - shift - frequency
        sine, cosine = fresnel(limits * np.sqrt(2.0 / abs(slope)))
        return cosine - 1j * np.sign(slope) * sine

    width = outer - inner
    middle = integral(0.0)
    total = 0.5 * (middle[3] + middle[2] - middle[1] - middle[0])
    for sign in (1.0, -1.0):
        part = integral(sign * 0.5 * slope / width)
        turn = np.exp(1j * np.pi * (sign * frequency / width + 0.25 * slope / width**2))
        at_inner = np.exp(-1j * np.pi * sign * inner / width)
        right, left = part[3] - part[2], part[1] - part[0]
        total = total + 0.25 * turn * (at_inner * right + np.conj(at_inner) * left)
    return total * np.exp(0.25j * np.pi * np.sign(slope)) / np.sqrt(2.0)


def template(model, start, slope):
    """Diagonal of U(theta), (12)."""
    n = np.arange(model.num_samples)
    filter_ = model.anti_aliasing_filter
    edges = filter_.inner_hz / model.sample_rate_hz, filter_.outer_hz / model.sample_rate_hz
    chirp = np.exp(2j * np.pi * (start * n + 0.5 * slope * n**2))
    return chirp * response(start + slope * n, slope, *edges)


def grid_atoms(model):
    """(N, 2N) matrix Psi."""
    turns = np.outer(np.arange(model.num_samples), np.arange(model.num_grid_bins))
    return np.exp(-2j * np.pi * turns / model.num_grid_bins) / np.sqrt(model.num_samples)


def object_atoms(points, shape):
    """(PN, L) matrix Phi, (10)."""
    columns = [
        np.kron(
            np.exp(-2j * np.pi * doppler * np.arange(shape[0])),
            np.exp(-2j * np.pi * beat * np.arange(shape[1])),
        )
        for beat, doppler in points
    ]
    size = shape[0] * shape[1]
    return np.array(columns, dtype=complex).reshape(len(points), size).T / np.sqrt(size)


def posterior(atoms, residual, precisions, noise_precision):
    """Covariance and mean, (58)-(62)."""
    matrix = noise_precision * atoms.conj().T @ atoms + np.diag(precisions)
    covariance = np.linalg.inv(matrix)
    return covariance, noise_precision * covariance @ (atoms.conj().T @ residual)


def moments(atom, atoms, covariance, residual, noise_precision):
    """1/rho and |omega|^2 of (23)-(24)."""
    weights = covariance @ (atoms.conj().T @ atom)
    explained = noise_precision**2 * np.vdot(atoms.conj().T @ atom, weights).real
    inverse_rho = noise_precision * np.vdot(atom, atom).real - explained
    if inverse_rho <= 1e-9 * noise_precision * np.vdot(atom, atom).real:
        return inverse_rho, 0.0
    omega = noise_precision * np.vdot(atom, residual)
    omega -= noise_precision**2 * np.vdot(atoms @ weights, residual)
    return inverse_rho, abs(omega / inverse_rho) ** 2


def log_evidence(atoms, residual, precisions, noise_precision):
    """(67) and (71)."""
    covariance, mean = posterior(atoms, residual, precisions, noise_precision)
    fit = noise_precision * np.vdot(atoms.conj().T @ residual, mean).real
    return np.linalg.slogdet(covariance)[1] + fit


def climb(function, point, steps, longest, max_steps):
    """Newton's method with second differences over `steps`; the function never falls."""
    size = len(point)
    units = np.diag(steps)
    value = function(point)
    for _ in range(max_steps):
        gradient, hessian = np.zeros(size), np.zeros((size, size))
        for i in range(size):
            ahead, behind = function(point + units[i]), function(point - units[i])
            gradient[i] = (ahead - behind) / (2.0 * steps[i])
            hessian[i, i] = (ahead + behind - 2.0 * value) / steps[i] ** 2
            for j in range(i):
                cross = [
                    function(point + a * units[i] + b * units[j]) * a * b
                    for a in (1, -1)
                    for b in (1, -1)
                ]
                hessian[i, j] = hessian[j, i] = sum(cross) / (4.0 * steps[i] * steps[j])
        scaled = hessian * np.outer(longest, longest)
        eigenvalues, vectors = np.linalg.eigh(scaled)
        bend = np.maximum(np.abs(eigenvalues), 1e-9 * np.abs(eigenvalues).max())
        step = longest * (vectors @ ((vectors.T @ (gradient * longest)) / bend))
        step /= max(1.0, np.max(np.abs(step) / longest))
        if gradient @ step < 2.0 * NO_GAIN:
            break
        for _ in range(5):
            trial = function(point + step)
            if trial >= value:
                point, value = point + step, trial
                break
            step = step / 4.0
        else:
            break
    return point


@lru_cache(maxsize=4)
def chirp_dictionary(model):
    """All single chirps that the search compares: parameters (M, 2), atoms (M, N), energies."""
    bank = slope_bank(model)
    rows, parameters = [], []
    for s, slope in enumerate(bank.slopes[bank.slopes > 0.0]):
        starts = -slope * bank.centres[bank.grid.inverse_energy[s] > 0.0]
        parameters.append(np.stack([starts, np.full(len(starts), slope)], axis=1))
        rows.append(template(model, starts[:, None], slope))
    # A real filter is symmetric: chirps that fall are the conjugates of those that rise.
    rising, atoms = np.concatenate(parameters), np.concatenate(rows)
    atoms = np.concatenate([atoms, atoms.conj()])
    return np.concatenate([rising, -rising]), atoms, np.sum(np.abs(atoms) ** 2, axis=1)


@dataclass(frozen=True, kw_only=True, slots=True)
class LiteralSeparator(FactorisedSeparator):
    """The factorised separator, `step` by dense matrices."""

    def step(self, received, state):
        """One main iteration of Algorithm 1."""
        bursts = {burst.ramp: burst for burst in state.bursts}
        events, lam, searched = [], state.noise_precision, self.search_due(state)
        if searched:
            events += self._search(received - state.object_signal, bursts, lam)
        received, num_used = self.set_aside(received, state)
        residual = received - state.object_signal
        for p in list(bursts):
            bursts[p], happened = self._update_burst(bursts[p], residual[p], lam)
            events += happened
            if not bursts[p].num_components:
                del bursts[p]
        interference, trace = self._synthesize(bursts)
        objects = state.objects
        points = np.stack([objects.beats, objects.dopplers], axis=1)
        error = np.sum(np.abs(residual - interference) ** 2) + trace
        atoms = object_atoms(points, received.shape)
        error += np.trace(atoms @ objects.covariance @ atoms.conj().T).real
        lam = num_used / error
        objects, next_id, change, happened = self._update_objects(
            received - interference, state, lam
        )
        events += happened
        points = np.stack([objects.beats, objects.dopplers], axis=1)
        atoms = object_atoms(points, received.shape)
        signal = (atoms @ objects.amplitudes).reshape(received.shape)
        error = np.sum(np.abs(received - signal - interference) ** 2) + trace
        error += np.trace(atoms @ objects.covariance @ atoms.conj().T).real
        lam = num_used / error
        for p, burst in bursts.items():
            bursts[p] = self._fitted(burst, (received - signal)[p], lam)
        info = IterationInfo(
            elbo=0.0,
            events=tuple(events),
            max_frequency_change=change,
            noise_precision_change=lam / state.noise_precision - 1.0,
            searched=searched,
            separability_ratio_db=float("nan"),
        )
        quiet = change < 0.01 and all(e.kind is EventKind.OBJECT_REJECTED for e in events)
        new_state = replace(
            state,
            iteration=state.iteration + 1,
            objects=objects,
            bursts=tuple(bursts[p] for p in sorted(bursts)),
            noise_precision=lam,
            object_signal=signal,
            interference_signal=self._synthesize(bursts)[0],
            next_component_id=next_id,
            search_pending=quiet and not searched,
        )
        return new_state, info

    # Interference, Algorithm 2

    def _columns(self, burst, bins=None):
        """(N, K) columns U Psi."""
        matrix = np.diag(template(self.model, burst.start_frequency, burst.slope))
        return matrix @ grid_atoms(self.model)[:, burst.active_bins if bins is None else bins]

    def _fitted(self, burst, residual, lam):
        covariance, mean = posterior(self._columns(burst), residual, burst.precisions, lam)
        return replace(burst, amplitudes=mean, covariance=covariance)

    def _synthesize(self, bursts):
        signal, trace = np.zeros(self.model.shape, dtype=complex), 0.0
        for p, burst in bursts.items():
            columns = self._columns(burst)
            signal[p] = columns @ burst.amplitudes
            trace += np.trace(columns @ burst.covariance @ columns.conj().T).real
        return signal, trace

    def _search(self, residual, bursts, lam):
        parameters, atoms, energies = chirp_dictionary(self.model)
        first = from_db(schedule_by_name(self.schedule).first_threshold_db)
        events = []
        for p, row in enumerate(residual):
            scores = np.abs(atoms.conj() @ row) ** 2 / energies
            best = int(np.argmax(scores))
            tones = np.abs(grid_atoms(self.model).conj().T @ row) ** 2
            confirmed = scores[best] * lam > first and scores[best] > tones.max()
            kind = None
            if p not in bursts:
                kind = EventKind.CHIRP_STARTED if confirmed else None
            elif not confirmed:
                kind = EventKind.CHIRP_DROPPED
                del bursts[p]
            else:
                columns = self._columns(bursts[p], slice(None))
                energy = np.vdot(columns[:, 0], columns[:, 0]).real
                present = np.max(np.abs(columns.conj().T @ row)) ** 2 / energy
                kind = (
                    EventKind.CHIRP_RESTARTED if scores[best] > CLEARLY_BETTER * present else None
                )
            if kind is None:
                continue
            events.append(_event(kind, p))
            if kind is not EventKind.CHIRP_DROPPED:
                bursts[p] = self._started(p, parameters[best], row, lam)
        return events

    def _started(self, p, parameters, row, lam):
        burst = BurstComponents(
            ramp=p,
            start_frequency=float(parameters[0]),
            slope=float(parameters[1]),
            active_bins=np.zeros(1, dtype=np.int64),
            amplitudes=np.zeros(1, dtype=complex),
            covariance=np.eye(1, dtype=complex),
            precisions=np.zeros(1),
            energy=0.0,
        )
        burst = self._refined(burst, row, lam, START_STEPS)
        atom = self._columns(burst)
        nothing = np.zeros((self.model.num_samples, 0), dtype=complex)
        inverse_rho, power = moments(atom[:, 0], nothing, np.zeros((0, 0)), row, lam)
        precision = 1.0 / (power - 1.0 / inverse_rho)
        return self._fitted(replace(burst, precisions=np.array([precision])), row, lam)

    def _refined(self, burst, row, lam, max_steps=1):
        """Climb (71) in the frequency at the burst's centre and the slope."""
        model = self.model
        reference = float(np.clip(burst.centre, 0, model.num_samples - 1))
        atoms = grid_atoms(model)[:, burst.active_bins]

        def cost(point):
            matrix = np.diag(template(model, point[0] - point[1] * reference, point[1]))
            return log_evidence(matrix @ atoms, row, burst.precisions, lam)

        start = np.array([burst.start_frequency + burst.slope * reference, burst.slope])
        longest = np.array(
            [2.0 * MAX_SHIFT * model.normalised_cutoff, MAX_STRETCH * abs(burst.slope)]
        )
        # A ten-thousandth of the longest step: rounding and third derivative are both small.
        point = climb(cost, start, 1e-4 * longest, longest, max_steps)
        return replace(
            burst, start_frequency=float(point[0] - point[1] * reference), slope=float(point[1])
        )

    def _update_burst(self, burst, row, lam):
        schedule = schedule_by_name(self.schedule)
        threshold = from_db(schedule.interference_threshold_db)
        keep_above = threshold / from_db(schedule.prune_margin_db)
        burst = self._refined(burst, row, lam)
        every = self._columns(burst, slice(None))
        bins, precisions, events = list(burst.active_bins), list(burst.precisions), []
        for _ in range(schedule.channel_additions):
            active = every[:, bins]
            covariance, _ = posterior(active, row, np.array(precisions), lam)
            found = [
                moments(every[:, k], active, covariance, row, lam) for k in range(len(every.T))
            ]
            ratios = [power * inverse for inverse, power in found]
            ratios = [0.0 if k in bins else ratio for k, ratio in enumerate(ratios)]
            best = int(np.argmax(ratios))
            if ratios[best] <= threshold:
                break
            bins.append(best)
            precisions.append(1.0 / (found[best][1] - 1.0 / found[best][0]))
            events.append(_event(EventKind.CHANNEL_ADDED, burst.ramp))
        for channel_bin in list(bins):
            place = bins.index(channel_bin)
            others = bins[:place] + bins[place + 1 :]
            rest = np.array(precisions[:place] + precisions[place + 1 :])
            active = every[:, others]
            covariance, _ = posterior(active, row, rest, lam)
            inverse, power = moments(every[:, channel_bin], active, covariance, row, lam)
            if power * inverse > keep_above:
                precisions[place] = 1.0 / (power - 1.0 / inverse)
            else:
                bins, precisions = others, list(rest)
                events.append(_event(EventKind.CHANNEL_PRUNED, burst.ramp))
        burst = replace(
            burst, active_bins=np.array(bins, dtype=np.int64), precisions=np.array(precisions)
        )
        if bins:
            burst = self._refined(burst, row, lam)
        return self._fitted(burst, row, lam), events

    # Objects, Algorithm 3

    def _update_objects(self, frame, state, lam):
        shape, residual = frame.shape, frame.ravel()
        threshold = float(from_db(self.threshold_db))
        objects, events = state.objects, []
        points = list(np.stack([objects.beats, objects.dopplers], axis=1))
        precisions, ids = list(objects.precisions), list(objects.component_ids)
        next_id, weakest = state.next_component_id, threshold
        for _ in range(schedule_by_name(self.schedule).object_additions(state.iteration)):
            found = self._candidate(frame, points, precisions, lam, threshold)
            if found is None or found[1] <= weakest:
                break
            weakest = max(weakest, ADDITION_WINDOW * found[1])
            points.append(found[0])
            precisions.append(found[2])
            ids.append(next_id)
            next_id += 1
            events.append(_event(EventKind.OBJECT_ADDED, -1))
        before = {name: point for name, point in zip(ids, points, strict=True)}
        for name in list(ids):
            index = ids.index(name)
            point, precision = points.pop(index), precisions.pop(index)
            point = self._moved(point, precision, points, precisions, residual, lam)
            others = object_atoms(points, shape)
            covariance, _ = posterior(others, residual, np.array(precisions), lam)
            atom = object_atoms([point], shape)[:, 0]
            inverse, power = moments(atom, others, covariance, residual, lam)
            if power * inverse > threshold:
                points.insert(index, point)
                precisions.insert(index, 1.0 / (power - 1.0 / inverse))
            else:
                ids.pop(index)
                events.append(_event(EventKind.OBJECT_PRUNED, -1))
        points = self._jointly_moved(points, precisions, residual, lam)
        atoms = object_atoms(points, shape)
        covariance, mean = posterior(atoms, residual, np.array(precisions), lam)
        change = 0.0
        for index, name in enumerate(ids):
            cells = np.abs(wrap_frequency(points[index] - before[name])) * np.array(shape[::-1])
            others = np.delete(atoms, index, axis=1)
            other_covariance, _ = posterior(others, residual, np.delete(precisions, index), lam)
            inverse, power = moments(atoms[:, index], others, other_covariance, residual, lam)
            deviation = np.sqrt(6.0 / max(power * inverse, 1.0)) / (2.0 * np.pi)
            change = max(change, float(cells.max()) / deviation)
        placed = wrap_frequency(np.array(points).reshape(-1, 2))
        components = ObjectComponents(
            component_ids=np.array(ids, dtype=np.int64),
            beats=placed[:, 0].copy(),
            dopplers=placed[:, 1].copy(),
            amplitudes=mean,
            covariance=covariance,
            precisions=np.array(precisions),
        )
        return components, next_id, change, events

    def _candidate(self, frame, points, precisions, lam, threshold):
        """Point, activation ratio and precision of the first usable grid peak."""
        shape, residual = frame.shape, frame.ravel()
        atoms = object_atoms(points, shape)
        covariance, mean = posterior(atoms, residual, np.array(precisions), lam)
        size = (2 * shape[0] if shape[0] > 1 else 1, 2 * shape[1])
        rest = (residual - atoms @ mean).reshape(shape)
        spectrum = np.abs(np.fft.ifft2(rest, s=size)) ** 2
        for _ in range(CANDIDATE_PEAKS):
            row, column = np.unravel_index(int(np.argmax(spectrum)), size)
            rows, columns = np.arange(row - 2, row + 3), np.arange(column - 2, column + 3)
            spectrum[np.ix_(rows % size[0], columns % size[1])] = 0.0
            peak = wrap_frequency(np.array([column / size[1], row / size[0]]))
            steps = NEW_COMPONENT_STEPS
            top = self._moved(peak, 0.0, points, precisions, residual, lam, steps)
            for point in (top, peak):
                atom = object_atoms([point], shape)[:, 0]
                inverse, power = moments(atom, atoms, covariance, residual, lam)
                if power * inverse > threshold and inverse > ABSORBED_SHARE * lam:
                    return wrap_frequency(point), power * inverse, 1.0 / (power - 1.0 / inverse)
        return None

    def _moved(self, point, precision, points, precisions, residual, lam, max_steps=1):
        """Climb (70), the others held where they are."""
        shape = self.model.shape
        others = object_atoms(points, shape)
        covariance, _ = posterior(others, residual, np.array(precisions), lam)
        free = 2 if shape[0] > 1 else 1

        def cost(free_point):
            atom = object_atoms([np.append(free_point, point[free:])], shape)[:, 0]
            weights = covariance @ (others.conj().T @ atom)
            schur = lam + precision - lam**2 * np.vdot(others.conj().T @ atom, weights).real
            inner = np.vdot(atom - lam * others @ weights, residual)
            schur = max(schur, 1e-12 * lam)
            return lam**2 * abs(inner) ** 2 / schur - np.log(schur)

        longest = MAX_STEP / np.array(shape[::-1], dtype=float)[:free]
        # A thousandth of a cell: rounding and third derivative are both small.
        moved = climb(cost, point[:free], 4e-3 * longest, longest, max_steps)
        return np.append(moved, point[free:])

    def _jointly_moved(self, points, precisions, residual, lam):
        """One Gauss-Newton step of all points on (67)."""
        shape, count = self.model.shape, len(points)
        if count < 2:
            return points
        axes = 2 if shape[0] > 1 else 1
        start, gammas = np.array(points), np.array(precisions)

        def cost(moves):
            return log_evidence(object_atoms(start + moves, shape), residual, gammas, lam)

        atoms = object_atoms(start, shape)
        covariance, mean = posterior(atoms, residual, gammas, lam)
        gradient, moved = [], []
        for axis in range(axes):
            for index in range(count):
                shift = np.zeros((count, 2))
                shift[index, axis] = step = 1e-3 / shape[1 - axis]
                gradient.append((cost(shift) - cost(-shift)) / (2.0 * step))
                ahead, behind = (object_atoms(start + s, shape)[:, index] for s in (shift, -shift))
                moved.append(mean[index] * (ahead - behind) / (2.0 * step))
        derivatives = np.array(moved).T
        kept = derivatives - lam * atoms @ (covariance @ (atoms.conj().T @ derivatives))
        curvature = 2.0 * lam * (derivatives.conj().T @ kept).real
        step = np.linalg.solve(curvature, np.array(gradient))
        if gradient @ step < 2.0 * NO_GAIN:
            return points
        moves = np.zeros((count, 2))
        moves[:, :axes] = step.reshape(axes, count).T
        moves *= min(1.0, MAX_STEP / np.max(np.abs(moves) * np.array(shape[::-1])))
        for _ in range(3):
            if cost(moves) >= cost(np.zeros_like(moves)):
                return list(start + moves)
            moves = moves / 4.0
        return points


def _event(kind, ramp):
    return ComponentEvent(kind=kind, snr_db=0.0, threshold_db=0.0, ramp=ramp)

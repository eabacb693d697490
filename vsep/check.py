"""Rules that every estimator and every mitigation method must keep, checked on a small frame.

They are what runs rely on: a state can be kept, stepped back to, sent to another process and gone
on with, and nothing but the received frame plays a part.
"""

import pickle
from dataclasses import dataclass, is_dataclass
from inspect import Parameter, signature
from typing import Any, TypeAlias

import numpy as np

from vsep._state_tree import first_difference, leaves
from vsep._typing import BoolArray, ComplexArray
from vsep.errors import InputError
from vsep.inference.core.estimator import EstimatorEntry
from vsep.inference.core.progress import IterationInfo, Termination
from vsep.inference.core.run import guarded_step
from vsep.inference.core.state import SeparationState
from vsep.mitigation.entry import MitigationEntry
from vsep.mitigation.method import MitigationState
from vsep.registry import Entry
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel

MAX_ITERATIONS = 10_000  # of what names no limit of its own
SCALE = 2.0**-30  # exact in floating point: whatever it changes is a constant with a unit
SCALE_TOLERANCE = 1e-6
MUTABLE = (list, dict, set, bytearray)
_Data: TypeAlias = tuple[Any, ...]


def check_estimator(estimator: Any) -> None:
    """Check that an estimator keeps the rules of `vsep.inference.core.estimator.Estimator`.

    - ``init``, ``step`` and ``terminate`` take the received frame, the state and the diagnostics,
      and nothing else.
    - ``init`` refuses NaN and another shape with `InputError`.
    - ``step`` is pure: its arguments stay as they are, and the same arguments give the same result
      to the last bit.
    - States are immutable: frozen records, tuples and read-only arrays.
    - Estimator and states can be pickled; a run resumed from one goes on as the
      uninterrupted run.
    - A run ends within ``max_iterations``, with finite results.
    - A frame times a constant gives the same objects, their signal times the constant.

    Parameters
    ----------
    estimator : Estimator, class or EstimatorEntry
        A class or an entry is made with a small model, and checked for a name, a label and help.

    Raises
    ------
    AssertionError
        If it breaks a rule; the sentence names it.
    InputError
        If it is nothing to be checked, or its settings do not go together.

    Examples
    --------
    >>> from vsep.inference.objects.object_only import ObjectOnlySeparator
    >>> check_estimator(ObjectOnlySeparator)
    """
    if not _is_ready(estimator):
        entry = EstimatorEntry.of(estimator)
        _check_entry(entry)
        model = _small_model()
        mask = _burst_mask(model) if entry.needs_mask else None
        estimator = entry.make(model=model, **entry.accepted(mask=mask))
    name = type(estimator).__name__
    _require(name, hasattr(estimator, "model"), "has no model")
    _require(name, np.isfinite(estimator.threshold_db), "has no finite threshold_db")
    _check_parameters(estimator, ("received",), info=True)
    received = _received(estimator.model)
    _check_refusals(name, estimator, received)
    subject = _Subject(name, estimator, (received,), SeparationState, has_info=True)
    end = _check_run(subject)
    scaled = _check_end(subject, _run(subject, (SCALE * received,)))
    _require(
        name,
        end.objects.num_components == scaled.objects.num_components,
        f"finds {end.objects.num_components} objects, and {scaled.objects.num_components} in the "
        "frame times a constant: the estimate must not depend on the unit of the frame",
    )
    for signal in ("object_signal", "interference_signal"):
        _check_scaled(name, signal, getattr(end, signal), getattr(scaled, signal))


def check_mitigation(method: Any) -> None:
    """Check that a mitigation method keeps the rules of `vsep.mitigation.method.Mitigation`.

    They are those of `check_estimator`, but for refusals, which are the loop's; further, the method
    bears a name, and the cleaned frame has the shape and the precision of the one received.

    Parameters
    ----------
    method : Mitigation, class or MitigationEntry
        A class or an entry is made with its defaults, and checked for a name, a label and help.

    Raises
    ------
    AssertionError
        If it breaks a rule; the sentence names it.
    InputError
        If it is nothing to be checked, or its settings do not go together.

    Examples
    --------
    >>> from vsep.mitigation.mca import MorphologicalComponents
    >>> check_mitigation(MorphologicalComponents(iterations=5))
    """
    entry = None
    if not _is_ready(method):
        entry = MitigationEntry.of(method)
        _check_entry(entry)
        method = entry.make()
    name = getattr(method, "name", "")
    _require(type(method).__name__, isinstance(name, str) and name, "bears no name")
    if isinstance(entry, MitigationEntry) and not isinstance(entry.factory, type):
        _require(name, entry.name == name, f"is registered as {entry.name}")
    _check_parameters(method, ("received", "mask"), info=False)
    model = _small_model()
    received, mask = _received(model), _burst_mask(model)
    subject = _Subject(name, method, (received, mask), MitigationState, has_info=False)
    end = _check_run(subject)
    single = _run(subject, (received.astype(np.complex64), mask))[-1]
    for state, dtype in ((end, np.complex128), (single, np.complex64)):
        _require(
            name,
            state.cleaned.shape == received.shape and state.cleaned.dtype == dtype,
            f"cleans a frame of shape {received.shape} and type {np.dtype(dtype)} into one of "
            f"shape {state.cleaned.shape} and type {state.cleaned.dtype}; both must stay",
        )
    scaled = _check_end(subject, _run(subject, (SCALE * received, mask)))
    _check_scaled(name, "cleaned", end.cleaned, scaled.cleaned)


@dataclass(frozen=True)
class _Subject:
    """What is checked, and the data that it is given."""

    name: str
    checked: Any
    data: _Data
    state_type: type[Any]
    has_info: bool

    def step(self, data: _Data, state: Any, checked: Any = None) -> tuple[Any, Any]:
        """Return the next state and the diagnostics, None for a method without."""
        result = (self.checked if checked is None else checked).step(*data, state)
        if not self.has_info:
            return result, None
        good = isinstance(result, tuple) and len(result) == 2
        _require(self.name, good, "returns no pair of state and diagnostics from step")
        state, info = result
        _require(self.name, isinstance(info, IterationInfo), "returns no IterationInfo from step")
        return state, info

    def terminate(self, state: Any, info: Any) -> Termination:
        """Return the verdict after a step."""
        verdict = self.checked.terminate(*([state, info] if self.has_info else [state]))
        _require(
            self.name, isinstance(verdict, Termination), "returns no Termination from terminate"
        )
        return Termination(verdict)


def _check_run(subject: _Subject) -> Any:
    """Check purity, immutability, pickling, termination and resumption; return the last state."""
    name, data = subject.name, subject.data
    start = _untouched(subject, "init", data, lambda given: subject.checked.init(*given))
    _require(
        name,
        isinstance(start, subject.state_type) and start.iteration == 0,
        f"init returns no {subject.state_type.__name__} of iteration 0",
    )
    _check_immutable(name, start)
    ready = not subject.has_info and subject.terminate(start, None) is not Termination.RUNNING
    if not ready:
        _check_step(subject, start)
    states = _run(subject, data)
    _check_end(subject, states)
    middle = (len(states) - 1) // 2
    if middle > 0:
        _check_step(subject, states[middle])
    copy = _pickled(name, "cannot be pickled", subject.checked)
    paused = _pickled(name, "has states that cannot be pickled", states[middle])
    resumed = _run(subject, data, paused, copy)
    difference = first_difference(tuple(states[middle:]), tuple(resumed), "state")
    _require(
        name,
        difference is None,
        "resumed from a pickled state goes on in another way than the uninterrupted run: a state "
        "must hold all that the next step needs",
    )
    return states[-1]


def _check_step(subject: _Subject, state: Any) -> None:
    """Check that a step changes nothing and does the same again."""
    name = subject.name
    before = _pickled(name, "has states that cannot be pickled", state)
    lost = first_difference(before, state)
    _require(name, lost is None, f"loses {lost} when its state is pickled")

    def step(given: _Data) -> Any:
        return subject.step(given, state)

    first = _untouched(subject, "step", subject.data, step)
    changed = first_difference(before, state)
    _require(name, changed is None, f"changes {changed} of the state that step is given")
    difference = first_difference(first, step(subject.data), "result")
    _require(
        name,
        difference is None,
        f"gives another {difference} when step is called again with the same arguments; it must be "
        "a pure function of them",
    )
    _check_immutable(name, first[0])
    _require(
        name,
        first[0].iteration == state.iteration + 1,
        f"goes from iteration {state.iteration} to {first[0].iteration}; a step is one iteration",
    )


def _run(subject: _Subject, data: _Data, state: Any = None, checked: Any = None) -> list[Any]:
    """Return all states of a run, the one it starts from first."""
    limit = getattr(subject.checked, "max_iterations", MAX_ITERATIONS)
    data = tuple(_read_only(each) for each in data)
    method = subject.checked if checked is None else checked
    states = [method.init(*data) if state is None else state]
    if not subject.has_info and subject.terminate(states[0], None) is not Termination.RUNNING:
        return states
    # One more than the limit: debiasing comes after the last iteration of a solver.
    while len(states) <= limit + 1:
        if subject.has_info:
            step = guarded_step(method, data[0], states[-1])
            _require(
                subject.name,
                step.termination is not Termination.NONFINITE,
                "breaks down: a result is not finite",
            )
            new, verdict = step.state, step.termination
        else:
            new, _ = subject.step(data, states[-1], method)
            verdict = subject.terminate(new, None)
        states.append(new)
        if verdict is not Termination.RUNNING:
            return states
    raise AssertionError(f"{subject.name} has not terminated after {limit} iterations.")


def _check_end(subject: _Subject, states: list[Any]) -> Any:
    """Check that the last state is finite, and return it."""
    for path, value in leaves(states[-1]):
        if path.rpartition(".")[2] in ("cleaned", "object_signal", "interference_signal"):
            _require(subject.name, np.all(np.isfinite(value)), f"ends with a {path} not finite")
    return states[-1]


def _check_scaled(name: str, signal: str, end: ComplexArray, scaled: ComplexArray) -> None:
    error = float(np.abs(scaled / SCALE - end).max())
    _require(
        name,
        error <= SCALE_TOLERANCE * float(np.abs(end).max()),
        f"scales {signal} by another factor than the frame; the result must not depend on the unit "
        "of the frame",
    )


def _check_entry(entry: Entry) -> None:
    for field in ("name", "label", "help"):
        _require(entry.name or "The entry", getattr(entry, field).strip(), f"has no {field}")


def _check_parameters(checked: Any, data: tuple[str, ...], *, info: bool) -> None:
    """Check what the three functions are given: nothing that could hold the truth."""
    wanted = {
        "init": data,
        "step": (*data, "state"),
        "terminate": ("state", "info") if info else ("state",),
    }
    name = type(checked).__name__
    for function, expected in wanted.items():
        _require(name, hasattr(checked, function), f"has no {function}")
        parameters = signature(getattr(checked, function)).parameters.values()
        listed = [each.name for each in parameters if each.kind is not Parameter.VAR_KEYWORD]
        _require(
            name,
            len(listed) == len(expected),
            f"has {function}({', '.join(listed)}); it must be {function}({', '.join(expected)})",
        )


def _check_refusals(name: str, estimator: Any, received: ComplexArray) -> None:
    spoilt = received.copy()
    spoilt.flat[3] = np.nan
    for what, frame in (("NaN", spoilt), ("another shape", received[:, 1:])):
        try:
            estimator.init(frame)
        except InputError:
            continue
        raise AssertionError(f"{name} takes a frame with {what}; init must raise InputError.")


def _untouched(subject: _Subject, function: str, data: _Data, call: Any) -> Any:
    """Call a function, and see that the data stay as they are."""
    given = tuple(_read_only(each) for each in data)
    try:
        result = call(given)
    except ValueError as error:
        touched = "read-only" in str(error)
        _require(subject.name, not touched, f"changes the data that {function} is given")
        raise
    for before, after in zip(data, given, strict=True):
        same = np.array_equal(before, after)
        _require(subject.name, same, f"changes the data that {function} is given")
    return result


def _check_immutable(name: str, state: Any) -> None:
    for path, value in leaves(state, into_mutable=False):
        if isinstance(value, np.ndarray):
            _require(name, not value.flags.writeable, f"has a writable array in {path}")
        mutable = isinstance(value, MUTABLE)
        _require(name, not mutable, f"has a {type(value).__name__} in {path}; give a tuple")
        if is_dataclass(value) and not isinstance(value, type):
            parameters: Any = getattr(value, "__dataclass_params__", None)
            _require(name, parameters.frozen, f"has a record in {path} that is not frozen")


def _pickled(name: str, complaint: str, value: Any) -> Any:
    try:
        return pickle.loads(pickle.dumps(value))
    except Exception as error:  # pickling fails in many ways
        raise AssertionError(f"{name} {complaint}: {error}.") from error


def _read_only(array: Any) -> Any:
    array = array.copy()
    array.flags.writeable = False
    return array


def _is_ready(given: Any) -> bool:
    """Whether this is what iterates itself, not what makes it."""
    return not isinstance(given, type | Entry) and hasattr(given, "step")


def _require(name: str, condition: Any, rule: str) -> None:
    if not condition:
        raise AssertionError(f"{name} {rule}.")


def _small_model() -> SignalModel:
    return SignalModel(
        num_ramps=8,
        num_samples=64,
        sample_rate_hz=10e6,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2.5e6, rolloff=0.25),
    )


def _received(model: SignalModel) -> ComplexArray:
    """Make an (A P, N) frame: two objects, a burst in every third ramp, noise of unit power."""
    rng = np.random.default_rng(14)
    shape = model.rows_shape
    noise = rng.standard_normal((*shape, 2)) @ np.array([1.0, 1.0j]) / np.sqrt(2.0)
    ramps = np.arange(shape[0]) % model.num_ramps
    samples = np.arange(shape[1])
    objects = sum(
        level * np.exp(-2j * np.pi * (beat * samples + doppler * ramps[:, None]))
        for level, beat, doppler in ((4.0, 0.11, 0.20), (2.0, 0.19, -0.31))
    )
    return np.asarray(
        noise + objects + np.where(ramps[:, None] % 3 == 1, 10.0, 0.0) * _burst(model)
    )


def _burst(model: SignalModel) -> ComplexArray:
    """(N,) one burst of unit peak that crosses zero frequency in the middle of the ramp."""
    slope = 1.5 / model.num_samples
    start = np.array([-0.5 * slope * model.num_samples])
    burst = model.template(start, np.array([slope]))[0]
    return np.asarray(burst / np.abs(burst).max())


def _burst_mask(model: SignalModel) -> BoolArray:
    """(P, N) where the bursts of the frame are."""
    hit = np.arange(model.num_ramps) % 3 == 1
    return np.outer(hit, np.abs(_burst(model)) > 0.01)

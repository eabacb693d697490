"""Our own estimators and methods keep the rules; one that breaks a rule is told which."""
# ruff: noqa: ARG002

import dataclasses
from typing import Any

import numpy as np
import pytest

from vsep.check import _received, _small_model, check_estimator, check_mitigation
from vsep.errors import InputError
from vsep.inference.core.estimator import EstimatorEntry
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.direct import DirectMitigation
from vsep.mitigation.entry import MitigationEntry
from vsep.mitigation.method import MitigationState
from vsep.mitigation.registry import MITIGATIONS
from vsep.signal.filters import NoFilter
from vsep.signal.radar import ChirpSequence
from vsep.signal.template import SignalModel


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_keeps_the_rules(name: str) -> None:
    check_estimator(ESTIMATORS[name])


@pytest.mark.parametrize("name", MITIGATIONS)
def test_every_mitigation_method_keeps_the_rules(name: str) -> None:
    check_mitigation(MITIGATIONS[name])


def test_the_frame_of_the_check_holds_what_an_estimator_works_on() -> None:
    model = _small_model()
    state = run(FactorisedSeparator(model=model), _received(model)).state
    assert state.objects.num_components == 2
    assert [burst.ramp for burst in state.bursts] == [1, 4, 7]


def test_an_estimator_for_several_antennas_is_checked_with_its_own_model(
    small_radar: ChirpSequence,
) -> None:
    model = SignalModel.of_radar(small_radar, NoFilter(), 2)
    check_estimator(ObjectOnlySeparator(model=model))


class Altering(ObjectOnlySeparator):
    """Writes into the frame."""

    def step(self, received: Any, state: Any) -> Any:
        received *= 0.5
        return super().step(received, state)


class Counting(ObjectOnlySeparator):
    """Counts its calls, and lets the count play a part."""

    calls = 0

    def step(self, received: Any, state: Any) -> Any:
        Counting.calls += 1
        new, info = super().step(received, state)
        return dataclasses.replace(
            new, noise_precision=new.noise_precision * (1.0 + 1e-12 * Counting.calls)
        ), info


class Truthful(ObjectOnlySeparator):
    """Asks for more than the received frame."""

    def init(self, received: Any, truth: Any = None) -> Any:
        return super().init(received)


class Careless(ObjectOnlySeparator):
    """Takes any frame."""

    def init(self, received: Any) -> Any:
        good = np.resize(np.nan_to_num(np.asarray(received)), self.model.shape)
        return super().init(good)


class Endless(ObjectOnlySeparator):
    """Never has enough."""

    def terminate(self, state: Any, info: Any) -> Termination:
        return Termination.RUNNING


class Metric(ObjectOnlySeparator):
    """Adds a constant with the unit of the frame."""

    def init(self, received: Any) -> Any:
        return super().init(np.asarray(received) + 1e-3)

    def step(self, received: Any, state: Any) -> Any:
        return super().step(received + 1e-3, state)


class Infinite(ObjectOnlySeparator):
    """Breaks down."""

    def step(self, received: Any, state: Any) -> Any:
        new, info = super().step(received, state)
        return dataclasses.replace(new, noise_precision=float("inf")), info


class Alone(ObjectOnlySeparator):
    """Forgets the diagnostics."""

    def step(self, received: Any, state: Any) -> Any:
        return super().step(received, state)[0]


class Forgetful(ObjectOnlySeparator):
    """Keeps what the next step needs beside the state, so that another copy does not have it."""

    kept: list[Any] = []  # noqa: RUF012

    def step(self, received: Any, state: Any) -> Any:
        new, info = super().step(received, state)
        known = any(state is one for one in Forgetful.kept)
        factor = 1.0 + 1e-9 * known
        new = dataclasses.replace(new, noise_precision=new.noise_precision * factor)
        Forgetful.kept.append(new)
        return new, info


class Late(ObjectOnlySeparator):
    """Counts two iterations at once."""

    def step(self, received: Any, state: Any) -> Any:
        new, info = super().step(received, state)
        return dataclasses.replace(new, iteration=new.iteration + 1), info


@pytest.mark.parametrize(
    ("broken", "rule"),
    [
        (Altering, "Altering changes the data that step is given"),
        (Counting, "Counting gives another result.* when step is called again"),
        (Truthful, r"Truthful has init\(received, truth\); it must be init\(received\)"),
        (Careless, "Careless takes a frame with NaN; init must raise InputError"),
        (Endless, "Endless has not terminated after 100 iterations"),
        (Metric, "unit of the frame"),
        (Infinite, "Infinite breaks down: a result is not finite"),
        (Alone, "Alone returns no pair of state and diagnostics from step"),
        (Forgetful, "Forgetful resumed from a pickled state goes on in another way"),
        (Late, "Late goes from iteration 0 to 2"),
    ],
)
def test_an_estimator_that_breaks_a_rule_is_told_which(broken: type, rule: str) -> None:
    with pytest.raises(AssertionError, match=rule):
        check_estimator(broken)


def test_a_class_that_cannot_be_sent_to_another_process_is_told() -> None:
    class Local(ObjectOnlySeparator):
        pass

    with pytest.raises(AssertionError, match="Local cannot be pickled"):
        check_estimator(Local)


def test_what_is_no_estimator_is_refused() -> None:
    with pytest.raises(InputError, match="42 is no estimator; it must be a class"):
        check_estimator(42)
    with pytest.raises(AssertionError, match="has no help"):
        check_estimator(EstimatorEntry(name="bare", factory=lambda model: model))


@dataclasses.dataclass(frozen=True)
class Halving:
    """Halves the frame in two steps."""

    name: str = "halving"

    def init(self, received: Any, mask: Any) -> MitigationState:
        return MitigationState(iteration=0, cleaned=received)

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        cleaned = received * received.dtype.type(0.5)
        cleaned.flags.writeable = False
        return MitigationState(iteration=state.iteration + 1, cleaned=cleaned, memory=())

    def terminate(self, state: MitigationState) -> Termination:
        return Termination.CONVERGED if state.iteration == 2 else Termination.RUNNING


class Writable(Halving):
    """Hands out a writable array."""

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        return dataclasses.replace(super().step(received, mask, state), cleaned=0.5 * received)


class Listing(Halving):
    """Keeps a list."""

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        return dataclasses.replace(super().step(received, mask, state), memory=([1],))


class Growing(Halving):
    """Changes the state that it is given."""

    def init(self, received: Any, mask: Any) -> MitigationState:
        return MitigationState(iteration=0, cleaned=received, memory=Box())

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        state.memory.content += 1  # type: ignore[union-attr]
        return dataclasses.replace(super().step(received, mask, state), memory=state.memory)


class Box:
    content = 0

    def __init__(self) -> None:
        self.content = 0


class Leaky(Growing):
    """Loses something on the way to another process."""

    def init(self, received: Any, mask: Any) -> MitigationState:
        return MitigationState(iteration=0, cleaned=received, memory=LeakyBox())

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        return dataclasses.replace(Halving.step(self, received, mask, state), memory=state.memory)


class LeakyBox(Box):
    def __init__(self) -> None:
        self.content = 3

    def __setstate__(self, state: Any) -> None:
        self.content = 0


class Double(Halving):
    """Changes the precision."""

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        new = super().step(received, mask, state)
        cleaned = new.cleaned.astype(np.complex128)
        cleaned.flags.writeable = False
        return dataclasses.replace(new, cleaned=cleaned)


class Lost(Halving):
    """Ends with NaN."""

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        new = super().step(received, mask, state)
        cleaned = new.cleaned * np.complex64(np.nan)
        cleaned.flags.writeable = False
        return dataclasses.replace(new, cleaned=cleaned)


class Offset(Halving):
    """Adds a constant with the unit of the frame."""

    def step(self, received: Any, mask: Any, state: MitigationState) -> MitigationState:
        new = super().step(received, mask, state)
        cleaned = new.cleaned + received.dtype.type(1e-3)
        cleaned.flags.writeable = False
        return dataclasses.replace(new, cleaned=cleaned)


class Nodding(Halving):
    """Says yes and no."""

    def terminate(self, state: MitigationState) -> Any:
        return state.iteration < 2


class Nameless(Halving):
    """Bears no name."""

    def __init__(self) -> None:
        super().__init__(name="")


def test_a_method_of_ones_own_keeps_the_rules() -> None:
    check_mitigation(Halving())
    check_mitigation(Halving)


@pytest.mark.parametrize(
    ("broken", "rule"),
    [
        (Writable, "halving has a writable array in state.cleaned"),
        (Listing, r"halving has a list in state.memory\[0\]; give a tuple"),
        (Growing, "halving changes state.memory.content of the state that step is given"),
        (Leaky, "halving loses state.memory.content when its state is pickled"),
        (Double, "type complex64 into one of .* type complex128; both must stay"),
        (Lost, "halving ends with a state.cleaned not finite"),
        (Offset, "halving scales cleaned by another factor than the frame"),
        (Nodding, "halving returns no Termination from terminate"),
        (Nameless, "Nameless bears no name"),
    ],
)
def test_a_method_that_breaks_a_rule_is_told_which(broken: type, rule: str) -> None:
    with pytest.raises(AssertionError, match=rule):
        check_mitigation(broken())


def test_an_entry_and_its_method_bear_one_name() -> None:
    with pytest.raises(AssertionError, match="zeroed is registered as zeroing"):
        check_mitigation(
            MitigationEntry(
                name="zeroing", help="Zero.", factory=lambda: DirectMitigation("zeroed", np.where)
            )
        )

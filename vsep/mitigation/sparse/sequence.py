"""A sequence of frames: what was found in the last ones is the prior of the next."""

from collections.abc import Callable, Iterable, Iterator
from typing import Literal, NamedTuple, TypeAlias, get_args

from vsep._typing import BoolArray
from vsep._validation import require_choice
from vsep.mitigation.method import FrameArray, Mitigation, MitigationState, mitigate
from vsep.mitigation.sparse.prior import PriorModel, SeenFrame

Source: TypeAlias = Literal["recovered", "original"]


class SequenceStep(NamedTuple):
    """One frame of a sequence."""

    state: MitigationState  #: the last state of the frame's run
    history: tuple[SeenFrame, ...]  #: what the run knew of earlier frames


def mitigate_sequence(
    make_method: Callable[[tuple[SeenFrame, ...]], Mitigation],
    frames: Iterable[tuple[FrameArray, BoolArray]],
    prior: PriorModel,
    *,
    source: Source = "recovered",
) -> Iterator[SequenceStep]:
    """Repair frame after frame with the prior of the frames before.

    Parameters
    ----------
    make_method : callable
        Takes the history, returns the method for the next frame, for example
        ``lambda history: pm_ist(history=history)``.
    frames : iterable of pairs
        (P, N) received frames with their masks, in the order of time.
    prior : PriorModel
        Sees the frames.
    source : str
        Whether peaks are looked for in the "recovered" frames or in the "original" ones.

    Yields
    ------
    SequenceStep
        Once per frame; the first frame has no history.

    Raises
    ------
    InputError
        If a frame or a mask cannot be used, or the source is unknown.
    """
    require_choice("source", source, get_args(Source))
    history: tuple[SeenFrame, ...] = ()
    for received, mask in frames:
        state = mitigate(make_method(history), received, mask)
        yield SequenceStep(state, history)
        history = prior.see(history, state.cleaned if source == "recovered" else received)

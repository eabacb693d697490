"""Separation of a sequence: one state from frame to frame, and the tracks of the objects.

`SequenceSeparator.step` is a pure function from (frame, state) to (state, frame result), as that of
an estimator is from iteration to iteration. A state holds one frame, whatever came before.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vsep._typing import ComplexArray
from vsep._validation import require_choice, require_range
from vsep.errors import InputError, shown
from vsep.files.frame import Frame
from vsep.grouping.groups import ObjectGroup, find_groups
from vsep.inference.core.progress import Solution
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.inference.factorised import FactorisedSeparator
from vsep.kernels.clock import computing_s
from vsep.parameters import PARAMETERS
from vsep.signal.filters import NoFilter
from vsep.signal.motion import CYCLE_S
from vsep.signal.radar import ChirpSequence
from vsep.signal.template import SignalModel
from vsep.tracking.tracks import Track, measured_objects, updated_tracks
from vsep.tracking.warm_start import FrameSolution, Start, separate_cold, separate_warm

_CYCLES_S = 1e-4, 10.0
_ACCELERATION = PARAMETERS["acceleration"]
_ANY_MODEL = SignalModel(
    num_ramps=1, num_samples=8, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SequenceState:
    """What the next frame of a sequence starts from.

    Parameters
    ----------
    num_frames : int
        Frames separated so far.
    radar : ChirpSequence or None
        Of the last one; a frame of another radar starts from nothing. None before the first.
    received : (A P, N) complex or None
        The last frame.
    cycles : int
        From the last frame to the next one: more than one where frames were repeated.
    last : Solution or None
        What was found in it.
    before : ObjectComponents or None
        Objects of the frame before that one, if it was a cycle before.
    tracks : tuple of Track
        Objects followed up to it, those among them that it does not show.
    next_track_id : int
        Name of the next new track.
    """

    num_frames: int = 0
    radar: ChirpSequence | None = None
    received: ComplexArray | None = None
    cycles: int = 1
    last: Solution | None = None
    before: ObjectComponents | None = None
    tracks: tuple[Track, ...] = ()
    next_track_id: int = 1


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TrackedFrame:
    """A separated frame of a sequence.

    Parameters
    ----------
    frame : Frame
        What was received.
    number : int
        Its place in the sequence, from 0.
    solution : Solution
        Objects, interference and diagnostics.
    start : {"cold", "warm", "clean", "repeated"}
        What it was separated from, see `vsep.tracking.warm_start.FrameSolution`.
    tracks : tuple of Track
        All objects that are followed; those with ``missed`` above zero are predicted only.
    seconds : float
        Time of the whole frame.
    """

    frame: Frame
    number: int
    solution: Solution
    start: Start
    tracks: tuple[Track, ...]
    seconds: float

    @property
    def state(self) -> SeparationState:
        """The end of the frame's run."""
        return self.solution.state

    @property
    def confirmed_tracks(self) -> tuple[Track, ...]:
        """Tracks that enough frames have shown."""
        return tuple(track for track in self.tracks if track.is_confirmed)

    @property
    def groups(self) -> tuple[ObjectGroup, ...]:
        """Extended objects among the frame's objects; see `tracks_of` for what follows each."""
        return find_groups(None, self.state, self.frame.radar)

    def tracks_of(self, group: ObjectGroup) -> tuple[int, ...]:
        """Numbers of the tracks of a group's lines, the oldest first: that one is the group's."""
        ids = set(self.solution.objects.component_ids[group.members].tolist())
        shown = (track for track in self.tracks if not track.missed)
        return tuple(sorted(track.track_id for track in shown if track.component_id in ids))


class SequenceSeparator:
    """Settings of the separation of a sequence.

    Parameters
    ----------
    cycle_s : float
        From frame to frame.
    warm : bool
        Whether a frame starts from the one before it; else all start from nothing.
    acceleration : {"neglected", "modelled"}
        Whether objects that accelerate are modelled, see `vsep.inference.accelerating`.
    **settings
        Those of `FactorisedSeparator` but for the model, which each frame brings.

    Raises
    ------
    InputError
        If a setting is unknown or out of its range.

    Examples
    --------
    >>> from vsep.tracking.sources import street_sequence
    >>> separator, state = SequenceSeparator(), SequenceState()
    >>> for frame in street_sequence(seed=1, num_frames=2):
    ...     state, result = separator.step(frame, state)
    >>> result.number, result.start in ("warm", "clean")
    (1, True)
    """

    def __init__(
        self,
        *,
        cycle_s: float = CYCLE_S,
        warm: bool = True,
        acceleration: str = _ACCELERATION.default,
        **settings: Any,
    ) -> None:
        require_range("cycle_s", cycle_s, *_CYCLES_S, "s")
        require_choice("acceleration", acceleration, tuple(_ACCELERATION.choices or ()))
        self.accelerating = acceleration == "modelled"
        self.cycle_s, self.warm, self._settings = cycle_s, warm, settings
        own = FactorisedSeparator.__dataclass_fields__.keys() - {"model", "missing"}
        for name, value in settings.items():
            if name not in own:
                raise InputError(
                    f"{name} is {shown(value)}; a sequence takes none; its settings are "
                    f"{', '.join(sorted({*own, 'acceleration'}))}."
                )
        FactorisedSeparator(model=_ANY_MODEL, **settings)  # checks the values at once

    def step(self, frame: Frame, state: SequenceState) -> tuple[SequenceState, TrackedFrame]:
        """Separate the next frame of a sequence.

        Parameters
        ----------
        frame : Frame
            Of the same radar as the ones before, or all starts from nothing.
        state : SequenceState
            After the frame before; ``SequenceState()`` before the first.

        Raises
        ------
        InputError
            If the frame cannot be used.
        """
        began = computing_s()
        received = frame.received if frame.antennas is None else frame.antennas
        model = SignalModel.of_radar(frame.radar, frame.assumed_filter, frame.num_antennas)
        separator = FactorisedSeparator(
            model=model, missing=frame.missing_rows(together=True), **self._settings
        )
        rows = model.check(received)
        if state.received is None or (frame.radar, rows.shape) != (
            state.radar,
            state.received.shape,
        ):
            state = SequenceState(num_frames=state.num_frames, next_track_id=state.next_track_id)
        outcome = self._outcome(separator, rows, frame.radar, state)
        repeated = outcome.start == "repeated"
        tracks, next_id = state.tracks, state.next_track_id
        if not repeated:
            tracks, next_id = updated_tracks(
                tracks,
                measured_objects(outcome.solution.state, frame.radar),
                frame.radar,
                elapsed_s=state.cycles * self.cycle_s,
                next_id=next_id,
                frame_number=state.num_frames,
            )
        after = SequenceState(
            num_frames=state.num_frames + 1,
            radar=frame.radar,
            received=rows,
            cycles=state.cycles + 1 if repeated else 1,
            last=_carried(outcome.solution),
            before=None if repeated or state.last is None else state.last.objects,
            tracks=tracks,
            next_track_id=next_id,
        )
        result = TrackedFrame(
            frame=frame,
            number=state.num_frames,
            solution=outcome.solution,
            start=outcome.start,
            tracks=tracks,
            seconds=computing_s() - began,
        )
        return after, result

    def _outcome(
        self,
        separator: FactorisedSeparator,
        rows: ComplexArray,
        radar: ChirpSequence,
        state: SequenceState,
    ) -> FrameSolution:
        if state.last is None:
            return separate_cold(separator, rows, accelerating=self.accelerating)
        if state.received is not None and np.array_equal(rows, state.received):
            return FrameSolution(state.last, "repeated", 0.0)
        # What an oscillator does to one frame says nothing of the next.
        if not self.warm or state.last.state.receiver is not None:
            return separate_cold(separator, rows, state.last.state, accelerating=self.accelerating)
        return separate_warm(
            separator,
            rows,
            state.last.state,
            radar,
            state.cycles * self.cycle_s,
            state.before,
            accelerating=self.accelerating,
        )


def _carried(solution: Solution) -> Solution:
    """Return a solution without what the last search has seen of its frame."""
    return replace(solution, state=replace(solution.state, search_cache=None))


def track(
    frames: Iterable[Frame], *, cycle_s: float = CYCLE_S, **settings: Any
) -> Iterator[TrackedFrame]:
    """Separate a sequence of frames, each from what the last one predicts, and follow its objects.

    Parameters
    ----------
    frames : iterable of Frame
        Taken one at a time, of one radar and equally spaced.
    cycle_s : float
        From frame to frame.
    **settings
        As for `SequenceSeparator`.

    Yields
    ------
    TrackedFrame
        As soon as the frame is separated. No more than the last frame is kept.

    Raises
    ------
    InputError
        If a setting or a frame cannot be used.

    Examples
    --------
    >>> from vsep.tracking.sources import street_sequence
    >>> frames = street_sequence(seed=1, num_frames=3)
    >>> [len(result.confirmed_tracks) > 0 for result in track(frames)]
    [False, False, True]
    """
    separator = SequenceSeparator(cycle_s=cycle_s, **settings)
    state = SequenceState()
    for frame in frames:
        if not isinstance(frame, Frame):
            raise InputError(f"{shown(frame)} is no frame; read_frame makes one of a file.")
        state, result = separator.step(frame, state)
        yield result

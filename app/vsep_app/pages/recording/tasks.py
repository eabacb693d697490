"""The work of the page, as pure top-level functions that any process may do.

Everything follows from the plan: the file is read and converted, what stands still left out, and
the frame is then a loaded frame of the live view, with all its antennas. Those of transmitters that
take turns receive other bursts: of them one is chosen.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.files.frame import Frame, read_frame
from vsep.files.response_file import read_response
from vsep.inference.core.progress import Step, Termination
from vsep.inference.core.state import SeparationState
from vsep.inference.registry import ESTIMATORS
from vsep.recordings.configurations.registry import configuration_values
from vsep.recordings.convert import convert_recording
from vsep.recordings.guess import Guess, guess_layouts
from vsep.recordings.interference_figures import interference_figures
from vsep.recordings.settings import RAW_FORMATS, RecordingSettings
from vsep.recordings.suggest import is_frame_file, suggest_settings
from vsep.signal.clutter import remove_static_clutter
from vsep_app.jobs.frame_store import frame_bytes
from vsep_app.jobs.run_session import Snapshot
from vsep_app.jobs.tasks import READ_S, SIGNAL, Prepared, require_frame_size
from vsep_app.jobs.tasks import advance as advance_prepared
from vsep_app.jobs.tasks import compose as compose_prepared
from vsep_app.jobs.tasks import prepare as prepare_frame
from vsep_app.jobs.worker import Limited
from vsep_app.model.picture import Picture
from vsep_app.model.settings import Plan
from vsep_app.model.static_picture import ByteArray
from vsep_app.pages.recording.stored_file import StoredFile

PREPARE_S = 60.0  # a recording of the largest size, and the first state of its estimator
FIGURES_S = 120.0  # a whole run beside
MAX_MEGABYTES = 2048


@dataclass(frozen=True, kw_only=True)
class RecordingPlan:
    """All that determines what the page shows; frozen and picklable."""

    file: StoredFile  #: The recording.
    settings: RecordingSettings  #: What it is.
    #: Whether it is a frame file and the settings are its own: it is then read as it is.
    is_frame: bool
    #: Which antenna is separated where one alone is; the last one if there are not so many.
    antenna: int
    removes_clutter: bool  #: Whether what stands still is left out.
    response: StoredFile | None  #: Measured response of the receiver.
    reference: StoredFile | None  #: Clean recording of the same kind.
    scene: Plan  #: The estimator's settings, for a loaded frame.


@dataclass(frozen=True, kw_only=True)
class FileFacts:
    """What a dropped file says of itself."""

    suggested: Mapping[str, Any]  #: Settings; None for what is needed and not known.
    is_frame: bool  #: Whether it is a frame file.
    guesses: tuple[Guess, ...] = ()  #: Layouts of a raw capture, the best one first.


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedRecording:
    """A recording that is ready for its first iteration."""

    plan: RecordingPlan  #: What it was made from.
    prepared: Prepared  #: Its frame, for the live view's estimators and pictures.
    remarks: tuple[str, ...]  #: What looks wrong with the settings, with advice.
    #: How many there are, and which is separated where one alone is.
    num_antennas: int
    antenna: int
    loudest_ramp: int  #: The ramp with the largest sample, most likely one with a burst.
    #: mapping of int to (Mp, Mn) uint8: Range-Doppler maps of the clean recording by the antenna
    #: that pictures show, scaled like that of the frame; none without such a recording.
    reference_maps: Mapping[int, ByteArray]
    reference_fault: str  #: Why there is none although a file was given; else empty.

    @property
    def initial_state(self) -> SeparationState:
        """State of iteration 0."""
        return self.prepared.initial_state


def prepare(plan: RecordingPlan) -> PreparedRecording:
    """Read the recording and make the estimator's first state.

    Raises `InputError` if the plan cannot be carried out; the message is for the user.
    """
    frame, remarks = _read(plan)
    antenna = min(plan.antenna, frame.num_antennas - 1)
    taken = _mended(frame, plan)
    prepared = prepare_frame(plan.scene, taken, antenna)
    loudest = [
        np.max(np.abs(each.observation.received), axis=1) for each in prepared.static_pictures
    ]
    references, fault = _references(plan, prepared)
    return PreparedRecording(
        plan=plan,
        prepared=prepared,
        remarks=remarks,
        num_antennas=frame.num_antennas,
        antenna=antenna,
        loudest_ramp=int(np.argmax(np.max(loudest, axis=0))),
        reference_maps=references,
        reference_fault=fault,
    )


def advance(prepared_run: PreparedRecording, state: SeparationState) -> Step:
    """Compute the step that follows `state`."""
    return advance_prepared(prepared_run.prepared, state)


def compose(
    snapshot: Snapshot[PreparedRecording, Step], ramp: int, fast_time_mode: str, antenna: int = 0
) -> Picture:
    """Make the picture of a snapshot."""
    inner: Snapshot[Prepared, Step] = Snapshot(
        run_number=snapshot.run_number,
        prepared_run=snapshot.prepared_run.prepared,
        steps=snapshot.steps,
        num_steps=snapshot.num_steps,
        phase=snapshot.phase,
    )
    return compose_prepared(inner, ramp, fast_time_mode, antenna)


def frame_content(plan: RecordingPlan, as_shown: bool) -> bytes:
    """Return a frame file of the recording.

    Parameters
    ----------
    plan : RecordingPlan
        The recording.
    as_shown : bool
        What is separated, one antenna or all, without clutter if that is left out and with the
        measured response if there is one; else all antennas as `vsep convert` writes them, with a
        response only where there is a single one: a frame file keeps that of one antenna.

    Raises
    ------
    InputError
        If the recording cannot be read.
    """
    frame, _ = _read(plan)
    if as_shown or frame.num_antennas == 1:
        frame = _mended(frame, plan if as_shown else replace(plan, removes_clutter=False))
    if as_shown and takes_one(plan.scene.estimator, plan.settings):
        frame = frame.of_antenna(min(plan.antenna, frame.num_antennas - 1))
    return frame_bytes(frame)


def capture_figures(plan: RecordingPlan) -> str:
    """Separate a capture and say what its interference comes to.

    Raises `InputError` if it cannot be read.
    """
    frame, _ = _read(plan)
    prepared = prepare_frame(plan.scene, _mended(frame, plan), plan.antenna)
    state, termination = prepared.initial_state, Termination.RUNNING
    while termination is Termination.RUNNING:
        step = advance_prepared(prepared, state)
        state, termination = step.state, step.termination
    number = state.objects.num_components
    return f"{number} objects, {interference_figures(frame, state).summary}"


def takes_one(estimator: str, settings: RecordingSettings) -> bool:
    """Whether one antenna alone is separated, although a recording may hold several."""
    return not ESTIMATORS.require(estimator).several_antennas or settings.num_transmitters > 1


def file_facts(file: StoredFile) -> FileFacts:
    """Return what a recording says of itself, with guesses of a raw capture's layout.

    Raises `InputError` if it is not what its suffix says.
    """
    with _called(file):
        suggested = suggest_settings(file.path, file.name)
        guesses: tuple[Guess, ...] = ()
        if suggested["format"] in RAW_FORMATS:
            with suppress(InputError):
                guesses = guess_layouts(file.path)
        return FileFacts(
            suggested=suggested,
            is_frame=is_frame_file(file.path, file.name),
            guesses=guesses,
        )


def require_response(file: StoredFile) -> None:
    """Raise `InputError` unless the file is a response file."""
    read_response(file.path, name=file.name)


@contextmanager
def _called(file: StoredFile) -> Iterator[None]:
    """Let sentences call a file what its owner calls it."""
    try:
        yield
    except InputError as error:
        raise InputError(str(error).replace(file.path, file.name)) from error


def _read(plan: RecordingPlan) -> tuple[Frame, tuple[str, ...]]:
    """Return the recording with all its antennas, and what looks wrong."""
    file = plan.file
    with _called(file):
        if plan.is_frame:
            return _read_frame(file), ()
        frame, remarks = convert_recording(file.path, plan.settings)
        require_frame_size(file.path, frame.num_antennas * frame.received.size)
        frame = replace(frame, name=file.name)
        return frame, tuple(remark.replace(file.path, file.name) for remark in remarks)


def _read_frame(file: StoredFile) -> Frame:
    with Archive(file.path, file.name) as archive:
        require_frame_size(file.name, archive.num_elements(SIGNAL))
    return read_frame(file.path, name=file.name)


def _mended(frame: Frame, plan: RecordingPlan) -> Frame:
    """Return what is separated: with the response, without clutter, of one transmitter."""
    antenna = min(plan.antenna, frame.num_antennas - 1)
    if plan.settings.num_transmitters > 1:
        frame = frame.of_antenna(antenna)
    if plan.response is not None:
        response = read_response(plan.response.path, name=plan.response.name)
        frame = replace(frame, anti_aliasing_filter=response.filter_of(antenna))
    if not plan.removes_clutter:
        return frame
    if frame.antennas is None:
        return replace(frame, received=remove_static_clutter(frame.received, frame.name))
    moving = remove_static_clutter(frame.antennas, frame.name)
    return replace(frame, antennas=moving, received=moving[frame.antenna])


def _references(plan: RecordingPlan, prepared: Prepared) -> tuple[dict[int, ByteArray], str]:
    """Return the maps of the clean recording, or why there are none."""
    if plan.reference is None:
        return {}, ""
    try:
        reference = _mended(_read_reference(plan, plan.reference), replace(plan, response=None))
        ours, theirs = prepared.static_picture.radar.shape, reference.radar.shape
        if ours != theirs:
            raise InputError(
                f"{reference.name} has {theirs[0]} ramps of {theirs[1]} samples; the recording has "
                f"{ours[0]} of {ours[1]}."
            )
    except InputError as error:
        return {}, str(error)
    last = reference.num_antennas - 1
    maps = {}
    for static_picture in prepared.static_pictures:
        number = static_picture.antenna.number
        own = number if static_picture.antenna.together > 1 else plan.antenna
        maps[number] = static_picture.map_of(reference.of_antenna(min(own, last)).received)
    return maps, ""


def _read_reference(plan: RecordingPlan, file: StoredFile) -> Frame:
    """Read the clean recording: what the settings say holds for it as well.

    A frame file beside a recording of another kind speaks for itself.
    """
    with _called(file):
        own = is_frame_file(file.path, file.name)
        if own and (plan.is_frame or not is_frame_file(plan.file.path, plan.file.name)):
            return _read_frame(file)
        return replace(convert_recording(file.path, plan.settings)[0], name=file.name)


def _limited(function: Callable[..., Any], seconds: float = READ_S) -> Limited:
    return Limited(function=function, what="The file", seconds=seconds, megabytes=MAX_MEGABYTES)


# For the pool: a file may claim whatever it likes.
FILE_FACTS, REQUIRE_RESPONSE = _limited(file_facts), _limited(require_response)
SETTINGS_VALUES = _limited(configuration_values)
FIGURES = _limited(capture_figures, FIGURES_S)
FRAME_CONTENT, PREPARE = _limited(frame_content, PREPARE_S), _limited(prepare, PREPARE_S)

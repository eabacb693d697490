"""The work of the page, as pure top-level functions that any process may do.

Everything follows from the plan: the file is read and converted, one antenna chosen, what stands
still left out, and the frame is then a loaded frame of the live view.
"""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.backdrop import ByteArray
from app.picture import Picture
from app.recording.files import StoredFile
from app.session import Snapshot
from app.settings import Plan
from app.work import Prepared
from app.work import advance as advance_prepared
from app.work import compose as compose_prepared
from app.work import prepare as prepare_frame
from vsep._arrays import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.files.response_file import read_response
from vsep.inference.state import SeparationState, Step
from vsep.recordings.convert import convert_recording
from vsep.recordings.settings import RecordingSettings
from vsep.recordings.suggest import is_frame_file
from vsep.signal.clutter import moving_part


@dataclass(frozen=True, kw_only=True)
class RecordingPlan:
    """All that determines what the page shows; frozen and picklable.

    Parameters
    ----------
    file : StoredFile
        The recording.
    settings : RecordingSettings
        What it is.
    is_frame : bool
        Whether it is a frame file and the settings are its own: it is then read as it is.
    antenna : int
        Which antenna; the last one if there are not so many.
    removes_clutter : bool
        Whether what stands still is left out.
    response : StoredFile or None
        Measured response of the receiver.
    reference : StoredFile or None
        Clean recording of the same kind.
    scene : Plan
        The estimator's settings, for a loaded frame.
    """

    file: StoredFile
    settings: RecordingSettings
    is_frame: bool
    antenna: int
    removes_clutter: bool
    response: StoredFile | None
    reference: StoredFile | None
    scene: Plan


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordingOpening:
    """A recording that is ready for its first iteration.

    Parameters
    ----------
    plan : RecordingPlan
        What it was made from.
    prepared : Prepared
        Its frame, for the live view's estimators and pictures.
    remarks : tuple of str
        What looks wrong with the settings, with advice.
    num_antennas, antenna : int
        How many there are, and which is shown.
    loudest_ramp : int
        The ramp with the largest sample, most likely one with a burst.
    reference_map : (Mp, Mn) uint8 or None
        Range-Doppler map of the clean recording, scaled like that of the frame.
    reference_fault : str
        Why there is none although a file was given; else empty.
    """

    plan: RecordingPlan
    prepared: Prepared
    remarks: tuple[str, ...]
    num_antennas: int
    antenna: int
    loudest_ramp: int
    reference_map: ByteArray | None
    reference_fault: str

    @property
    def initial_state(self) -> SeparationState:
        """State of iteration 0."""
        return self.prepared.initial_state


def prepare(plan: RecordingPlan) -> RecordingOpening:
    """Read the recording and make the estimator's first state.

    Raises
    ------
    InputError
        If the plan cannot be carried out; the message is for the user.
    """
    frame, remarks = _read(plan)
    shown = _shown(frame, plan)
    prepared = prepare_frame(plan.scene, shown)
    reference, fault = _reference(plan, prepared)
    return RecordingOpening(
        plan=plan,
        prepared=prepared,
        remarks=remarks,
        num_antennas=frame.num_antennas,
        antenna=min(plan.antenna, frame.num_antennas - 1),
        loudest_ramp=int(np.argmax(np.max(np.abs(shown.received), axis=1))),
        reference_map=reference,
        reference_fault=fault,
    )


def advance(opening: RecordingOpening, state: SeparationState) -> Step:
    """Compute the step that follows `state`."""
    return advance_prepared(opening.prepared, state)


def compose(snapshot: Snapshot[RecordingOpening, Step], ramp: int, fast_time_mode: str) -> Picture:
    """Make the picture of a snapshot."""
    inner: Snapshot[Prepared, Step] = Snapshot(
        run_number=snapshot.run_number,
        opening=snapshot.opening.prepared,
        steps=snapshot.steps,
        num_steps=snapshot.num_steps,
        phase=snapshot.phase,
    )
    return compose_prepared(inner, ramp, fast_time_mode)


def frame_content(plan: RecordingPlan, *, as_shown: bool) -> bytes:
    """Return a frame file of the recording.

    Parameters
    ----------
    plan : RecordingPlan
        The recording.
    as_shown : bool
        The antenna that is shown, without clutter if that is left out; else all antennas, as
        `vsep convert` writes them. Either has the measured response where there is one and it can
        belong to the signal: a frame file keeps that of a single antenna.

    Raises
    ------
    InputError
        If the recording cannot be read.
    """
    frame, _ = _read(plan)
    if as_shown or frame.num_antennas == 1:
        frame = _shown(frame, plan if as_shown else replace(plan, removes_clutter=False))
    with tempfile.TemporaryDirectory(prefix="vsep-") as folder:
        path = Path(folder) / "frame.npz"
        write_frame(path, frame)
        return path.read_bytes()


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
    except MemoryError as error:
        raise InputError(f"{file.name} needs more memory than this machine has.") from error


def _read(plan: RecordingPlan) -> tuple[Frame, tuple[str, ...]]:
    """Return the recording with all its antennas, and what looks wrong."""
    file = plan.file
    with _called(file):
        if plan.is_frame:
            return read_frame(file.path, name=file.name), ()
        frame, remarks = convert_recording(file.path, plan.settings)
        frame = replace(frame, name=file.name)
        return frame, tuple(remark.replace(file.path, file.name) for remark in remarks)


def _shown(frame: Frame, plan: RecordingPlan) -> Frame:
    """Return the frame of the antenna that is shown."""
    antenna = min(plan.antenna, frame.num_antennas - 1)
    changes: dict[str, Any] = {}
    if frame.antennas is not None:
        changes |= {"received": frame.antennas[antenna], "antennas": None, "antenna": 0}
        changes["antenna_spacing_wavelengths"] = None
    if plan.response is not None:
        response = read_response(plan.response.path, name=plan.response.name)
        changes["anti_aliasing_filter"] = response.filter_of(antenna)
    frame = replace(frame, **changes)
    if plan.removes_clutter:
        frame = replace(frame, received=moving_part(frame.received, frame.name))
    return frame


def _reference(plan: RecordingPlan, prepared: Prepared) -> tuple[ByteArray | None, str]:
    """Return the map of the clean recording, or why there is none."""
    if plan.reference is None:
        return None, ""
    try:
        reference = _shown(_read_reference(plan, plan.reference), replace(plan, response=None))
        ours, theirs = prepared.backdrop.radar.shape, reference.radar.shape
        if ours != theirs:
            raise InputError(
                f"{reference.name} has {theirs[0]} ramps of {theirs[1]} samples; the recording has "
                f"{ours[0]} of {ours[1]}."
            )
    except InputError as error:
        return None, str(error)
    return prepared.backdrop.map_of(reference.received), ""


def _read_reference(plan: RecordingPlan, file: StoredFile) -> Frame:
    """Read the clean recording: what the settings say holds for it as well.

    A frame file beside a recording of another kind speaks for itself.
    """
    with _called(file):
        own = is_frame_file(file.path, file.name)
        if own and (plan.is_frame or not is_frame_file(plan.file.path, plan.file.name)):
            return read_frame(file.path, name=file.name)
        return replace(convert_recording(file.path, plan.settings)[0], name=file.name)

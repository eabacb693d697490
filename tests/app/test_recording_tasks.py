"""The work of the page of recorded data: from files to frames, and what it says of bad ones."""

import io
import pickle
import tracemalloc
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from vsep_app.jobs.run_session import Phase, Snapshot
from vsep_app.jobs.tasks import read_upload
from vsep_app.model.settings import LOADED_FRAME, Settings
from vsep_app.pages.recording.stored_file import StoredFile
from vsep_app.pages.recording.tasks import (
    RecordingPlan,
    advance,
    compose,
    file_facts,
    frame_content,
    prepare,
    require_response,
)
from vsep_app.pages.recording.view import facts_html

from vsep.errors import InputError
from vsep.files.frame import read_frame
from vsep.recordings.settings import parse_settings
from vsep.recordings.settings_text import values_of
from vsep.recordings.suggest import suggest_settings
from vsep.signal.clutter import static_clutter


@pytest.fixture
def stored(tmp_path):
    """Writes a file under a name that its owner does not know."""

    def store(name, content):
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}-{name}"
        path.write_bytes(content)
        return StoredFile(path=str(path), name=name)

    return store


def packed(**arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def plan_of(file, settings, **changes):
    scene = Settings(preset=LOADED_FRAME, max_iterations=3).plan()
    values = {"is_frame": False, "antenna": 0, "removes_clutter": False, "response": None}
    values |= {"reference": None, "scene": scene}
    return RecordingPlan(file=file, settings=settings, **(values | changes))


@pytest.fixture
def raw_plan(stored, raw_capture):
    settings = parse_settings(values_of(raw_capture.settings.decode()))
    return plan_of(stored("adc.bin", raw_capture.content), settings)


def test_a_raw_capture_becomes_the_frame_that_it_holds(raw_plan, raw_capture):
    prepared_run = pickle.loads(pickle.dumps(prepare(raw_plan)))
    received = prepared_run.prepared.observation.received
    largest = np.max(np.abs(raw_capture.received))
    # Rounded to words of 16 bits at 0.9 of full scale, half a unit in both parts.
    scale = np.vdot(received, raw_capture.received).real / np.vdot(received, received).real
    error = np.max(np.abs(scale * received - raw_capture.received))
    assert error <= 1.01 * largest * np.sqrt(0.5) / (2**15 * 0.9)
    power = np.max(np.abs(raw_capture.received), axis=1)
    assert (prepared_run.loudest_ramp, prepared_run.num_antennas) == (int(np.argmax(power)), 1)
    assert prepared_run.remarks == ()


def test_its_run_streams_pictures_as_the_live_view_does(raw_plan):
    prepared_run = prepare(raw_plan)
    step = advance(prepared_run, prepared_run.initial_state)
    snapshot = Snapshot(
        run_number=5, prepared_run=prepared_run, steps=(step,), num_steps=1, phase=Phase.PAUSED
    )
    picture = compose(snapshot, prepared_run.loudest_ramp, "level")
    assert (picture.run_number, picture.iteration, picture.ramp) == (
        5,
        1,
        prepared_run.loudest_ramp,
    )
    assert np.isfinite(picture.burst_level_db[prepared_run.loudest_ramp])


def test_the_other_sign_is_advised_against(raw_plan):
    wrong = replace(raw_plan, settings=replace(raw_plan.settings, sign="positive"))
    html = facts_html(prepare(wrong))
    assert "sign (positive) is perhaps the other one" in html
    assert "adc.bin</strong>: 16 ramps of 128 samples" in html
    assert "largest sample in ramp" in facts_html(prepare(raw_plan))
    assert "are consistent" in facts_html(prepare(raw_plan))
    assert facts_html(None, "a < b").count("a &lt; b") == 1


@pytest.fixture
def frame_plan(stored, frame_arrays):
    """A frame of three antennas and twelve ramps with a filter of its own."""
    rng = np.random.default_rng(3)
    shape = (3, 12, 32)
    received = rng.normal(size=shape) + 1j * rng.normal(size=shape) + 4.0
    arrays = frame_arrays(received=received, filter_kind="none", beat_sign=1)
    file = stored("own.npz", packed(**arrays))
    settings = parse_settings(suggest_settings(file.path, file.name))
    return plan_of(file, settings, is_frame=True), received


def test_all_antennas_are_separated_together_with_the_filter_of_the_file(frame_plan):
    plan, received = frame_plan
    prepared_run = prepare(plan)
    assert prepared_run.num_antennas == len(prepared_run.prepared.static_pictures) == 3
    rows = received.conj().reshape(36, 32)
    assert np.array_equal(prepared_run.prepared.observation.received, rows)
    assert prepared_run.prepared.estimator.model.anti_aliasing_filter.kind == "none"
    assert "3 antennas, separated together" in facts_html(prepared_run)
    step = advance(prepared_run, prepared_run.initial_state)
    shown = Snapshot(
        run_number=1, prepared_run=prepared_run, steps=(step,), num_steps=1, phase=Phase.PAUSED
    )
    for antenna in (0, 2):
        fast = compose(shown, 5, "real", antenna).fast_time
        np.testing.assert_array_equal(fast.received, received[antenna, 5].real)
        np.testing.assert_array_equal(
            fast.object_estimate, step.state.object_signal[12 * antenna + 5].real
        )


def test_an_antenna_alone_is_chosen_for_joint_and_of_transmitters_that_take_turns(frame_plan):
    plan, received = frame_plan
    joint = replace(plan, scene=replace(plan.scene, estimator="joint"))
    turns = replace(plan, settings=replace(plan.settings, num_transmitters=2), is_frame=True)
    for alone, antenna, shown in ((joint, 1, 1), (joint, 7, 2), (turns, 1, 1)):
        prepared_run = prepare(replace(alone, antenna=antenna))
        assert (prepared_run.antenna, prepared_run.num_antennas) == (shown, 3)
        assert f"antenna {shown} of 3, separated alone" in facts_html(prepared_run)
        assert np.array_equal(prepared_run.prepared.observation.received, received[shown].conj())
        assert prepared_run.prepared.estimator.model.anti_aliasing_filter.kind == "none"


def test_a_setting_changed_by_hand_leaves_the_filter_of_the_frame(frame_plan):
    plan, received = frame_plan
    changed = replace(plan, is_frame=False, settings=replace(plan.settings, sign="negative"))
    prepared_run = prepare(changed)
    assert np.array_equal(prepared_run.prepared.observation.received, received.reshape(36, 32))
    assert prepared_run.prepared.estimator.model.anti_aliasing_filter.kind == "none"
    own = replace(plan.scene, assume_true_filter=False, assumed_kind="butterworth")
    chosen = prepare(replace(changed, scene=own)).prepared.estimator.model.anti_aliasing_filter
    assert chosen.kind == "butterworth"


def test_what_stands_still_is_left_out(frame_plan):
    plan, received = frame_plan
    prepared_run = prepare(replace(plan, removes_clutter=True))
    moving = [each - static_clutter(each) for each in received.conj()]
    assert np.array_equal(prepared_run.prepared.observation.received, np.concatenate(moving))


def test_a_response_takes_the_place_of_the_filter(frame_plan, stored):
    plan, _ = frame_plan
    frequency = np.linspace(-2.5e6, 2.5e6, 65)
    gains = np.exp(-((frequency / 2e6) ** 2)) * np.array([[1.0], [0.5j], [0.25]])
    file = stored(
        "response.npz",
        packed(filter_kind="measured", filter_frequency_hz=frequency, filter_response=gains),
    )
    require_response(file)
    prepared_run = prepare(replace(plan, response=file, antenna=1))
    assert prepared_run.prepared.estimator.model.anti_aliasing_filter.kind == "measured"
    shown = read_frame(io.BytesIO(frame_content(replace(plan, response=file), True)))
    assert shown.anti_aliasing_filter.kind == "measured"
    with pytest.raises(InputError, match=r"^own.npz holds no array .filter_frequency_hz"):
        require_response(plan.file)


def test_frames_are_saved_whole_or_as_shown(frame_plan):
    plan, received = frame_plan
    plan = replace(plan, antenna=2, removes_clutter=True)
    whole = read_frame(io.BytesIO(frame_content(plan, False)))
    assert np.array_equal(whole.antennas, received.conj())
    assert whole.beat_sign == 1
    shown = read_frame(io.BytesIO(frame_content(plan, True)))
    rows = prepare(plan).prepared.observation.received
    assert np.array_equal(shown.antennas, rows.reshape(received.shape))
    joint = replace(plan, scene=replace(plan.scene, estimator="joint"))
    alone = read_frame(io.BytesIO(frame_content(joint, True)))
    assert alone.antennas is None
    assert np.array_equal(alone.received, prepare(joint).prepared.observation.received)


def test_a_clean_recording_is_shown_on_the_same_scale(raw_plan, raw_capture, stored):
    itself = prepare(replace(raw_plan, reference=raw_plan.file))
    assert np.array_equal(itself.reference_maps[0], itself.prepared.static_picture.map_before)
    half = stored("half.bin", raw_capture.content[: len(raw_capture.content) // 2])
    prepared_run = prepare(replace(raw_plan, reference=half))
    assert prepared_run.reference_maps == {}
    assert prepared_run.reference_fault == (
        "half.bin has 8 ramps of 128 samples; the recording has 16 of 128."
    )
    odd = stored("odd.bin", raw_capture.content[:-2])
    fault = prepare(replace(raw_plan, reference=odd)).reference_fault
    assert fault.startswith("odd.bin holds ")


def test_a_frame_beside_a_raw_capture_speaks_for_itself(raw_plan, stored):
    frame = stored("clean.npz", frame_content(raw_plan, False))
    prepared_run = prepare(replace(raw_plan, reference=frame))
    assert np.array_equal(
        prepared_run.reference_maps[0], prepared_run.prepared.static_picture.map_before
    )


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("cut.bin", b"\x01\x02\x03", "cut.bin holds 3 bytes"),
        ("a.npy", b"no array", "a.npy is damaged"),
        ("a.mat", b"no file of MATLAB", "a.mat is no MATLAB file"),
        ("a.npz", b"PK no archive", "a.npz is not a frame file"),
    ],
)
def test_bad_files_are_called_by_their_names(raw_plan, stored, name, content, sentence):
    kind = {"a.npy": "npy", "a.mat": "mat", "a.npz": "npz"}.get(name, "dca1000-xwr16xx")
    settings = replace(raw_plan.settings, format=kind)
    with pytest.raises(InputError, match=f"^{sentence}"):
        prepare(replace(raw_plan, file=stored(name, content), settings=settings))


def zeros_archive(count):
    """A frame file of that many samples; it zips to a thousandth and is refused by its header."""
    file = io.BytesIO()
    header = io.BytesIO()
    kind = {"descr": "<c16", "fortran_order": False, "shape": (count,)}
    np.lib.format.write_array_header_1_0(header, kind)
    with (
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("received.npy", "w", force_zip64=True) as member,
    ):
        member.write(header.getvalue())
        for _ in range(count // 2**20):
            member.write(bytes(16 * 2**20))
    return file.getvalue()


def test_a_frame_of_too_many_samples_is_refused_before_it_is_expanded():
    content = zeros_archive(16 * 2**20)
    tracemalloc.start()
    with pytest.raises(
        InputError, match=r"^big.npz holds 16777216 samples; at most 8388608 are taken"
    ):
        read_upload("big.npz", content)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 4 * 2**20


def test_too_few_ramps_for_clutter_are_a_sentence(stored, frame_arrays):
    file = stored("short.npz", packed(**frame_arrays()))
    settings = parse_settings(suggest_settings(file.path, file.name))
    plan = plan_of(file, settings, is_frame=True, removes_clutter=True)
    with pytest.raises(InputError, match=r"short.npz has 4 ramps; to remove clutter at least 8"):
        prepare(plan)


def test_a_file_of_another_kind_is_called_by_its_name(stored):
    file = stored("adc.xyz", b"\x89HDF\r\n\x1a\n" + bytes(1000))
    with pytest.raises(InputError, match=r"^adc\.xyz is damaged or no HDF5 file"):
        file_facts(file)

"""Every parser of user text and files under bad input: one sentence, in little time and memory."""

import contextlib
import io
import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import h5py
import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from vsep_app.model.compare_settings import parse_choice
from vsep_app.model.url import parse_iteration, parse_query
from vsep_app.pages.separability.url import read_map_spec
from vsep_app.report.metadata import PNG_KEY, for_html, for_pdf
from vsep_app.report.sources import of_frame, of_link, of_preset, of_report, of_rows
from vsep_app.report.spec import spec_data
from vsep_app.teaching.experiment import read_experiment

from tests.fuzzing.mutations import (
    Content,
    as_bytes,
    claimed_arrays,
    damaged,
    of_arrays,
    of_data,
    of_texts,
    revalued,
)
from tests.vsep.ros_bags import write_bag
from vsep.errors import InputError
from vsep.files.frame import read_frame
from vsep.files.response_file import read_response
from vsep.files.results import as_json, result_line
from vsep.files.timing_lines import read_timings, timing_line, write_timing_table
from vsep.inference.core.run import run
from vsep.inference.registry import make_estimator
from vsep.presets.scenes import simulate_preset
from vsep.recordings.convert import convert_recording
from vsep.recordings.guess import guess_layouts
from vsep.recordings.settings import parse_settings, read_settings
from vsep.recordings.settings_text import with_value
from vsep.recordings.suggest import suggest_settings
from vsep.separability.axes import parse_axis, parse_value
from vsep.signal.template import SignalModel
from vsep.studies.catalogue import make_study
from vsep.studies.figures import study_panels
from vsep.studies.rows import read_rows, rows_text, study_of_rows
from vsep.studies.scatter import FRAME_VALUES, scatter
from vsep.studies.study import select_points
from vsep.studies.summary import summarise
from vsep.studies.trial import run_trial

CASES = 5000
MAX_SECONDS = 5.0
MAX_BYTES = 512 * 2**20
MAX_SENTENCE = 600
RADAR = {
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 3e13,
    "sample_rate_hz": 1e7,
    "ramp_period_s": 6e-5,
}


@dataclass(frozen=True, kw_only=True)
class Parser:
    """What reads text or a file of a user."""

    name: str
    suffix: str  #: of the file that it is given
    parse: Callable[[Path], object]
    content: Callable[[], Content]  #: strategy for the file's content


@cache
def frame_arrays() -> dict[str, Any]:
    _, observation = simulate_preset("simulation-2-a", snr_db=40.0, sir_db=0.0, seed=1)
    truth = {
        "truth_beat": np.array([0.1]),
        "truth_doppler": np.array([0.2]),
        "truth_amplitude": np.array([1.0 + 0j]),
        "truth_mask": np.zeros((4, 32), bool),
    }
    return {
        "received": observation.received[:4, :32],
        **RADAR,
        "beat_sign": 1,
        "lowest_beat": -0.5,
        "antenna_spacing_wavelengths": 0.5,
        "filter_kind": "butterworth",
        "filter_cutoff_hz": 2e6,
        "filter_order": 4,
        **truth,
        "preset": "simulation-2-a",
        "snr_db": 40.0,
        "seed": 1,
    }


def archive(arrays: dict[str, Any]) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def frame_content() -> Content:
    return of_arrays(archive(frame_arrays()), frame_arrays())


def response_content() -> Content:
    arrays = {
        "filter_kind": "measured",
        "filter_frequency_hz": np.linspace(-5e6, 5e6, 65),
        "filter_response": np.ones((2, 65), complex),
        "filter_coherence": np.ones((2, 65)),
        "slope_difference_hz_per_s": 1e12,
        "num_bursts": 7,
        "beat_sign": -1,
        "sources": "a.npz",
        "version": "1",
    }
    return of_arrays(archive(arrays), arrays)


@cache
def study_rows() -> list[dict[str, Any]]:
    """Finished rows of a frame of one ramp and of one of sixteen, and a failed one."""
    one = make_study("fig-3", methods=("object-only", "no-interference"), selection="15")
    several = make_study("fig-6", methods=("object-only",))
    rows = [
        row for study in (one, several) for row in run_trial(study.trial(study.point_indices[0], 0))
    ]
    return [json.loads(line) for line in rows_text(rows).splitlines()]


def rows_content() -> Content:
    # Bound below JSON: a row is a line.
    return of_data(
        [study_rows()], lambda rows: b"".join(json.dumps(row).encode() + b"\n" for row in rows)
    )


def use_rows(path: Path) -> None:
    rows = read_rows(path)
    summarise(rows)
    study_panels(rows)
    for value in FRAME_VALUES:
        scatter(rows, value, panel="3b", method="object-only", x="sir_db")
    study_of_rows(rows, path)
    of_rows(str(path), "15/0/object-only")


def matlab_content() -> Content:
    strategies = []
    for packed in (False, True):
        file = io.BytesIO()
        data = np.ones((2, 4, 8)) + 1j
        scipy.io.savemat(file, {"adc": data, "other": np.arange(3)}, do_compression=packed)
        strategies.append(damaged(file.getvalue()))
    return st.one_of(*strategies)


def hdf5_content() -> Content:
    file = io.BytesIO()
    with h5py.File(file, "w") as content:
        data = np.ones((2, 4, 8)) + 1j
        content.create_dataset("radar/adc", data=data, chunks=(1, 4, 8), compression="gzip")
        content["adc"] = data
    return damaged(file.getvalue())


def bag_content() -> Content:
    strategies = []
    for compressed in (False, True):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "a.bag"
            write_bag(path, bytes(range(256)) * 8, 4, compressed=compressed)
            strategies.append(damaged(path.read_bytes()))
    return st.one_of(*strategies)


def sigmf_content() -> Content:
    said = {
        "global": {
            "core:datatype": "cf64_le",
            "core:sample_rate": 1e7,
            "core:version": "1.2.0",
            "core:num_channels": 2,
            "vsep:slope_hz_per_s": 3e13,
        },
        "captures": [{"core:sample_start": 0, "core:frequency": 77e9}],
        "annotations": [],
    }
    return of_data([said])


def recording(kind: str, **more: Any) -> Callable[[Path], None]:
    """A recording converted, with the settings that suit the example, and looked at without."""

    def parse(path: Path) -> None:
        for use in (
            lambda: suggest_settings(str(path), path.name),
            lambda: convert_recording(str(path), parse_settings({"format": kind, **RADAR, **more})),
        ):
            try:
                use()
            except InputError as error:
                refused = error
            else:
                refused = None
        if refused is not None:
            raise refused

    return parse


def array_content() -> Content:
    file = io.BytesIO()
    np.save(file, np.ones((4, 32)) + 1j)
    return st.one_of(damaged(file.getvalue()), claimed_arrays())


def recorded_archive_content() -> Content:
    arrays = {"adc": np.ones((4, 32)) + 1j, "other": np.zeros(3)}
    return of_arrays(archive(arrays), arrays)


def raw_content() -> Content:
    return st.one_of(
        damaged(bytes(range(256)) * 8), st.binary(max_size=64).map(lambda part: part * 32)
    )


SETTINGS: dict[str, Any] = {
    "format": "dca1000-xwr16xx",
    **RADAR,
    "num_samples": 32,
    "num_ramps": 4,
    "num_antennas": 2,
    "num_transmitters": 1,
    "sign": "positive",
    "samples": "complex",
    "adc_bits": 16,
    "axes": "ramps, samples",
    "key": "adc",
}


def yaml_content() -> Content:
    return of_texts("".join(f"{name}: {value}\n" for name, value in SETTINGS.items()))


def use_settings(path: Path) -> None:
    # The page edits the text as it stands.
    text = path.read_bytes().decode("utf-8", "replace")
    refused: list[InputError] = []
    for use in (lambda: with_value(text, "sign", "negative"), lambda: read_settings(str(path))):
        try:
            use()
        except InputError as error:
            refused.append(error)
    if refused:
        raise refused[-1]


EXPERIMENT = """title = "One"
setting = "A scene."
question = "What?"
watch = "The map."
answer = "That."
page = "compare"
[values]
preset = "simulation-2-b"
snr = 20
sir = -10.5
estimator = "joint"
methods = "iht,masked"
mask = "truth"
debias = true
interference = false
"""
QUERY = {
    "preset": "simulation-2-b",
    "snr": "20",
    "sir": "-10.5",
    "seed": "3",
    "estimator": "joint",
    "iteration": "4",
    "ramp": "3",
    "interference": "true",
}
MAP_QUERY = {
    "scene": "simulation-2-a",
    "x": "sir_db=-50:30:33",
    "y": "snr_db=0:60:7",
    "set": "num_objects=3",
    "trials": "2",
    "lab_seed": "1",
    "method": "factorised",
    "layer": "whole_db",
    "methods": "iht,masked",
    "mask": "truth",
    "debias": "true",
}
LINKS = (
    f"http://127.0.0.1:5006/?{urlencode(QUERY)}",
    "http://127.0.0.1:5006/?trial=fig-3/15/0/object-only/1/robust/9.5",
)


def use_link(path: Path) -> None:
    of_link(path.read_bytes().decode("utf-8", "surrogateescape"))


def use_query(path: Path) -> None:
    """A query as the page decodes it: texts, or JSON values."""
    query = json.loads(path.read_bytes())
    sentences = [
        *parse_query(query)[1],
        *parse_choice(query)[1],
        *parse_iteration(query)[1],
        *read_map_spec(query)[2],
    ]
    if sentences:
        raise InputError(sentences[0])


def use_words(path: Path) -> None:
    """What the command line takes as a word: axes, values, points."""
    kind, _, word = path.read_bytes().decode("utf-8", "surrogateescape").partition(" ")
    if kind == "axis":
        parse_axis(word)
    elif kind == "value":
        parse_value(word)
    else:
        select_points(make_study("fig-3").points, word)


@cache
def result_data() -> dict[str, Any]:
    scenario, observation = simulate_preset("simulation-2-a", snr_db=40.0, sir_db=-20.0, seed=1)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    solution = run(make_estimator("factorised", model), observation.received)
    line = json.loads(as_json(result_line("a.npz", solution, scenario.radar)))
    return {key: line[key] for key in ("file", "radar", "interference")}


def timing_content() -> Content:
    return of_data([result_data()])


def use_timings(path: Path) -> None:
    frames = list(read_timings(str(path)))
    for frame in frames:
        as_json(timing_line(frame))
    write_timing_table(str(path.with_name("out.csv")), frames)


@cache
def spec_of_a_frame(folder: str) -> dict[str, Any]:
    path = Path(folder) / "frame.npz"
    path.write_bytes(archive(frame_arrays()))
    return spec_data(of_frame(str(path)))


@cache
def provenances() -> list[dict[str, Any]]:
    data = spec_data(of_preset("simulation-2-a"))
    kept = {"name": "frame.npz", "sha256": "0" * 64, "npz": "AAAA"}
    return [json.loads(as_json({"spec": spec})) for spec in (data, {**data, "frame": kept})]


def in_page(data: Any) -> bytes:
    return f"<html>{for_html(data)}</html>".encode("utf-8", "surrogatepass")


def in_document(data: Any) -> bytes:
    return f"%PDF-1.4\n/Keywords ({for_pdf(data)})\n".encode()


def in_picture(data: Any) -> bytes:
    info, file = PngInfo(), io.BytesIO()
    info.add_text(PNG_KEY, as_json(data))
    Image.new("RGB", (4, 4)).save(file, format="PNG", pnginfo=info)
    return file.getvalue()


def report_content() -> Content:
    return st.one_of(
        of_data(provenances()), *(of_data(provenances()[:1], dump) for dump in CONTAINERS)
    )


CONTAINERS = (in_page, in_document, in_picture)
PARSERS = (
    Parser(name="frame", suffix=".npz", parse=read_frame, content=frame_content),
    Parser(name="response", suffix=".npz", parse=read_response, content=response_content),
    Parser(name="rows", suffix=".jsonl", parse=use_rows, content=rows_content),
    Parser(name="matlab", suffix=".mat", parse=recording("mat", key="adc"), content=matlab_content),
    Parser(name="array", suffix=".npy", parse=recording("npy"), content=array_content),
    Parser(
        name="recorded archive",
        suffix=".npz",
        parse=recording("npz", key="adc"),
        content=recorded_archive_content,
    ),
    Parser(
        name="raw words",
        suffix=".bin",
        parse=recording("dca1000-xwr16xx", num_samples=32, num_antennas=2),
        content=raw_content,
    ),
    Parser(
        name="undescribed words",
        suffix=".bin",
        parse=lambda path: guess_layouts(str(path)),
        content=lambda: damaged(bytes(range(256)) * 64),
    ),
    Parser(name="HDF5", suffix=".h5", parse=recording("hdf5", key="adc"), content=hdf5_content),
    Parser(
        name="ROS bag",
        suffix=".bag",
        parse=recording("dca1000-xwr16xx", num_samples=32, num_antennas=2),
        content=bag_content,
    ),
    Parser(
        name="SigMF",
        suffix=".sigmf-meta",
        parse=recording("sigmf", num_samples=8),
        content=sigmf_content,
    ),
    Parser(name="YAML", suffix=".yaml", parse=use_settings, content=yaml_content),
    Parser(name="JSON", suffix=".json", parse=use_settings, content=lambda: of_data([SETTINGS])),
    Parser(
        name="experiment",
        suffix=".toml",
        parse=read_experiment,
        content=lambda: of_texts(EXPERIMENT),
    ),
    Parser(name="link", suffix=".txt", parse=use_link, content=lambda: of_texts(*LINKS)),
    Parser(
        name="query",
        suffix=".json",
        parse=use_query,
        content=lambda: st.one_of(revalued(QUERY, as_bytes), revalued(MAP_QUERY, as_bytes)),
    ),
    Parser(
        name="words",
        suffix=".txt",
        parse=use_words,
        content=lambda: of_texts("axis sir_db=-40:40:33", "value snr_db=40", "points 3b,0,40-51"),
    ),
    Parser(name="result line", suffix=".jsonl", parse=use_timings, content=timing_content),
    Parser(
        name="report",
        suffix=".html",
        parse=lambda path: of_report(str(path)),
        content=report_content,
    ),
)


def memory_bytes(name: str) -> int:
    """A line of the process's status: VmRSS is what it holds now, VmHWM the most it ever held."""
    text = Path("/proc/self/status").read_text()
    return 1024 * int(text.split(f"{name}:")[1].split()[0])


def fuzz(parser: Parser, folder: Path, cases: int) -> None:
    path = folder / f"input{parser.suffix}"
    measured = Path("/proc/self/clear_refs").exists()

    @settings(
        max_examples=cases,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
        database=None,
    )
    @given(parser.content())
    def check(content: bytes) -> None:
        path.write_bytes(content)
        start = time.process_time()
        sentence = ""
        try:
            parser.parse(path)
        except InputError as error:
            sentence = str(error)
        assert time.process_time() - start < MAX_SECONDS
        assert "\n" not in sentence
        assert len(sentence) < MAX_SENTENCE

    if measured:
        # The most it ever held is counted anew.
        Path("/proc/self/clear_refs").write_text("5")
        before = memory_bytes("VmRSS")
    check()
    if measured:
        assert memory_bytes("VmHWM") - before < MAX_BYTES


@pytest.mark.parametrize("row", [0, 2], ids=("one ramp", "several ramps"))
def test_no_value_in_any_column_of_a_row_ends_in_a_traceback(row: int, tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    rows = study_rows()
    for holder, key in columns(rows[row]):
        before = holder[key]
        for value in COLUMN_VALUES:
            holder[key] = value
            path.write_text("".join(json.dumps(one) + "\n" for one in rows))
            with contextlib.suppress(InputError):
                use_rows(path)
        holder[key] = before


def columns(row: dict[str, Any]) -> list[tuple[dict[str, Any], str]]:
    """All columns of a row and of its point, each with what holds it."""
    point = row["point"]
    return [*((row, key) for key in row), *((point, key) for key in point)]


COLUMN_VALUES: tuple[Any, ...] = (
    *(None, True, -1, 2**62, 1e308, float("nan"), "a", [], [None], [0.5, 0.5], {}),
)


@pytest.mark.parametrize("parser", PARSERS, ids=lambda parser: parser.name)
def test_bad_input_is_one_sentence(parser: Parser, tmp_path: Path) -> None:
    fuzz(parser, tmp_path, CASES // 4 // len(PARSERS))


# `make test` runs the first quarter of these cases.
@pytest.mark.slow
@pytest.mark.parametrize("parser", PARSERS, ids=lambda parser: parser.name)
def test_five_thousand_bad_inputs_are_one_sentence_each(parser: Parser, tmp_path: Path) -> None:
    fuzz(parser, tmp_path, -(-CASES // len(PARSERS)))

"""``vsep report``: a frame separated and drawn."""

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vsep.errors import InputError
from vsep.inference.registry import ESTIMATORS
from vsep.parameters import PARAMETERS
from vsep.presets.record import SimulatedPreset
from vsep.presets.registry import PRESETS
from vsep_app.cli.estimator_options import (
    ESTIMATOR_SETTINGS,
    add_estimator_options,
    estimator_settings,
)
from vsep_app.cli.scene_options import ASSUMED, SCENE_OPTIONS, add_scene_options, scene_values
from vsep_app.cli.shared_options import (
    EXIT_INPUT,
    add_antenna_option,
    add_file,
    add_number,
    given,
    refuse_unused,
    require_dashboard,
    require_folder,
)
from vsep_app.report import names

DESCRIPTION = (
    "Separate a frame and draw it: as a page, a picture, a document, a recorded run or an "
    "animation, none of which asks for anything when opened."
)
EXAMPLES = """\
examples:
  vsep report frame.npz --out snapshot.html
  vsep report adc_data.bin --settings radar.cfg --out snapshot.png
  vsep report frame.npz --out snapshot.png --schedule paper --object-threshold-db 9
  vsep report --preset simulation-2-b --sir-db -30 --iterations 1,3,10 --out film.pdf
  vsep report --url 'http://127.0.0.1:5006/?preset=simulation-2-a&iteration=4' --out shared.html
  vsep report --rows fig-3.jsonl --trial 20/17/factorised --out outlier.html
  vsep report --preset simulation-2-c --record run.html --animate run.gif
  vsep report --preset simulation-2-b --record lesson.html --vary sir=-30,-20,0 --vary snr=40,60
  vsep report --from snapshot.html --out again.html
  vsep report night/*.npz --out reports
  vsep report --experiments course --scorm course.zip

A report says how it was made, and --from makes it again, the same bytes with the same versions.
"""
_SCENES = {
    **{
        name: frozenset(
            setting
            for setting in (*SCENE_OPTIONS, "no_interference")
            if isinstance(preset, SimulatedPreset)
            or setting == "no_interference"
            or PARAMETERS[setting].of_recording
        )
        for name, preset in PRESETS.items()
    },
    "a frame file": frozenset(ASSUMED),
}
_SHOWN = ("antenna", "ramp", "iteration", "iterations")
_OUTPUTS = ("out", "record", "animate")
_COURSES = ("experiments", "scorm")
_SOURCES = ("preset", "url", "trial", "made_before")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command; what is not given stays as the source has it."""
    _add_sources(parser)
    _add_shown(parser)
    _add_outputs(parser)
    add_estimator_options(parser)


def _add_sources(parser: Any) -> None:
    parser.add_argument(
        "frames",
        nargs="*",
        metavar="FRAME",
        help="a frame file, *.npz; several make a folder of reports",
    )
    add_file(
        parser,
        "--settings",
        "FRAME is a recording, and this is what it is, as for vsep convert; given again, later "
        "ones count",
        action="append",
    )
    add_antenna_option(parser)
    group = parser.add_argument_group("instead of a frame file")
    group.add_argument("--preset", choices=tuple(PRESETS), help="a scene of the dashboard")
    group.add_argument("--url", metavar="LINK", help="what a link to the live view shows")
    group.add_argument(
        "--trial",
        metavar="WHICH",
        help="a trial of a study: POINT/REALIZATION[/METHOD] with --rows, or the word in a link",
    )
    add_file(group, "--rows", "with --trial: the rows of the study")
    group.add_argument(
        "--from",
        dest="made_before",
        metavar="REPORT",
        help="make a report again from what it says (with FRAME if it does not keep its frame)",
    )
    add_scene_options(parser, "--preset and --url; what is assumed also of a frame file")


def _add_shown(parser: Any) -> None:
    group = parser.add_argument_group("what is shown")
    add_number(group, "--ramp", "(default: the one with the strongest burst)", kind=int)
    add_number(group, "--iteration", "(default: the last one)", kind=int)
    group.add_argument(
        "--iterations", type=_numbers, metavar="N,N,...", help="a filmstrip of these, at most 6"
    )


def _add_outputs(parser: Any) -> None:
    group = parser.add_argument_group("what is written, one at least")
    add_file(
        group,
        "--out",
        "*.html (interactive), *.png, *.pdf (drawn for print) or *.json (numbers alone); for "
        "several frames a folder, made if need be",
    )
    add_file(group, "--record", "*.html: a slider goes through all iterations")
    group.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="SETTING=V,V,...",
        help="with --record: runs for these values of a setting of the address, each with a slider",
    )
    add_file(
        group,
        "--experiments",
        "a folder, made if need be, with a recorded run of each guided experiment and an index; "
        "alone, as --scorm",
    )
    add_file(group, "--scorm", "*.zip: the same as a package of SCORM 1.2 for learning platforms")
    add_file(group, "--animate", "*.gif, *.webp or, with ffmpeg, *.mp4")


def _numbers(text: str) -> tuple[int, ...]:
    numbers = tuple(int(part) for part in text.split(","))
    if min(numbers) < 0:
        raise argparse.ArgumentTypeError(f"{text} is given, iterations count from 0")
    return numbers


_numbers.__name__ = "list of iterations"


def run(options: argparse.Namespace) -> int:
    """Separate what is named, and write all that is asked for."""
    if given(options, _COURSES):
        return _report_course(options)
    _require_one_source(options)
    if len(options.frames) > 1 and options.made_before is None:
        return _report_batch(options)
    _require_outputs(options)
    spec = spec_of(options)
    _module("variations").read_varied(options.vary, spec.plan)
    writer = _module("write")
    report_run = _module("run").execute(spec)
    if options.out is not None:
        writer.write_report(report_run, Path(options.out))
    if options.record is not None:
        writer.write_record(report_run, Path(options.record), vary=options.vary)
    if options.animate is not None:
        _module("animation").write_animation(report_run, Path(options.animate))
    return 0


def _module(name: str) -> Any:
    return require_dashboard(f"vsep_app.report.{name}", "report")


def spec_of(options: argparse.Namespace) -> Any:
    """Return the spec that the options describe.

    Raises
    ------
    InputError
        If the source cannot be used, or the options do not go together.
    """
    sources = _module("sources")
    if options.preset is not None:
        spec = sources.of_preset(options.preset)
    elif options.url is not None:
        spec = sources.of_link(options.url)
    elif options.made_before is not None:
        frame = sources.kept_frame(options.frames[0]) if options.frames else None
        spec = sources.of_report(options.made_before, frame)
    elif options.rows is not None:
        spec = sources.of_rows(options.rows, options.trial)
    elif options.trial is not None:
        spec = sources.of_trial(options.trial)
    elif options.settings:
        spec, remarks = sources.of_recording(options.frames[0], options.settings)
        for remark in remarks:
            sys.stderr.write(f"vsep: {remark}\n")
    else:
        spec = sources.of_frame(options.frames[0])
    return _changed(spec, options)


def _changed(spec: Any, options: argparse.Namespace) -> Any:
    """Return a spec with what was given; settings that its scene or estimator lacks are refused."""
    scene = given(options, (*SCENE_OPTIONS, "no_interference"))
    kind = spec.plan.preset if spec.plan.preset in _SCENES else "a frame file"
    refuse_unused(scene, (kind,), _SCENES)
    values = scene_values(options, asdict(spec.plan))
    estimator = ESTIMATORS.require(options.estimator or spec.plan.estimator).name
    refuse_unused(given(options, ESTIMATOR_SETTINGS), (estimator,), estimator_settings())
    return _module("sources").changed(spec, _given(options) | values)


def _given(options: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that were given, by their names in plan and spec."""
    values = given(options, ("estimator", *ESTIMATOR_SETTINGS, *_SHOWN))
    for name in ("ramp", "iteration"):
        if values.get(name, 0) < 0:
            raise InputError(f"{name} is {values[name]}; it must not be negative.")
    names.require_room(values.get("iterations", ()))
    return values


def _require_one_source(options: argparse.Namespace) -> None:
    named = [name for name in _SOURCES if getattr(options, name) is not None]
    if options.frames and options.made_before is None:
        named.append("frames")
    if len(named) != 1 or (options.rows is not None and options.trial is None):
        raise InputError(
            "One thing to report on is needed: FRAME, --preset, --url, --trial (with --rows) or "
            "--from."
        )
    if options.made_before is not None and len(options.frames) > 1:
        raise InputError(f"--from needs one frame at most, not {len(options.frames)}.")
    if options.settings and (len(options.frames) != 1 or options.made_before is not None):
        raise InputError(f"--settings {options.settings[0]} needs one recording in place of FRAME.")
    if options.antenna is not None and not options.frames:
        raise InputError(
            f"--antenna is {options.antenna}; it can only be used with a frame file, FRAME."
        )


def _require_outputs(options: argparse.Namespace) -> None:
    """Refuse outputs that cannot be written before anything is computed."""
    outputs = given(options, _OUTPUTS)
    outs = list(outputs.values())
    if not outs:
        raise InputError("Nothing to write is named; give --out, --record or --animate.")
    if options.vary and options.record is None:
        raise InputError(f"--vary {options.vary[0]} needs --record.")
    sources = (*options.frames, options.made_before, options.rows, *(options.settings or ()))
    inputs = {Path(name).resolve() for name in sources if name is not None}
    for out in outs:
        if Path(out).resolve() in inputs:
            what = "is one of the frames" if out in options.frames else "is read, too"
            raise InputError(f"{out} {what}; it must be another file.")
        require_folder(out)
    if len({Path(out).resolve() for out in outs}) < len(outs):
        raise InputError(f"{outs[0]} is named twice; give every output a file of its own.")
    checks = {
        "out": names.require_report_name,
        "record": names.require_record_name,
        "animate": names.require_animation_name,
    }
    for name, out in outputs.items():
        checks[name](out)


def _report_course(options: argparse.Namespace) -> int:
    """Write the guided experiments as pages, as a package, or both."""
    others = [*given(options, (*_OUTPUTS, *_SOURCES)), *options.frames]
    if others:
        raise InputError(f"--experiments and --scorm go alone, without {others[0]}.")
    course = _module("course")
    experiments = require_dashboard("vsep_app.teaching.experiment", "report").shipped_experiments()
    if options.scorm is not None:
        if Path(options.scorm).suffix.lower() != ".zip":
            raise InputError(f"The package {Path(options.scorm).name!r} must end in .zip.")
        require_folder(options.scorm)
        course.write_package(experiments, Path(options.scorm))
    if options.experiments is not None:
        course.write_course(experiments, Path(options.experiments))
    return 0


def _report_batch(options: argparse.Namespace) -> int:
    """Write a folder of reports with one index page; 2 if a frame could not be used."""
    if options.out is None or options.record is not None or options.animate is not None:
        raise InputError("Several frames make a folder of reports: give --out FOLDER alone.")
    sources = _module("sources")
    _changed(sources.ReportSpec(plan=sources.default_plan()), options)
    errors = _module("batch").write_batch(
        options.frames,
        Path(options.out),
        spec_of=lambda path: _changed(sources.of_frame(path), options),
    )
    for error in errors:
        sys.stderr.write(f"vsep: {error}\n")
    return EXIT_INPUT if errors else 0

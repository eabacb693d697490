"""What ``vsep report`` does once its options are read."""

import argparse
import sys
from pathlib import Path
from typing import Any

from vsep.errors import InputError

SCENE_OPTIONS = ("snr_db", "sir_db", "seed", "no_interference")
ESTIMATOR_OPTIONS = (
    "estimator",
    "mask",
    "schedule",
    "false_alarm_rate",
    "object_threshold_db",
    "interference_threshold_db",
    "max_iterations",
)
_EXIT_INPUT = 2
_OUTPUTS = ("out", "record", "animate")
_SOURCES = ("preset", "url", "trial", "made_before")


def report(options: argparse.Namespace) -> int:
    """Separate what is named, and write all that is asked for."""
    _require_one_source(options)
    if len(options.frames) > 1 and options.made_before is None:
        return _report_batch(options)
    _require_outputs(options)
    from vsep_app.report.run import execute
    from vsep_app.report.write import write_record, write_report

    run = execute(spec_of(options))
    if options.out is not None:
        write_report(run, Path(options.out))
    if options.record is not None:
        write_record(run, Path(options.record))
    if options.animate is not None:
        from vsep_app.report.animation import write_animation

        write_animation(run, Path(options.animate))
    return 0


def spec_of(options: argparse.Namespace) -> Any:
    """Return the spec that the options describe.

    Raises
    ------
    InputError
        If the source cannot be used, or the options do not go together.
    """
    from vsep_app.report import sources
    from vsep_app.report.names import require_room

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
    else:
        spec = sources.of_frame(options.frames[0])
    given = _given(options)
    require_room(given.get("iterations", ()))
    return sources.changed(spec, given)


def _given(options: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that were given, by their names in plan and spec."""
    names = (
        *ESTIMATOR_OPTIONS,
        "antenna",
        "snr_db",
        "sir_db",
        "seed",
        "ramp",
        "iteration",
        "iterations",
    )
    values = {name: getattr(options, name) for name in names}
    given = {name: value for name, value in values.items() if value is not None}
    for name in ("ramp", "iteration"):
        if given.get(name, 0) < 0:
            raise InputError(f"{name} is {given[name]}; it must not be negative.")
    return {**given, "interference": False} if options.no_interference else given


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
    scene = [name for name in SCENE_OPTIONS if getattr(options, name) not in (None, False)]
    if options.antenna is not None and not options.frames:
        raise InputError(f"--antenna is {options.antenna}; it is for frame files alone.")
    if scene and options.preset is None and options.url is None:
        option = "--" + scene[0].replace("_", "-")
        raise InputError(f"{option} is for --preset and --url; this frame is what it is.")


def _require_outputs(options: argparse.Namespace) -> None:
    """Refuse outputs that cannot be written before anything is computed."""
    from vsep_app.report.names import (
        require_animation_name,
        require_record_name,
        require_report_name,
    )

    given = {name: getattr(options, name) for name in _OUTPUTS}
    outs = [out for out in given.values() if out is not None]
    if not outs:
        raise InputError("Nothing to write is named; give --out, --record or --animate.")
    sources = (*options.frames, options.made_before, options.rows)
    inputs = {Path(name).resolve() for name in sources if name is not None}
    for out in outs:
        if Path(out).resolve() in inputs:
            what = "is one of the frames" if out in options.frames else "is read, too"
            raise InputError(f"{out} {what}; it must be another file.")
        if not Path(out).parent.is_dir():
            raise InputError(
                f"{out} cannot be written: {Path(out).parent} is no folder; make it first."
            )
    if len({Path(out).resolve() for out in outs}) < len(outs):
        raise InputError(f"{outs[0]} is named twice; give every output a file of its own.")
    checks = {
        "out": require_report_name,
        "record": require_record_name,
        "animate": require_animation_name,
    }
    for name, out in given.items():
        if out is not None:
            checks[name](out)


def _report_batch(options: argparse.Namespace) -> int:
    """Write a folder of reports with one index page; 2 if a frame could not be used."""
    if options.out is None or options.record is not None or options.animate is not None:
        raise InputError("Several frames make a folder of reports: give --out FOLDER alone.")
    from vsep_app.report.batch import write_batch
    from vsep_app.report.sources import changed, of_frame

    given = _given(options)
    errors = write_batch(
        options.frames, Path(options.out), spec_of=lambda path: changed(of_frame(path), given)
    )
    for error in errors:
        sys.stderr.write(f"vsep: {error}\n")
    return _EXIT_INPUT if errors else 0

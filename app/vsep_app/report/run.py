"""Execution of a report spec: the frame, the run, and its provenance."""

import io
import platform
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from itertools import islice
from typing import Any

import numpy as np

from vsep._typing import ComplexArray
from vsep._version import __version__
from vsep.analysis.metrics import frame_metrics
from vsep.analysis.signal_metrics import signal_metrics
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.files.frame_mask import frame_mask
from vsep.files.results import result_line
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import Solution, Step, Termination
from vsep.inference.core.run import iterate
from vsep.inference.core.state import SeparationState
from vsep.inference.registry import ESTIMATORS
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.scene import Observation
from vsep_app.jobs.tasks import (
    division_of,
    is_simulated,
    is_together,
    make_scene,
    plan_estimator,
    static_picture_of,
)
from vsep_app.model.picture import Picture, make_picture
from vsep_app.model.settings import LOADED_FRAME
from vsep_app.model.static_picture import ShownAntenna, StaticPicture, make_static_picture
from vsep_app.model.trial_link import open_trial
from vsep_app.report.spec import ReportSpec, spec_data

_LIBRARIES = ("numpy", "scipy", "numba", "bokeh", "matplotlib")


@dataclass(frozen=True, kw_only=True, eq=False)
class ReportRun:
    """A run up to the iteration that the report shows."""

    spec: ReportSpec  #: What it was made from.
    frame: Frame  #: The frame, with truth where it is known.
    assumed_filter: AntiAliasingFilter  #: What the estimator believes in.
    estimator: Estimator  #: With its settings.
    static_picture: StaticPicture  #: What all pictures share.
    initial_state: SeparationState  #: State of iteration 0.
    steps: tuple[Step, ...]  #: Iterations 1 to the one shown.

    @property
    def state(self) -> SeparationState:
        """State at the iteration shown."""
        return self.steps[-1].state if self.steps else self.initial_state

    @property
    def seen(self) -> SeparationState:
        """That state, as the antenna shown has it."""
        return self.static_picture.seen(self.state)

    @property
    def ramp(self) -> int:
        """Ramp shown: the spec's, else the one with the strongest estimated burst."""
        if self.spec.ramp is not None:
            return self.spec.ramp
        energies = (np.abs(self.seen.interference_signal) ** 2).sum(axis=1)
        return int(energies.argmax())

    def picture(self, iteration: int | None = None, ramp: int | None = None) -> Picture:
        """Make the picture of an iteration, by default of the last one and of the ramp shown."""
        return make_picture(
            self.static_picture,
            self.initial_state,
            self.steps if iteration is None else self.steps[:iteration],
            ramp=self.ramp if ramp is None else ramp,
            fast_time_mode=self.spec.fast_time,
        )

    def filmstrip(self) -> tuple[Picture, ...]:
        """Make the pictures of the filmstrip."""
        return tuple(self.picture(iteration) for iteration in self.spec.iterations)


def execute(spec: ReportSpec) -> ReportRun:
    """Make the frame of a spec and run its estimator up to the iteration that is shown.

    Raises `InputError` if the spec cannot be carried out; the message is for the user.
    """
    run = of_steps(spec, ())
    received = _received(run.frame, run.estimator)
    steps = tuple(islice(iterate(run.estimator, received), spec.iteration))
    _require_shown(spec, len(steps), run.frame.radar.num_ramps)
    return replace(run, steps=steps)


def of_steps(spec: ReportSpec, steps: tuple[Step, ...]) -> ReportRun:
    """Make the run of a spec from steps that somebody did already.

    Raises `InputError` if the spec cannot be carried out; the message is for the user.
    """
    plan = spec.plan
    scene = make_scene(plan, _loaded_frame(spec))
    frame = scene.frame
    entry = ESTIMATORS.require(plan.estimator)
    ESTIMATORS.require_settings(entry.name, {"mask": spec.mask})
    together = spec.together and is_together(plan, frame)
    # The plan has the settings of all estimators; `changed` refuses those given in vain.
    estimator = plan_estimator(
        plan,
        frame.radar,
        scene.assumed_filter,
        mask=frame_mask(frame, spec.mask) if entry.needs_mask else None,
        missing=frame.missing_rows(together=together),
        num_antennas=frame.num_antennas if together else 1,
        interference_threshold_db=spec.interference_threshold_db,
    )
    observation = Observation(received=frame.received, truth=frame.truth)
    antenna = ShownAntenna(division=division_of(frame))
    alone = make_static_picture(frame.radar, observation, title=frame.name, antenna=antenna)
    return ReportRun(
        spec=spec,
        frame=frame,
        assumed_filter=scene.assumed_filter,
        estimator=estimator,
        static_picture=static_picture_of(frame, frame.antenna) if together else alone,
        initial_state=estimator.init(_received(frame, estimator)),
        steps=steps,
    )


def provenance(run: ReportRun) -> dict[str, Any]:
    """Return what a report says of itself to a machine.

    Returns
    -------
    dict
        ``made_with``, versions; ``spec``, from which it can be made again; ``result``, as a
        result line; ``metrics``, against the truth where it is known, else null.
    """
    ended = run.steps[-1].termination if run.steps else Termination.RUNNING
    solution = Solution(
        state=run.state,
        termination=ended,
        infos=tuple(step.info for step in run.steps),
        seconds=0.0,
    )
    antenna = run.static_picture.antenna
    result = result_line(
        run.frame.name,
        solution,
        run.frame.radar,
        antenna.spacing_wavelengths,
        antenna.num_transmitters,
        run.frame.received,
    )
    del result["seconds"]  # not a function of the spec
    cleaned = run.seen.cleaned(run.frame.received)
    truth, objects = run.frame.truth, run.state.objects
    known = truth is not None and len(truth.beats) > 0
    return {
        "made_with": versions(),
        "spec": spec_data(run.spec),
        "result": result,
        "metrics": frame_metrics(truth, objects.beats, objects.dopplers, cleaned)
        | signal_metrics(truth, run.frame.received, cleaned)
        if truth is not None and known
        else None,
    }


def versions() -> dict[str, str]:
    """Return the versions of all that a report's numbers and drawings depend on."""
    libraries = {name: version(name) for name in _LIBRARIES}
    return {"vsep": __version__, "python": platform.python_version(), **libraries}


def listed_settings(run: ReportRun) -> dict[str, str]:
    """Name for a reader how the frame was made and what the estimator was told."""
    spec, plan = run.spec, run.spec.plan
    settings = _scene_settings(run)
    settings["estimator"] = plan.estimator
    if spec.mask is not None:
        settings["mask"] = spec.mask
    if "schedule" in ESTIMATORS.require(plan.estimator).settings:
        settings["schedule"] = plan.schedule
    if spec.interference_threshold_db is not None:
        settings["interference threshold"] = f"{spec.interference_threshold_db:g} dB"
    if plan.object_threshold_db is None:
        settings["false-alarm rate"] = f"{plan.false_alarm_rate:g} per frame"
    settings["object threshold"] = f"{run.estimator.threshold_db:.1f} dB"
    settings["assumed filter"] = _filter_text(run.assumed_filter)
    settings["largest number of iterations"] = str(plan.max_iterations)
    settings["made with"] = f"vsep {__version__}"
    return settings


def _scene_settings(run: ReportRun) -> dict[str, str]:
    spec, plan, told = run.spec, run.spec.plan, run.frame.settings
    if spec.trial:
        return {"trial": spec.trial}
    if plan.preset == LOADED_FRAME:
        antenna = {"antenna": _antenna_text(run)} if run.frame.num_antennas > 1 else {}
        return {**{key: told[key] for key in ("preset", "seed") if key in told}, **antenna}
    levels = {"SNR": f"{plan.snr_db:g} dB"} if is_simulated(plan) else {}
    bursts = {"interference": "none"}
    if plan.interference:
        bursts = {
            "SIR": f"{plan.sir_db:g} dB",
            "interferer slope": f"{plan.interferer_slope:g} MHz/µs",
            "burst position": f"{plan.burst_shift:g} µs",
            "interference model": plan.interference_model,
            "true filter": plan.filter_kind.replace("_", " "),
        }
    return {"preset": plan.preset, "seed": str(plan.seed), **levels, **bursts}


def _antenna_text(run: ReportRun) -> str:
    together = run.static_picture.antenna.together
    others = f" of {together}, separated together" if together > 1 else ""
    return f"{run.frame.antenna}{others}"


def _received(frame: Frame, estimator: Estimator) -> ComplexArray:
    """Return what the estimator takes: the signal of one antenna, or of all."""
    if estimator.model.num_antennas == 1 or frame.antennas is None:
        return frame.received
    return estimator.model.check(frame.antennas)


def _filter_text(assumed: AntiAliasingFilter) -> str:
    kind = assumed.kind.replace("_", " ")
    return f"{kind}, {assumed.cutoff_hz / 1e6:g} MHz" if np.isfinite(assumed.cutoff_hz) else kind


def _loaded_frame(spec: ReportSpec) -> Frame | None:
    if spec.trial:
        return open_trial(spec.trial).frame
    if spec.frame is None:
        return None
    content = io.BytesIO(spec.frame.content)
    return read_frame(content, name=spec.frame.name, antenna=spec.antenna)


def _require_shown(spec: ReportSpec, num_steps: int, num_ramps: int) -> None:
    wanted: Mapping[str, tuple[int, ...]] = {
        "iteration": () if spec.iteration is None else (spec.iteration,),
        "iterations": spec.iterations,
    }
    for name, numbers in wanted.items():
        beyond = [number for number in numbers if number > num_steps]
        if beyond:
            raise InputError(
                f"{name} holds {beyond[0]}; this run has the iterations 0 to {num_steps}."
            )
    if spec.ramp is not None and spec.ramp >= num_ramps:
        raise InputError(f"ramp is {spec.ramp}; the frame has the ramps 0 to {num_ramps - 1}.")

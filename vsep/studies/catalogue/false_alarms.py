"""Objects found in noise alone against the rate asked for."""

from vsep.presets.registry import NOISE_SCENES
from vsep.studies.methods import estimator_names
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Point, Study

_SCENES = ("noise-1", "noise-2")
_RATES = (0.01, 0.05, 0.5, 5.0)


def _panel(scene: str) -> PanelSpec:
    num_ramps, num_samples = NOISE_SCENES[scene][0].radar.shape
    return PanelSpec(
        panel=scene,
        metric="false_alarm_ratio",
        x="false_alarm_rate",
        y_label=f"false alarms found / asked for, {num_ramps} x {num_samples}",
        title="Frames of noise alone",
        log_x=True,
        guides=(("-25 %", 0.75), ("+25 %", 1.25)),
    )


STUDY = Study(
    name="false-alarms",
    title="Objects found in noise alone against the rate asked for",
    # 61 events make an interval of 25 % at the lowest rate, 0.01 a frame.
    realizations=8000,
    points=tuple(
        Point(panel=scene, scene=scene, snr_db=0.0, sir_db=0.0, false_alarm_rate=rate)
        for scene in _SCENES
        for rate in _RATES
    ),
    methods=estimator_names(),
    panels=tuple(_panel(scene) for scene in _SCENES),
)

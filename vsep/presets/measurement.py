"""The sensors of the paper's measurements: columns "Obj." and "Int. Measurement" of Table I.

The victim is that of the measurement of the interference, with the 256 samples of a ramp that were
taken; the ramps of that of the objects start at 79 GHz and are otherwise the same. The scene was
not published: objects are drawn as in Simulation II, and there is one path of interference. The
time offset is chosen so that the first ramp is crossed in its middle; with Table I's periods, 44
and 25 us, the fifth is crossed at its end, and no other.
"""

from vsep.presets.channels import direct_path, many_objects
from vsep.presets.record import SimulatedPreset
from vsep.signal.radar import ChirpSequence, InterfererSequence

_RADAR = ChirpSequence(
    start_frequency_hz=76.2e9,
    slope_hz_per_s=2.08e13,
    sample_rate_hz=40e6,
    ramp_period_s=44e-6,
    num_samples=256,
    num_ramps=32,
)
_START_HZ, _SLOPE_HZ_PER_S = 76.1e9, 2.6923e13
_CROSSING_S = 0.5 * _RADAR.num_samples / _RADAR.sample_rate_hz
# The course k_I (t' - offset) + f_I - f_0 - k t' is zero in the middle of the first ramp.
_OFFSET_S = (
    (_SLOPE_HZ_PER_S - _RADAR.slope_hz_per_s) * _CROSSING_S + _START_HZ - _RADAR.start_frequency_hz
) / _SLOPE_HZ_PER_S

PRESET = SimulatedPreset(
    name="measurement",
    label="Measurement: the paper's sensors",
    help="32 ramps of 256 samples of the sensors that the paper measured with; the scene is drawn.",
    radar=_RADAR,
    interferer=InterfererSequence(
        start_frequency_hz=_START_HZ,
        slope_hz_per_s=_SLOPE_HZ_PER_S,
        ramp_duration_s=26e-6,
        ramp_period_s=25e-6,
        num_ramps=8,
        time_offset_s=_OFFSET_S,
    ),
    draw_objects=many_objects,
    draw_paths=direct_path,
    num_objects=10,
    snr_db=60.0,
    slope_range_hz_per_s=(2.2e13, 3.2e13),
    cutoff_range_hz=(1e6, 20e6),
    shift_range_s=(-3e-6, 3e-6),
)

"""Settings of the own oscillator and receiver."""

from vsep.parameters.record import Parameter

RECEIVER_PARAMETERS = (
    Parameter(
        name="phase_jitter",
        title="Phase jitter",
        unit="mrad",
        scale=1e-3,
        help="Standard deviation of one phase a ramp, in mrad: the own oscillator begins every "
        "ramp a little earlier or later. It smears strong objects over all velocities.",
        default=0.0,
        bounds=(0.0, 1000.0),
        span=(0.0, 50.0),
        step=0.5,
        query="jitter",
        option="phase_jitter_rad",
        of_recording=False,
    ),
    Parameter(
        name="phase_noise",
        title="Phase noise",
        unit="mrad",
        scale=1e-3,
        help="Standard deviation of the own oscillator's phase within a ramp, in mrad. It raises a "
        "skirt of noise around strong objects.",
        default=0.0,
        bounds=(0.0, 500.0),
        span=(0.0, 50.0),
        step=0.5,
        query="phase_noise",
        option="phase_noise_rad",
        of_recording=False,
    ),
    Parameter(
        name="phase_noise_bandwidth",
        title="Phase noise bandwidth",
        unit="kHz",
        scale=1e3,
        help="Offset in kHz at which the spectrum of the phase noise has fallen to half: the width "
        "of the skirt.",
        default=100.0,
        bounds=(0.01, 1e6),
        span=(5.0, 1000.0),
        step=5.0,
        query="noise_bandwidth",
        option="phase_noise_bandwidth_hz",
        of_recording=False,
    ),
    Parameter(
        name="iq_gain",
        title="I/Q gain error",
        unit="dB",
        help="By how many dB the Q branch of the receiver is louder than the I branch: every "
        "object has an image at the negative distance and velocity.",
        default=0.0,
        bounds=(-6.0, 6.0),
        span=(-3.0, 3.0),
        step=0.1,
        option="iq_gain_db",
        of_recording=False,
    ),
    Parameter(
        name="iq_phase",
        title="I/Q phase error",
        unit="°",
        help="By how many ° the angle between the I and Q branches differs from 90°.",
        default=0.0,
        bounds=(-30.0, 30.0),
        span=(-15.0, 15.0),
        step=0.5,
        option="iq_phase_deg",
        of_recording=False,
    ),
    Parameter(
        name="dc_offset",
        title="DC offset",
        convention="noise deviations",
        help="A constant in all samples, as converters and leakage of the own carrier make it, in "
        "standard deviations of a sample's noise; it has no unit.",
        default=0.0,
        bounds=(0.0, 1e6),
        span=(0.0, 20.0),
        step=0.5,
        of_recording=False,
    ),
)
"""What is wrong with the own oscillator and receiver; part of the scene."""

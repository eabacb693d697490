"""Settings of scenes and estimators, one record each.

Forms, addresses, options, axes of maps and the checks of the simulator take label, unit, bounds,
default and help from here. A setting that the simulator knows is added by one entry.
"""

from collections.abc import Mapping
from typing import Any

from vsep.parameters.receiver import RECEIVER_PARAMETERS
from vsep.parameters.record import Parameter

MAX_OBJECTS = 40
MAX_CARS = 4
FILTER_KINDS = {"raised_cosine": "Raised cosine", "butterworth": "Butterworth", "none": "None"}
WAVEFORMS = {
    "chirps": "Equal chirps",
    "hopping-chirps": "Chirps with hopping starts",
    "up-and-down-chirps": "Up and down chirps",
    "two-profiles": "Chirps of two profiles",
    "stepped": "Stepped carrier (FSCW)",
    "phase-coded": "Phase code (PMCW)",
    "ofdm": "OFDM",
}
"""What another radar can send."""
DOPPLER_DIVISIONS = {
    "none": "One",
    "2/3": "Two in three Doppler bands",
    "2/4": "Two in four Doppler bands",
    "3/4": "Three in four Doppler bands",
    "4/5": "Four in five Doppler bands",
}
"""Transmitters that send in every ramp with phase steps, see `vsep.signal.doppler_division`."""
FILTER_PARTS: Mapping[str, frozenset[str]] = {
    "raised_cosine": frozenset({"cutoff", "rolloff"}),
    "butterworth": frozenset({"cutoff", "order"}),
    "none": frozenset(),
    "measured": frozenset(),
}
"""Which settings a kind of filter has."""
_MEASURED = {"measured": "Measured"}
_CUTOFF: dict[str, Any] = {
    "default": 2.55,
    "unit": "MHz",
    "scale": 1e6,
    "bounds": (1e-5, 1e5),
    "step": 0.005,
    "digits": "0.000",
}
_ROLLOFF: dict[str, Any] = {"default": 0.25, "bounds": (0.05, 1.0), "step": 0.05}
_ORDER: dict[str, Any] = {"default": 8, "bounds": (1, 12)}

SCENE_PARAMETERS = (
    Parameter(
        name="snr_db",
        title="SNR",
        unit="dB",
        convention="total",
        help="Energy of all objects of the frame over the noise power of one sample, in dB: "
        "10 log₁₀(‖Φα‖² λ), (25). More: less noise.",
        default=30.0,
        bounds=(-100.0, 200.0),
        span=(-10.0, 90.0),
        query="snr",
        of_recording=False,
    ),
    Parameter(
        name="sir_db",
        title="SIR",
        unit="dB",
        convention="total",
        help="Energy of all objects over the energy of all bursts of the frame, in dB: "
        "10 log₁₀(‖Φα‖² / ‖UΨβ‖²), (26). Less: stronger bursts.",
        default=-20.0,
        bounds=(-200.0, 200.0),
        span=(-50.0, 40.0),
        query="sir",
        of_bursts=True,
    ),
    Parameter(
        name="interference",
        title="Interference",
        help="Off: the same objects and noise without bursts.",
        default=True,
    ),
    Parameter(
        name="interferer_slope",
        title="Interferer slope",
        unit="MHz/µs",
        scale=1e12,
        help="Sweep rate kᵢ of the other radar in MHz/µs. A burst lasts band / |kᵢ - k|: the "
        "closer to the victim's slope k, the longer.",
        default=9.2,
        bounds=(0.1, 200.0),
        step=0.01,
        digits="0.000",
        query="slope",
        option="interferer_slope_hz_per_s",
        of_bursts=True,
    ),
    Parameter(
        name="interferer_waveform",
        title="Interferer waveform",
        help="What the other radar sends. A stepped carrier, a phase code and OFDM are no chirps: "
        "they are noise for as long as the victim sweeps through their band.",
        default="chirps",
        choices=WAVEFORMS,
        query="waveform",
        of_recording=False,
        of_bursts=True,
    ),
    Parameter(
        name="burst_shift",
        title="Burst position",
        unit="µs",
        scale=1e-6,
        help="Moves the crossing inside the ramp by that many µs, by delaying the other radar; 0 "
        "is the preset's.",
        default=0.0,
        bounds=(-60.0, 60.0),
        step=0.1,
        query="shift",
        option="burst_shift_s",
        of_bursts=True,
    ),
    Parameter(
        name="interference_model",
        title="Interference model",
        help="How bursts are made: the paper's product form, the exact convolution, or the exact "
        "convolution with the ramp edges of the other radar.",
        default="multiplicative",
        choices={
            "multiplicative": "Multiplicative (12)",
            "convolution": "Convolution (40)",
            "convolution-with-edges": "Convolution with ramp edges",
        },
        query="model",
        of_bursts=True,
    ),
    Parameter(
        name="second_interferer",
        title="Second interferer",
        help="A further radar with paths of its own: its bursts are 1.2 to 2 times as steep and "
        "cross every interfered ramp 15 to 35 % of a ramp earlier or later.",
        default=False,
        query="second",
        of_recording=False,
        of_bursts=True,
    ),
    Parameter(
        name="num_objects",
        title="Objects",
        help="The number of objects; a scene of more has those of a scene of fewer.",
        default=1,
        bounds=(1, MAX_OBJECTS),
        query="objects",
        of_recording=False,
    ),
    Parameter(
        name="num_cars",
        title="Cars",
        help="The number of extended objects beside the others, each of three to eight lines over "
        "1.5 to 4.5 m.",
        default=0,
        bounds=(0, MAX_CARS),
        query="cars",
        of_recording=False,
    ),
    Parameter(
        name="object_acceleration",
        title="Acceleration of objects",
        unit="m/s²",
        help="By how many m/s² every object gains or loses velocity within the frame; which, is "
        "drawn.",
        default=0.0,
        bounds=(0.0, 1e7),
        span=(0.0, 100.0),
        query="object_acceleration",
        option="acceleration_mps2",
        of_recording=False,
    ),
    Parameter(
        name="doppler_division",
        title="Transmitters",
        help="Those that send in every ramp, each with a phase step of its own: every object is "
        "seen at as many Doppler frequencies, a band apart.",
        default="none",
        choices=DOPPLER_DIVISIONS,
        query="transmitters",
        of_recording=False,
    ),
    Parameter(
        name="seed",
        title="Seed",
        help="Draws objects, phases and noise; the same seed gives the same frame.",
        default=7,
        bounds=(0, 2**63 - 1),
        span=(0, 999_999),
        typed=True,
    ),
    *RECEIVER_PARAMETERS,
)
FILTER_PARAMETERS = (
    Parameter(
        name="filter_kind",
        title="True filter",
        help="Anti-aliasing filter that shapes the bursts.",
        default="raised_cosine",
        choices=FILTER_KINDS,
        query="filter",
    ),
    Parameter(
        name="filter_cutoff",
        title="Cutoff",
        help="Frequency in MHz at which the filter passes half the amplitude: |G| = 1/2, -6 dB.",
        query="cutoff",
        **_CUTOFF,
    ),
    Parameter(
        name="filter_rolloff",
        title="Roll-off",
        help="The raised cosine falls from 1 to 0 between (1 - roll-off) and (1 + roll-off) times "
        "the cutoff; no unit.",
        query="rolloff",
        **_ROLLOFF,
    ),
    Parameter(
        name="filter_order",
        title="Order",
        help="Order n of the Butterworth filter: |G|² = 1 / (1 + 3 (f/cutoff)²ⁿ). More: a steeper "
        "edge.",
        query="order",
        **_ORDER,
    ),
    Parameter(
        name="assume_true_filter",
        title="Estimator knows the filter",
        help="Off: set the filter that the estimator assumes apart from the true one.",
        default=True,
        query="matched",
    ),
    Parameter(
        name="assumed_kind",
        title="Assumed filter",
        help="Filter the estimator believes in. Measured: only if the loaded frame brings one.",
        default="raised_cosine",
        choices=FILTER_KINDS | _MEASURED,
        query="assumed",
    ),
    Parameter(
        name="assumed_cutoff",
        title="Assumed cutoff",
        help="Half-amplitude frequency in MHz that the estimator assumes: |G| = 1/2.",
        **_CUTOFF,
    ),
    Parameter(
        name="assumed_rolloff",
        title="Assumed roll-off",
        help="Roll-off of the raised cosine that the estimator assumes; no unit.",
        **_ROLLOFF,
    ),
    Parameter(
        name="assumed_order",
        title="Assumed order",
        help="Order n that the estimator assumes: |G|² = 1 / (1 + 3 (f/cutoff)²ⁿ).",
        **_ORDER,
    ),
)
ESTIMATOR_PARAMETERS = (
    Parameter(
        name="schedule",
        title="Schedule",
        help="Robust: searches bursts anew in early iterations. Paper: the letter of the paper's "
        "Algorithms 1 to 4, which loses objects under strong bursts.",
        default="robust",
        choices={"robust": "Robust", "paper": "Paper"},
    ),
    Parameter(
        name="false_alarm_rate",
        title="False alarms a frame",
        help="Accepted number of ghosts in a frame of noise alone; sets the threshold T: "
        "N √(πT/3) exp(-T) for one ramp, NP (πT/3) exp(-T) for several.",
        default=0.05,
        bounds=(1e-9, 1e3),
        span=(1e-6, 100.0),
        values=(0.001, 0.003, 0.01, 0.03, 0.05, 0.1, 0.3, 1.0, 3.0),
        query="false_alarms",
    ),
    Parameter(
        name="object_threshold_db",
        title="Object threshold",
        unit="dB",
        help="T in dB: an object counts where its power over its own variance, ω²/ρ, exceeds it. "
        "Empty: follows from the false alarms a frame.",
        default=None,
        optional=True,
        bounds=(0.0, 100.0),
        query="threshold",
    ),
    Parameter(
        name="range_migration",
        title="Range migration",
        help="Modelled: an object that moves through range cells within the frame is one object, "
        "where radar or frame file say so. Neglected: it is one cell and satellites beside it.",
        default="modelled",
        choices={"modelled": "Modelled", "neglected": "Neglected"},
        query="migration",
    ),
    Parameter(
        name="same_slope",
        title="Same-slope ramps",
        help="Ramps with a strong tone that the others lack, as an interferer of the same slope "
        "makes. Kept: its tones come out as objects. Set aside: these ramps count as missing, and "
        "the others tell of the objects.",
        default="kept",
        choices={"kept": "Kept", "set-aside": "Set aside"},
    ),
    Parameter(
        name="acceleration",
        title="Acceleration",
        help="Modelled: an object whose velocity changes within the frame is one object, where the "
        "evidence asks for it. Neglected: it is several of different velocities.",
        default="neglected",
        choices={"neglected": "Neglected", "modelled": "Modelled"},
    ),
    Parameter(
        name="max_iterations",
        title="Iteration limit",
        help="The run stops here if it has not converged.",
        default=100,
        bounds=(1, 100_000),
        span=(1, 500),
        typed=True,
    ),
)
PARAMETERS: dict[str, Parameter] = {
    parameter.name: parameter
    for parameter in (*SCENE_PARAMETERS, *FILTER_PARAMETERS, *ESTIMATOR_PARAMETERS)
}

"""Settings of the street by their names in `vsep.parameters`, for forms and options."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from vsep.parameters import FILTER_PARAMETERS, PARAMETERS
from vsep.parameters.record import Parameter, Range
from vsep.presets.settings import chosen_filter, simulator_options
from vsep.presets.street import SIR_DB, SNR_DB
from vsep.presets.street_traffic import FILTER, OTHER_SLOPE_HZ_PER_S

STREET: Final = "street"
"""What a user calls it."""
STREET_OPTIONS: Final = (
    "snr_db",
    "sir_db",
    "interferer_slope",
    "seed",
    *(each.name for each in FILTER_PARAMETERS if each.name != "assume_true_filter"),
)
"""Settings that it has, beside whether there is interference."""
STREET_SETTINGS: Final[Mapping[str, float]] = {
    "snr_db": SNR_DB,
    "sir_db": SIR_DB,
    "interferer_slope": PARAMETERS["interferer_slope"].shown(OTHER_SLOPE_HZ_PER_S),
    "seed": 1,
    "filter_cutoff": PARAMETERS["filter_cutoff"].shown(FILTER.cutoff_hz),
    "assumed_cutoff": PARAMETERS["assumed_cutoff"].shown(FILTER.cutoff_hz),
}
"""Their values unless others are chosen, where they differ from the usual ones."""
_REFERENCE = "0 dBsm at 10 m"
STREET_PARAMETERS: Final[Mapping[str, Parameter]] = {
    **PARAMETERS,
    "snr_db": replace(
        PARAMETERS["snr_db"],
        convention=_REFERENCE,
        help="Energy |α|² of an object of 0 dBsm at 10 m over the noise power of a sample, in dB: "
        "10 log₁₀(|α|² λ). It does not change with what is in view. More: less noise.",
    ),
    "sir_db": replace(
        PARAMETERS["sir_db"],
        convention=_REFERENCE,
        help="Energy |α|² of an object of 0 dBsm at 10 m over that of a burst of a radar there, "
        "in dB. Objects fall with the fourth power of the distance, bursts with the second. Less: "
        "stronger bursts.",
    ),
    "interferer_slope": replace(
        PARAMETERS["interferer_slope"],
        help="Sweep rate kᵢ of the radars of the oncoming cars in MHz/µs; the vans' is 11.8, the "
        "own one 10. A burst lasts band / |kᵢ - k|: the closer to the own slope k, the longer.",
    ),
    "seed": replace(
        PARAMETERS["seed"],
        help="Draws the street: who passes when, what stands beside the road, and the noise.",
    ),
}
"""Records of its settings, in its own words."""
STREET_RANGES: Final[Mapping[str, Range]] = {
    "snr_db": (20.0, 80.0),
    "sir_db": (-40.0, 30.0),
    "interferer_slope": (8.0, 12.0),
    "filter_cutoff": (0.8, 5.0),
    "assumed_cutoff": (0.8, 5.0),
}
"""What a form offers."""


def street_options(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return keywords of `vsep.presets.street.street_frame`, in SI units.

    Parameters
    ----------
    values : mapping
        All settings by name; others are left out. The assumed filter is the true one where
        ``assume_true_filter`` holds.

    Examples
    --------
    >>> usual = {each.name: each.default for each in FILTER_PARAMETERS}
    >>> keywords = street_options({**usual, **STREET_SETTINGS, "interferer_slope": 9.0})
    >>> keywords["interferer_slope_hz_per_s"], keywords["assumed_filter"].cutoff_hz
    (9000000000000.0, 2550000.0)
    """
    wanted = ("snr_db", "sir_db", "seed", "interference", "interferer_slope")
    keywords = simulator_options({name: values[name] for name in wanted if name in values})
    true_filter = chosen_filter(values, "filter")
    known = values.get("assume_true_filter", False)
    return keywords | {
        "anti_aliasing_filter": true_filter,
        "assumed_filter": true_filter if known else chosen_filter(values, "assumed"),
    }

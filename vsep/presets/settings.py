"""Simulator arguments from settings that are given by their names in `vsep.parameters`."""

from collections.abc import Mapping
from typing import Any

from vsep.parameters import PARAMETERS, SCENE_PARAMETERS
from vsep.signal.filters import AntiAliasingFilter, ButterworthFilter, NoFilter, RaisedCosineFilter


def simulator_options(values: Mapping[str, Any], *, recorded: bool = False) -> dict[str, Any]:
    """Return keywords of `vsep.simulate_preset`, in SI units, of the settings of a scene.

    Parameters
    ----------
    values : mapping
        Settings by name; those that are no settings of a scene are left out.
    recorded : bool
        Whether the scene is a recorded frame: what means nothing for one is left out, too.

    Examples
    --------
    >>> simulator_options({"interferer_slope": 9.2, "ramp": 3})
    {'interferer_slope_hz_per_s': 9200000000000.0}
    """
    return {
        record.option or record.name: record.in_si(values[record.name])
        for record in SCENE_PARAMETERS
        if record.name in values and (record.of_recording or not recorded)
    }


def chosen_filter(values: Mapping[str, Any], which: str) -> AntiAliasingFilter:
    """Return the filter that settings describe.

    Parameters
    ----------
    values : mapping
        Settings by name, in the units of `vsep.parameters`.
    which : str
        "filter" for the true one, "assumed".

    Examples
    --------
    >>> values = {"filter_kind": "butterworth", "filter_cutoff": 2.5, "filter_order": 4}
    >>> chosen_filter(values, "filter")
    ButterworthFilter(cutoff_hz=2500000.0, order=4)
    """
    kind = values[f"{which}_kind"]
    if kind == "none":
        return NoFilter()
    name = f"{which}_cutoff"
    cutoff_hz = PARAMETERS[name].in_si(values[name])
    if kind == "butterworth":
        return ButterworthFilter(cutoff_hz=cutoff_hz, order=values[f"{which}_order"])
    return RaisedCosineFilter(cutoff_hz=cutoff_hz, rolloff=values[f"{which}_rolloff"])

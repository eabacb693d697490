"""Sentences on result lines for the terminal."""

from collections.abc import Mapping
from typing import Any

from vsep.files.frame_mask import SET_ASIDE


def same_slope_words(line: Mapping[str, Any], choice: str) -> str:
    """Say which ramps look like those of an interferer of the same slope, and what to do."""
    ramps = line["parallel_ramps"]
    sentence = (
        f"{line['file']}: {len(ramps)} of its ramps, the first is ramp {ramps[0]}, hold a tone "
        "that the others lack, as an interferer of the same slope makes; "
    )
    if choice == SET_ASIDE:
        return f"{sentence}they are set aside, the others tell of the objects."
    return (
        f"{sentence}it cannot be told from objects, and ghosts are likely. --same-slope "
        f"{SET_ASIDE} takes these ramps as missing."
    )


def choice_words(line: Mapping[str, Any]) -> str:
    """Say what the evidence has chosen."""
    return f"{line['file']}: {line['choice']['kept']} is kept, by the evidence of the objects."


def which_antenna_words(line: Mapping[str, Any]) -> str:
    """Say that one of several antennas was separated."""
    return (
        f"{line['file']} holds {line['num_antennas']} antennas, of which this estimator takes one: "
        "antenna 0 is separated, --antenna chooses another."
    )

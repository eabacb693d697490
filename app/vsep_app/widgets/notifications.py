"""Notifications about a frame that was loaded."""

import panel as pn

from vsep.files.frame import Frame


def antenna_notice(frame: Frame) -> str | None:
    """Say which antenna is shown, where a frame holds several; None where it holds one."""
    if frame.num_antennas == 1:
        return None
    return (
        f"{frame.name} holds {frame.num_antennas} antennas; antenna {frame.antenna} alone is shown "
        "and separated here. The live view takes all of them together, with angles."
    )


def tell_of_antennas(frame: Frame) -> None:
    """Show the notice in the browser, if there is one."""
    sentence = antenna_notice(frame)
    if sentence is not None and pn.state.notifications is not None:
        pn.state.notifications.info(sentence, duration=12000)

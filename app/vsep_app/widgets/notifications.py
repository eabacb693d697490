"""Notifications in the browser."""

import panel as pn

from vsep.files.frame import Frame


def notify(sentence: str, *, kind: str = "error", duration_ms: int = 8000) -> None:
    """Show a sentence in the browser, where there is one; it is of an ``error`` or an ``info``."""
    if pn.state.notifications is not None:
        getattr(pn.state.notifications, kind)(sentence, duration=duration_ms)


def antenna_notice(frame: Frame) -> str | None:
    """Say which antenna is shown, where a frame holds several; None where it holds one."""
    if frame.num_antennas == 1:
        return None
    return (
        f"{frame.name} holds {frame.num_antennas} antennas; antenna {frame.antenna} alone is shown "
        "and separated here. The live view takes all of them together, with angles."
    )

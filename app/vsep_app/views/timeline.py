"""Timeline of a run as HTML: what was found and given up in which iteration."""

from collections.abc import Sequence
from html import escape

from vsep_app.model.text import LogLine

KINDS = ("burst", "added", "pruned")
_LEAST_SPAN = 20
"""Iterations that have room at least, so that a short run does not jump."""


def timeline_html(lines: Sequence[LogLine], *, shown: int, num_iterations: int) -> str:
    """Return beads over the iterations; each names its iteration for a click to go there.

    Parameters
    ----------
    lines : sequence of LogLine
        The log of all iterations so far.
    shown, num_iterations : int
        Iteration that is shown, of how many.
    """
    span = max(num_iterations, _LEAST_SPAN)
    told: dict[tuple[int, str], list[str]] = {}
    for line in lines:
        if line.kind in KINDS:
            told.setdefault((line.iteration, line.kind), []).append(line.text)
    beads = "".join(
        f'<i class="bead {kind}" data-press="iteration {iteration}" '
        f'style="left:{100.0 * iteration / span:.2f}%" '
        f'title="{escape(_told(iteration, texts), quote=True)}"></i>'
        for (iteration, kind), texts in told.items()
    )
    here = f'<span class="here" style="left:{100.0 * shown / span:.2f}%"></span>'
    # The events beside the views say the same, and the slider goes there by the keyboard.
    label = f"Timeline: iteration {shown} of {num_iterations}"
    return f'<div class="timeline" role="img" aria-label="{label}">{here}{beads}</div>'


def _told(iteration: int, texts: Sequence[str]) -> str:
    return f"Iteration {iteration}: {'; '.join(texts)}"

"""Component table and event log as plain HTML, for the page and the report alike."""

import math
from collections.abc import Mapping, Sequence
from html import escape

from vsep_app.model.text import LogLine, TableRow

MISSING = "\u2013"


def log_html(lines: Sequence[LogLine]) -> str:
    """Return the event log as a list, newest line first."""
    if not lines:
        return '<p class="empty">Nothing has happened yet.</p>'
    items = "".join(
        f'<li class="{escape(line.kind)}"><span class="iteration">iteration '
        f"{line.iteration}:</span> {escape(line.text)}</li>"
        for line in reversed(lines)
    )
    # What scrolls can be reached by the keyboard.
    return f'<ol class="log" tabindex="0" aria-label="Events" reversed>{items}</ol>'


def table_html(rows: Sequence[TableRow], *, moving: bool) -> str:
    """Return the component table; velocities need several ramps, angles several antennas."""
    turned = has_angles(rows)
    head = "<th>id</th><th>range [m] ± [mm]</th><th>truth</th>"
    if moving:
        head += "<th>velocity [m/s]</th><th>truth</th>"
    if turned:
        head += "<th>angle [°]</th><th>truth</th>"
    head += "<th>SNR [dB]</th><th>truth</th>"
    body = "".join(_row(row, moving=moving, turned=turned) for row in rows)
    if not rows:
        columns = 7 if moving else 5
        body = f'<tr><td class="empty" colspan="{columns}">No object yet.</td></tr>'
    return (
        f'<table class="components" tabindex="0" aria-label="Objects">'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def has_angles(rows: Sequence[TableRow]) -> bool:
    """Whether some of the directions are known."""
    return any(row.angle_deg is not None or row.true_angle_deg is not None for row in rows)


def times_html(step_ms: Mapping[str, float]) -> str:
    """Return where the time of an iteration goes, as one line."""
    if not step_ms:
        return '<p class="empty">No iteration yet.</p>'
    parts = ", ".join(f"{escape(name)} {value:.1f}" for name, value in step_ms.items())
    return f'<p class="times"><b>{sum(step_ms.values()):.1f} ms</b>: {parts}</p>'


def _row(row: TableRow, *, moving: bool, turned: bool) -> str:
    if row.component_id is None:
        kind = "missed"
    else:
        kind = "extra" if row.true_range_m is None else "found"
    cells = [
        MISSING if row.component_id is None else str(row.component_id),
        _number(row.range_m, row.range_std_m, scale=1e3),
        _number(row.true_range_m),
    ]
    if moving:
        cells += [
            _number(row.velocity_mps, row.velocity_std_mps, digits=2),
            _number(row.true_velocity_mps, digits=2),
        ]
    if turned:
        cells += [
            _number(row.angle_deg, row.angle_std_deg, digits=2),
            _number(row.true_angle_deg, digits=2),
        ]
    cells += [_number(row.snr_db, digits=1), _number(row.true_snr_db, digits=1)]
    return f'<tr class="{kind}">' + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def value_text(value: float | None, digits: int) -> str:
    """Return a number, or a dash where there is none."""
    if value is None or math.isnan(value):
        return MISSING
    return f"{round(value, digits) + 0.0:.{digits}f}"


def deviation_text(std: float | None, digits: int, scale: float = 1.0) -> str:
    """Return a standard deviation in units of 1/`scale`, or nothing where there is none."""
    if std is None or not math.isfinite(std):
        return ""
    return f"{std:.{digits}f}" if scale == 1.0 else f"{std * scale:.1f}"


def _number(
    value: float | None, std: float | None = None, *, digits: int = 3, scale: float = 1.0
) -> str:
    deviation = deviation_text(std, digits, scale)
    spread = f'<span class="std"> ± {deviation}</span>' if deviation else ""
    return value_text(value, digits) + spread

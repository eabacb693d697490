"""Component table and event log as plain HTML, for the page and the report alike."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

from vsep_app.model.markers import GroupMarks, TargetMarks
from vsep_app.model.picture import Picture
from vsep_app.model.text import LogLine, TableRow, quiet_text

MISSING = "\u2013"


def log_html(lines: Sequence[LogLine]) -> str:
    """Return the event log as a list, newest line first; what is frequent is counted below it."""
    if not lines:
        return '<p class="empty">Nothing has happened yet.</p>'
    counts = quiet_text(lines)
    foot = f'<p class="counted">Not listed: {escape(counts)}.</p>' if counts else ""
    items = "".join(
        f'<li class="{escape(line.kind)}"><span class="iteration">iteration '
        f"{line.iteration}:</span> {escape(line.text)}</li>"
        for line in reversed(lines)
        if line.kind != "quiet"
    )
    # What scrolls can be reached by the keyboard.
    return f'<ol class="log" tabindex="0" aria-label="Events" reversed>{items}</ol>{foot}'


class Quantity(NamedTuple):
    """Two columns of the component table: estimate and truth."""

    heading: str
    name: str  #: Of the field of `TableRow`, without its unit.
    unit: str
    digits: int
    scale: float = 1.0  #: The standard deviation is in units of 1/scale.

    def own(self, row: TableRow) -> tuple[str, str]:
        """Return the estimate and its standard deviation, which is empty where there is none."""
        std: float | None = getattr(row, f"{self.name}_std_{self.unit}", None)
        if std is None or not math.isfinite(std):
            spread = ""
        else:
            spread = f"{std:.{self.digits}f}" if self.scale == 1.0 else f"{std * self.scale:.1f}"
        return value_text(getattr(row, f"{self.name}_{self.unit}"), self.digits), spread

    def true(self, row: TableRow) -> str:
        """Return the truth."""
        return value_text(getattr(row, f"true_{self.name}_{self.unit}"), self.digits)


def quantities(rows: Sequence[TableRow], *, moving: bool) -> list[Quantity]:
    """Return what a table shows; velocities need several ramps, angles several antennas."""
    turned = any(row.angle_deg is not None or row.true_angle_deg is not None for row in rows)
    fast = any(row.acceleration_mps2 is not None for row in rows)
    return [
        Quantity("range [m] ± [mm]", "range", "m", 3, 1e3),
        *([Quantity("velocity [m/s]", "velocity", "mps", 2)] if moving else []),
        *([Quantity("acceleration [m/s²]", "acceleration", "mps2", 1)] if fast else []),
        *([Quantity("angle [°]", "angle", "deg", 2)] if turned else []),
        Quantity("SNR [dB]", "snr", "db", 1),
    ]


def table_html(rows: Sequence[TableRow], *, moving: bool) -> str:
    """Return the component table; without columns of a truth where none is known."""
    shown = quantities(rows, moving=moving)
    known = any(row.true_range_m is not None for row in rows)
    truth = "<th>truth</th>" if known else ""
    head = "<th>id</th>" + "".join(f"<th>{each.heading}</th>{truth}" for each in shown)
    body = "".join(_row(row, shown, known=known) for row in rows)
    if not rows:
        body = f'<tr><td class="empty" colspan="{1 + len(shown)}">No object yet.</td></tr>'
    return (
        f'<table class="components" tabindex="0" aria-label="Objects">'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def groups_html(groups: GroupMarks) -> str:
    """Return the table of extended objects; nothing where there are none."""
    columns = {
        "range [m]": groups.ranges_m,
        "extent [m]": groups.extents_m,
        "velocity [m/s]": groups.velocities_mps,
        "strongest [dB]": groups.snr_db,
    }
    return _joined_html("Extended objects", "groups", columns, {"lines": groups.lines})


def targets_html(targets: TargetMarks | None) -> str:
    """Return the table of objects of several transmitters; nothing where there are none."""
    if targets is None:
        return ""
    columns = {
        "range [m]": targets.ranges_m,
        "velocity [m/s]": targets.velocities_mps,
        "strongest [dB]": targets.snr_db,
    }
    lines = {"lines by transmitter": targets.lines}
    return _joined_html("Objects of all transmitters", "targets", columns, lines)


def _joined_html(
    title: str,
    look: str,
    columns: Mapping[str, Any],
    lines: Mapping[str, Sequence[str]],
) -> str:
    """Return a table of what lines are joined to: numbers, then the lines; nothing of no row."""
    ((name, texts),) = lines.items()
    if not texts:
        return ""
    head = "".join(f"<th>{each}</th>" for each in (*columns, name))
    body = "".join(
        row_html([*(value_text(float(value), 2) for value in values), escape(text)])
        for *values, text in zip(*columns.values(), texts, strict=True)
    )
    return (
        f'<h3>{title}</h3><table class="components {look}" tabindex="0" '
        f'aria-label="{title}"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'
    )


def layers_html(picture: Picture) -> str:
    """Return the tables below that of the objects: extended ones, those of all transmitters."""
    return groups_html(picture.groups) + targets_html(picture.targets)


def _row(row: TableRow, shown: Sequence[Quantity], *, known: bool) -> str:
    if not known:
        kind = "unjudged"
    elif row.component_id is None:
        kind = "missed"
    else:
        kind = "extra" if row.true_range_m is None else "found"
    cells = [MISSING if row.component_id is None else str(row.component_id)]
    for each in shown:
        value, std = each.own(row)
        spread = f'<span class="std"> ± {std}</span>' if std else ""
        cells += [value + spread, *([each.true(row)] if known else [])]
    return row_html(cells, f' class="{kind}"')


def row_html(cells: Sequence[str], attributes: str = "") -> str:
    """Return a row of a table."""
    return f"<tr{attributes}>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def value_text(value: float | None, digits: int) -> str:
    """Return a number, or a dash where there is none."""
    if value is None or math.isnan(value):
        return MISSING
    return f"{round(value, digits) + 0.0:.{digits}f}"

"""Tables of a run on the page, and as files: CSV for a spreadsheet, JSON for a program."""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields
from functools import partial
from typing import Any

import panel_material_ui as pmu

from vsep.files.results import as_json
from vsep_app.model.picture import Picture
from vsep_app.model.text import LogLine, TableRow
from vsep_app.views.tables import layers_html, log_html, table_html
from vsep_app.widgets.download import Download
from vsep_app.widgets.layout import html_pane, panel

_MEDIA_TYPES = {"csv": "text/csv", "json": "application/json"}


class RunTables:
    """Component table and event log of the picture that is shown, each with its downloads."""

    def __init__(self) -> None:
        self.table, self.log = html_pane("tables"), html_pane("tables")
        self.picture: Picture | None = None

    def show(self, picture: Picture) -> None:
        """Show table and log of a picture."""
        self.picture = picture
        several = picture.static_picture.radar.num_ramps > 1
        objects = table_html(picture.table, moving=several)
        self.table.object = objects + layers_html(picture)
        self.log.object = log_html(picture.log)

    def panels(self, title: str, *, log_weight: float) -> list[Any]:
        """Return the table under a title, and the log."""
        download = Download()
        tables = download_buttons("objects", TableRow, lambda: self.shown("table"), download)
        logs = download_buttons("events", LogLine, lambda: self.shown("log"), download)
        return [
            panel(title, self.table, weight=10, tools=tables),
            panel("Events", self.log, weight=log_weight, tools=logs),
        ]

    def shown(self, name: str) -> Sequence[Any]:
        """Return the rows of ``table`` or ``log`` that are shown."""
        return () if self.picture is None else getattr(self.picture, name)


def table_csv(columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> str:
    r"""Return rows as CSV with a line of headings; what is not known is left empty.

    Examples
    --------
    >>> table_csv(["range_m", "snr_db"], [{"range_m": 12.5, "snr_db": None}])
    'range_m,snr_db\n12.5,\n'
    """
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


def download_buttons(
    name: str, kind: type, rows: Callable[[], Sequence[Any]], download: Download
) -> list[Any]:
    """Return a button for CSV and one for JSON.

    Parameters
    ----------
    name : str
        What the table holds; the files are called so.
    kind : type
        Dataclass of its rows; the fields are the columns.
    rows : callable
        Returns the rows as they are shown.
    download : Download
        Brings the files to the browser.
    """
    columns = [field.name for field in fields(kind)]
    formats: dict[str, Callable[[list[dict[str, Any]]], str]] = {
        "csv": partial(table_csv, columns),
        "json": lambda records: as_json({name: records}) + "\n",
    }

    def button(suffix: str, write: Callable[[list[dict[str, Any]]], str]) -> Any:
        made = pmu.Button(
            label=suffix.upper(),
            icon="download",
            description=f"{suffix.upper()}: download the {name} shown, units in the names.",
            variant="text",
            size="small",
            margin=(0, 1),
        )

        def send(_: Any) -> None:
            content = write([asdict(row) for row in rows()]).encode()
            download.send(f"vsep-{name}.{suffix}", _MEDIA_TYPES[suffix], content)

        made.on_click(send)
        download.join(made)
        return made

    return [button(suffix, write) for suffix, write in formats.items()]

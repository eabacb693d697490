"""A report as a file: what it is follows from its name."""

import io
from collections.abc import Callable
from pathlib import Path

from matplotlib.backends.backend_pdf import PdfPages

from app.report.carrier import PNG_KEY, for_pdf
from app.report.film import draw_film
from app.report.page import report_html
from app.report.record import record_html
from app.report.run import ReportRun, account, listed_settings
from app.report.sheet import draw_sheet
from vsep._arrays import InputError
from vsep.files.results import as_json


def require_report_name(out: str) -> None:
    """Refuse a name that no report has."""
    if Path(out).suffix.lower() not in _MAKERS:
        raise InputError(f"The report {Path(out).name!r} must end in .html, .png, .pdf or .json.")


def write_report(run: ReportRun, out: Path) -> None:
    """Write what the dashboard would show of a run.

    Parameters
    ----------
    run : ReportRun
        What to show.
    out : Path
        File to write; its suffix says what it is, see `report_bytes`.

    Raises
    ------
    InputError
        If the suffix is another one.
    OSError
        If the file cannot be written.
    """
    require_report_name(str(out))
    out.write_bytes(report_bytes(run, out.suffix.lower()))


def report_bytes(run: ReportRun, suffix: str) -> bytes:
    """Return a report as the content of a file.

    Parameters
    ----------
    run : ReportRun
        What to show.
    suffix : str
        ``.html``, the views; ``.png``, one sheet, which is the film strip where one is asked for;
        ``.pdf``, the sheet and the film strip; ``.json``, the numbers alone.
    """
    return _MAKERS[suffix](run)


def write_record(run: ReportRun, out: Path) -> None:
    """Write the recorded run.

    Raises
    ------
    InputError
        If the name does not end in ``.html``.
    OSError
        If the file cannot be written.
    """
    require_record_name(str(out))
    out.write_text(record_html(run), encoding="utf-8")


def require_record_name(out: str) -> None:
    """Refuse a name that no recorded run has."""
    if Path(out).suffix.lower() != ".html":
        raise InputError(f"The recorded run {Path(out).name!r} must end in .html.")


def _html(run: ReportRun) -> bytes:
    return report_html(run).encode()


def _json(run: ReportRun) -> bytes:
    return (as_json(account(run)) + "\n").encode()


def _png(run: ReportRun) -> bytes:
    settings, film, file = listed_settings(run), run.film(), io.BytesIO()
    sheet = draw_film(film, settings) if film else draw_sheet(run.picture(), settings)
    sheet.savefig(file, format="png", metadata={PNG_KEY: as_json(account(run))})
    return file.getvalue()


def _pdf(run: ReportRun) -> bytes:
    settings, film, file = listed_settings(run), run.film(), io.BytesIO()
    # Without the date: the same run gives the same file.
    told = {"Title": f"vsep: {run.frame.name}", "Keywords": for_pdf(account(run))}
    with PdfPages(file, metadata={**told, "CreationDate": None}) as pages:
        pages.savefig(draw_sheet(run.picture(), settings))
        if film:
            pages.savefig(draw_film(film, settings))
    return file.getvalue()


_MAKERS: dict[str, Callable[[ReportRun], bytes]] = {
    ".html": _html,
    ".png": _png,
    ".pdf": _pdf,
    ".json": _json,
}

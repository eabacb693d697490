"""A report as a file: what it is follows from its name."""

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

SUFFIXES = (".html", ".png", ".pdf", ".json")


def require_report_name(out: str) -> None:
    """Refuse a name that no report has."""
    if Path(out).suffix.lower() not in SUFFIXES:
        raise InputError(f"The report {Path(out).name!r} must end in .html, .png, .pdf or .json.")


def write_report(run: ReportRun, out: Path) -> None:
    """Write what the dashboard would show of a run.

    Parameters
    ----------
    run : ReportRun
        What to show.
    out : Path
        File to write: ``.html``, the views; ``.png``, one sheet, which is the film strip where one
        is asked for; ``.pdf``, the sheet and the film strip; ``.json``, the numbers alone.

    Raises
    ------
    InputError
        If the suffix is another one.
    OSError
        If the file cannot be written.
    """
    require_report_name(str(out))
    {".html": _write_html, ".png": _write_png, ".pdf": _write_pdf, ".json": _write_json}[
        out.suffix.lower()
    ](run, out)


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


def _write_html(run: ReportRun, out: Path) -> None:
    out.write_text(report_html(run), encoding="utf-8")


def _write_json(run: ReportRun, out: Path) -> None:
    out.write_text(as_json(account(run)) + "\n", encoding="utf-8")


def _write_png(run: ReportRun, out: Path) -> None:
    settings = listed_settings(run)
    film = run.film()
    sheet = draw_film(film, settings) if film else draw_sheet(run.picture(), settings)
    sheet.savefig(out, format="png", metadata={PNG_KEY: as_json(account(run))})


def _write_pdf(run: ReportRun, out: Path) -> None:
    settings = listed_settings(run)
    film = run.film()
    # Without the date: the same run gives the same file.
    told = {"Title": f"vsep: {run.frame.name}", "Keywords": for_pdf(account(run))}
    with PdfPages(out, metadata={**told, "CreationDate": None}) as pages:
        pages.savefig(draw_sheet(run.picture(), settings))
        if film:
            pages.savefig(draw_film(film, settings))

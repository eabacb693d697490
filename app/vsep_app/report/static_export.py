"""The report for print as the content of a file."""

import io

from matplotlib.backends.backend_pdf import PdfPages

from vsep.files.results import as_json
from vsep_app.figures.figure_page import draw_sheet
from vsep_app.figures.filmstrip import draw_film
from vsep_app.report.metadata import PNG_KEY, for_pdf
from vsep_app.report.run import ReportRun, account, listed_settings


def png(run: ReportRun) -> bytes:
    """Return one sheet, which is the film strip where one is asked for."""
    settings, film, file = listed_settings(run), run.film(), io.BytesIO()
    sheet = draw_film(film, settings) if film else draw_sheet(run.picture(), settings)
    sheet.savefig(file, format="png", metadata={PNG_KEY: as_json(account(run))})
    return file.getvalue()


def pdf(run: ReportRun) -> bytes:
    """Return the sheet and, on a page of its own, the film strip where one is asked for."""
    settings, film, file = listed_settings(run), run.film(), io.BytesIO()
    # Without the date: the same run gives the same file.
    told = {"Title": f"vsep: {run.frame.name}", "Keywords": for_pdf(account(run))}
    with PdfPages(file, metadata={**told, "CreationDate": None}) as pages:
        pages.savefig(draw_sheet(run.picture(), settings))
        if film:
            pages.savefig(draw_film(film, settings))
    return file.getvalue()

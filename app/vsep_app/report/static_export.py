"""Static export of a report: PNG and PDF."""

import io

from matplotlib.backends.backend_pdf import PdfPages

from vsep.files.results import as_json
from vsep_app.figures.figure_page import draw_figure_page, draw_filmstrip
from vsep_app.report.metadata import PNG_KEY, for_pdf
from vsep_app.report.run import ReportRun, listed_settings, provenance


def png(run: ReportRun) -> bytes:
    """Return one page, which is the filmstrip where one is asked for."""
    settings, filmstrip, file = listed_settings(run), run.filmstrip(), io.BytesIO()
    page = (
        draw_filmstrip(filmstrip, settings)
        if filmstrip
        else draw_figure_page(run.picture(), settings)
    )
    page.savefig(file, format="png", metadata={PNG_KEY: as_json(provenance(run))})
    return file.getvalue()


def pdf(run: ReportRun) -> bytes:
    """Return the page and, on a page of its own, the filmstrip where one is asked for."""
    settings, filmstrip, file = listed_settings(run), run.filmstrip(), io.BytesIO()
    # Without the date: the same run gives the same file.
    told = {"Title": f"vsep: {run.frame.name}", "Keywords": for_pdf(provenance(run))}
    with PdfPages(file, metadata={**told, "CreationDate": None}) as pages:
        pages.savefig(draw_figure_page(run.picture(), settings))
        if filmstrip:
            pages.savefig(draw_filmstrip(filmstrip, settings))
    return file.getvalue()

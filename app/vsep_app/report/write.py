"""Report files: the suffix of the name determines the format."""

from collections.abc import Callable, Sequence
from pathlib import Path

from vsep.files.results import as_json
from vsep.files.writing import write_bytes, write_text
from vsep_app.report.metadata import for_html
from vsep_app.report.names import require_record_name, require_report_name
from vsep_app.report.packed import packed_html
from vsep_app.report.page import report_html
from vsep_app.report.replay import record_html
from vsep_app.report.run import ReportRun, execute, provenance
from vsep_app.report.variations import read_varied, varied_specs


def write_report(run: ReportRun, out: Path) -> None:
    """Write what the dashboard would show of a run, in the format of `report_bytes`.

    Raises `InputError` if the suffix is another one, `OSError` if the file cannot be written.
    """
    require_report_name(str(out))
    write_bytes(out, report_bytes(run, out.suffix.lower()))


def report_bytes(run: ReportRun, suffix: str) -> bytes:
    """Return a report as the content of a file.

    Parameters
    ----------
    run : ReportRun
        What to show.
    suffix : str
        ``.html``, the views; ``.png``, one page, which is the filmstrip where one is asked for;
        ``.pdf``, the page and the filmstrip; ``.json``, the numbers alone.
    """
    return _MAKERS[suffix](run)


def write_record(run: ReportRun, out: Path, *, vary: Sequence[str] = ()) -> None:
    """Write the recorded run; of settings that are varied a run for every combination.

    Raises `InputError` if the name does not end in ``.html`` or something cannot be varied. Raises
    `OSError` if the file cannot be written.
    """
    require_record_name(str(out))
    varied = read_varied(vary, run.spec.plan)
    runs = [execute(spec) for spec in varied_specs(run.spec, varied)] if varied else [run]
    title = f"vsep: {run.static_picture.title}, recorded"
    told = for_html(provenance(run))
    write_text(out, packed_html(record_html(runs, varied), title=title, provenance=told))


def _html(run: ReportRun) -> bytes:
    return report_html(run).encode()


def _json(run: ReportRun) -> bytes:
    return (as_json(provenance(run)) + "\n").encode()


def _png(run: ReportRun) -> bytes:
    from vsep_app.report.static_export import png

    return png(run)


def _pdf(run: ReportRun) -> bytes:
    from vsep_app.report.static_export import pdf

    return pdf(run)


_MAKERS: dict[str, Callable[[ReportRun], bytes]] = {
    ".html": _html,
    ".png": _png,
    ".pdf": _pdf,
    ".json": _json,
}

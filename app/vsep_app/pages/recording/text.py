"""Facts about a recording in words."""

from html import escape

from vsep_app.model.text import resolution_cells
from vsep_app.pages.recording.tasks import RecordingOpening


def facts_html(opening: RecordingOpening | None, fault: str = "") -> str:
    """Return the frame that is shown in a few words, and what looks wrong with its settings.

    Parameters
    ----------
    opening : RecordingOpening or None
        What is shown.
    fault : str
        Why the settings as they are now cannot be shown.
    """
    wrong = f'<p class="wrong">{escape(fault)}</p>' if fault else ""
    return wrong if opening is None else wrong + _shown_html(opening)


def _antennas(opening: RecordingOpening) -> str:
    number, shown = opening.num_antennas, opening.prepared.static_picture.antenna
    if shown.together > 1:
        return f"{number} antennas, separated together"
    return f"antenna {opening.antenna} of {number}, separated alone"


def _shown_html(opening: RecordingOpening) -> str:
    radar = opening.prepared.static_picture.radar
    cell_m, cell_mps = resolution_cells(radar)
    antennas = "" if opening.num_antennas == 1 else f", {_antennas(opening)}"
    facts = [
        f"{radar.num_ramps} ramps of {radar.num_samples} samples{antennas}",
        f"{radar.start_frequency_hz / 1e9:.4g} GHz, {radar.slope_hz_per_s / 1e12:.4g} MHz/µs",
        f"cells of {cell_m:.3g} m and {abs(cell_mps):.3g} m/s",
        f"largest sample in ramp {opening.loudest_ramp}",
    ]
    remarks = opening.remarks or ("Settings and samples do not contradict each other.",)
    kind = "wrong" if opening.remarks else "right"
    return (
        f"<p><strong>{escape(opening.plan.file.name)}</strong>: {escape('; '.join(facts))}.</p>"
        + "".join(f'<p class="{kind}">{escape(remark)}</p>' for remark in remarks)
    )

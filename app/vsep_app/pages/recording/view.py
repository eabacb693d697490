"""Views of a recording: one ramp, all maps, and the facts known of it."""

from collections.abc import Callable
from html import escape
from typing import Any

from vsep_app.model.picture import Picture
from vsep_app.model.static_picture import ByteArray, StaticPicture
from vsep_app.model.text import resolution_cells
from vsep_app.pages.recording.tasks import PreparedRecording
from vsep_app.views.ramps import RampStrip
from vsep_app.views.range_doppler import RangeDopplerView, empty_image, image_box
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import Axis, crosshair
from vsep_app.widgets.exports import RunTables
from vsep_app.widgets.layout import card, html_pane, panel, stack


class RecordingView:
    """Views and panels; `select` is called with the ramp that was clicked."""

    def __init__(self, select: Callable[[int], None]) -> None:
        range_axis, line = Axis(), crosshair()
        self.ramps = RampStrip(select)
        self.fast_time = FastTimeView()
        self.delay = DelayView(range_axis, line)
        self.maps = RangeDopplerView(range_axis, line)
        self._image = empty_image()
        self.reference = self.maps.companion(
            self._image, name="reference", title="Range-Doppler, clean reference"
        )
        self._drawn: ByteArray | None = None
        self.facts, self.tables = html_pane("facts"), RunTables()

    def layout(self) -> list[Any]:
        """Return all below the toolbar."""
        self._strip = card(self.ramps.figure, weight=0, height=62, look="strip")
        signals = (
            card(self.fast_time.figure, weight=6, look="strip", key=FastTimeView.untrue_key),
            card(self.delay.figure, weight=5, look="strip", key=DelayView.untrue_key),
        )
        for each in signals:
            each[-1].css_classes = ["narrow"]
        plots = self.maps.before, self.maps.after, self.reference
        maps = [card(plot, weight=1, look="strip") for plot in plots]
        self._reference = maps[-1]
        self._reference.visible = False
        self._map_row = stack(*maps, weight=14, row=True, sheet="maps")
        signal_row = stack(*signals, weight=11, row=True, sheet="maps")
        views = stack(self._strip, signal_row, self._map_row, weight=28)
        tables = self.tables.panels("Objects: estimate ± standard deviation", log_weight=9)
        facts = panel("Recording", self.facts, weight=9)
        panels = stack(facts, *tables, weight=8, row=True, sheet="body")
        return [views, panels]

    def show(self, picture: Picture, prepared_run: PreparedRecording) -> None:
        """Draw a picture of a recording; called with the document locked."""
        several = picture.static_picture.radar.num_ramps > 1
        self._map_row.visible = self._strip.visible = several
        reference = prepared_run.reference_maps.get(picture.static_picture.antenna.number)
        self._reference.visible = several and reference is not None
        if several:
            self.ramps.update(picture)
            self.maps.update(picture)
            self._show_reference(picture.static_picture, reference)
        self.delay.update(picture)
        self.tables.show(picture)
        self.fast_time.update(picture)

    def show_facts(self, prepared_run: PreparedRecording | None, fault: str) -> None:
        """Say what is shown, and why what is set now cannot be."""
        self.facts.object = facts_html(prepared_run, fault)

    def _show_reference(self, static_picture: StaticPicture, reference: ByteArray | None) -> None:
        """Draw the map of the clean recording; it is sent once."""
        if reference is not None and reference is not self._drawn:
            box = image_box(static_picture.map_ranges_m, static_picture.map_velocities_mps)
            self._image.data = {"image": [reference], **box}
        self._drawn = reference


def facts_html(prepared_run: PreparedRecording | None, fault: str = "") -> str:
    """Return the frame that is shown in a few words, and what looks wrong with its settings.

    `fault` says why the settings as they are now cannot be shown.
    """
    wrong = f'<p class="wrong">{escape(fault)}</p>' if fault else ""
    return wrong if prepared_run is None else wrong + _shown_html(prepared_run)


def _antennas(prepared_run: PreparedRecording) -> str:
    number, shown = prepared_run.num_antennas, prepared_run.prepared.static_picture.antenna
    if shown.together > 1:
        return f"{number} antennas, separated together"
    return f"antenna {prepared_run.antenna} of {number}, separated alone"


def _shown_html(prepared_run: PreparedRecording) -> str:
    radar = prepared_run.prepared.static_picture.radar
    cell_m, cell_mps = resolution_cells(radar)
    antennas = "" if prepared_run.num_antennas == 1 else f", {_antennas(prepared_run)}"
    facts = [
        f"{radar.num_ramps} ramps of {radar.num_samples} samples{antennas}",
        f"{radar.start_frequency_hz / 1e9:.4g} GHz, {radar.slope_hz_per_s / 1e12:.4g} MHz/µs",
        f"cells of {cell_m:.3g} m and {abs(cell_mps):.3g} m/s",
        f"largest sample in ramp {prepared_run.loudest_ramp}",
    ]
    remarks = prepared_run.remarks or ("Settings and samples are consistent.",)
    kind = "wrong" if prepared_run.remarks else "right"
    return (
        f"<p><strong>{escape(prepared_run.plan.file.name)}</strong>: "
        f"{escape('; '.join(facts))}.</p>"
        + "".join(f'<p class="{kind}">{escape(remark)}</p>' for remark in remarks)
    )

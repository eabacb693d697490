"""Cards of frame and methods: range-Doppler maps, or delay spectra of a single ramp."""

from typing import Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, CrosshairTool, LinearColorMapper

from vsep._typing import FloatArray
from vsep_app.model.markers import Markers
from vsep_app.model.static_picture import ByteArray, StaticPicture
from vsep_app.model.text import counted, resolution_cells
from vsep_app.pages.compare.picture import ComparePicture, MethodView
from vsep_app.pages.compare.results import SLOT_COLOURS
from vsep_app.views.range_doppler import (
    add_colour_bar,
    empty_image,
    empty_marks,
    empty_misses,
    image_box,
    map_figure,
    mark_columns,
    mark_objects,
    miss_columns,
)
from vsep_app.views.signals import mark_peaks
from vsep_app.views.style import COLOURS, MAP_PALETTE, Axis, crosshair, lighten, plain_figure, put
from vsep_app.widgets.layout import stack


class CompareMaps:
    """One card for the frame as received, one for the truth and one for each method.

    All are on the same axes.
    """

    def __init__(self) -> None:
        self._range, self._velocity, self._level = Axis(), Axis(), Axis()
        self._scale = LinearColorMapper(palette=MAP_PALETTE, low=0.0, high=1.0)
        self._true_marks, self._true_peaks = empty_marks(), _no_peaks()
        self._line = crosshair()
        self.received, self.truth = (
            FrameCard(self._plots(name), colour="transparent") for name in ("received", "truth")
        )
        self.methods = [
            FrameCard(self._plots(str(number)), colour=colour)
            for number, colour in enumerate(SLOT_COLOURS)
        ]
        add_colour_bar(self.received.plots.map, self._scale)  # one scale for all
        for card in (self.truth, *self.methods):
            self._mark(card)
        for card, name in ((self.received, "received"), (self.truth, "truth")):
            card.column.css_classes = [name]
        cards = (self.received, self.truth, *self.methods)
        self.grid = stack(*(card.column for card in cards), row=True, sheet="compare")
        self._static_picture: StaticPicture | None = None

    def _plots(self, name: str) -> "CardPlots":
        plots = CardPlots(
            name, axes=(self._range, self._velocity), scale=self._scale, level=self._level
        )
        for plot in (plots.map, plots.profile):
            plot.add_tools(CrosshairTool(overlay=self._line))
            lighten(plot)
        return plots

    def _mark(self, card: "FrameCard") -> None:
        """Let a card show true objects and estimates."""
        mark_objects(card.plots.map, card.marks, self._true_marks, card.misses)
        for source, label, role, marker in (
            (self._true_peaks, "true object", "true", "x"),
            (card.peaks, "estimate", "object", "circle"),
        ):
            profile = card.plots.profile
            mark_peaks(profile, source, label, colour=COLOURS[role], marker=marker)

    def show(self, picture: ComparePicture) -> None:
        """Draw a picture; what stays during a run is sent once."""
        static_picture = picture.static_picture
        if static_picture is not self._static_picture:
            self._static_picture = static_picture
            self._set_axes(static_picture, picture.true_objects)
            self._show_frame(static_picture)
        self._hold_estimates(picture)
        # The style sheet arranges two, three or four cards beside those of the frame.
        count = f"of-{len(picture.method_runs)}"
        if self.grid.css_classes != [count]:
            self.grid.css_classes = [count]
        for card, view in zip(self.methods, picture.method_runs, strict=False):
            card.show(static_picture, view, picture.true_objects)
        for number, card in enumerate(self.methods):
            card.column.visible = number < len(picture.method_runs)

    def _show_frame(self, static_picture: StaticPicture) -> None:
        received, truth = static_picture.observation.received, static_picture.observation.truth
        spectra_db = static_picture.spectra_db
        title, image = "as received", static_picture.map_before
        self.received.draw(static_picture, title, image, spectra_db(received[0]))
        self.truth.column.visible = truth is not None
        self.received.column.css_classes = ["received"] if truth else ["received", "alone"]
        if truth is not None:
            without = received - truth.interference_signal
            title, image = "truth: without interference", static_picture.map_of(without)
            self.truth.draw(static_picture, title, image, spectra_db(without[0]))

    def _hold_estimates(self, picture: ComparePicture) -> None:
        """Let the axes hold the estimates of all methods."""
        static_picture, number = picture.static_picture, picture.run_number
        box = image_box(static_picture.map_ranges_m, static_picture.map_velocities_mps)
        full = (box["y"][0], box["y"][0] + box["dh"][0])
        objects = [view.objects for view in picture.method_runs]
        ranges = np.concatenate([each.ranges_m for each in objects])
        self._range.hold(static_picture.shown_ranges_m, ranges, run_number=number)
        velocities = np.concatenate([each.velocities_mps for each in objects])
        limits = static_picture.shown_velocities_mps or full
        self._velocity.hold(limits, velocities, run_number=number)

    def _set_axes(self, static_picture: StaticPicture, true_objects: Markers) -> None:
        low, high = static_picture.map_limits_db
        self._scale.update(low=low, high=high)
        self._level.set(static_picture.spectrum_limits_db)
        cell = resolution_cells(static_picture.radar)
        put(self._true_marks, mark_columns(true_objects, cell=cell))
        put(self._true_peaks, _peak_columns(true_objects))


class CardPlots:
    """The two figures of a card, of which one is seen.

    Parameters
    ----------
    name : str
        Ends the names of the figures.
    axes : (Axis, Axis)
        Range and velocity.
    scale : LinearColorMapper
        Levels of the maps.
    level : Axis
        Level of the delay spectra.
    """

    def __init__(
        self, name: str, *, axes: tuple[Axis, Axis], scale: LinearColorMapper, level: Axis
    ) -> None:
        self.image = empty_image()
        self.line = ColumnDataSource({"range": [], "level": []})
        label = "radial velocity [m/s]"
        self.map = map_figure(
            self.image, title=" ", y_label=label, axes=axes, name=f"compare-{name}", scale=scale
        )
        labels, name = ("range [m]", "level [dB]"), f"compare-profile-{name}"
        self.profile = plain_figure(name, " ", labels, (axes[0], level))
        self.profile.line(
            "range", "level", source=self.line, line_color=COLOURS["cleaned"], line_width=1.4
        )


class FrameCard:
    """The card of a frame: as received, its truth, or what a method has made of it.

    Parameters
    ----------
    plots : CardPlots
        What it shows.
    colour : str
        Colour that table and curves have for it.
    """

    def __init__(self, plots: CardPlots, *, colour: str) -> None:
        self.plots = plots
        self.marks, self.peaks, self.misses = empty_marks(), _no_peaks(), empty_misses()
        # A pane of a figure takes its visibility from the figure; what is around it does not.
        self._map_pane, self._profile_pane = (
            stack(pn.pane.Bokeh(plot, sizing_mode="stretch_both", margin=0), sheet="")
            for plot in (plots.map, plots.profile)
        )
        self._profile_pane.visible = False
        panes = self._map_pane, self._profile_pane
        self.column = stack(*panes, sheet="strip", margin=3, flex="0 1 auto")
        self.column.styles = {**self.column.styles, "border-top": f"4px solid {colour}"}
        self._drawn: MethodView | None = None

    def show(self, static_picture: StaticPicture, view: MethodView, true_objects: Markers) -> None:
        """Draw a method's view; one that has ended is not sent again."""
        if view is self._drawn:
            return
        self._drawn = view
        self.draw(static_picture, f"{view.name}: {_what(view)}", view.map_cleaned, view.profile_db)
        if self._map_pane.visible:
            found = None if view.score is None else view.score.found
            put(self.marks, mark_columns(view.objects, found=found))
            put(self.misses, miss_columns(view.score, true_objects, view.objects))
        else:
            put(self.peaks, _peak_columns(view.objects))

    def draw(
        self, static_picture: StaticPicture, title: str, image: ByteArray, profile_db: FloatArray
    ) -> None:
        """Draw the map of a frame, or the delay spectrum of its only ramp."""
        plots, several = self.plots, static_picture.radar.num_ramps > 1
        self._map_pane.visible, self._profile_pane.visible = several, not several
        if several:
            plots.map.title.text = title
            box = image_box(static_picture.map_ranges_m, static_picture.map_velocities_mps)
            plots.image.data = {"image": [image], **box}
        else:
            plots.profile.title.text = title
            plots.line.data = {"range": static_picture.ranges_m, "level": profile_db}


def _what(view: MethodView) -> str:
    if view.metrics.num_detections is None:
        return f"{view.stage}, iteration {view.metrics.num_repairs}"
    found = len(view.objects.ranges_m)
    return counted(found, "object") if view.score is None else view.score.text


def _no_peaks() -> ColumnDataSource:
    return ColumnDataSource({"range": [], "level": [], "snr": []})


def _peak_columns(marks: Markers) -> dict[str, Any]:
    return {"range": marks.ranges_m, "level": marks.levels_db, "snr": marks.snr_db}

"""Cards of the methods: cleaned range-Doppler maps, or delay spectra of a single ramp."""

from typing import Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, CrosshairTool, LinearColorMapper, Span

from vsep_app.model.compare_settings import MAX_METHODS
from vsep_app.model.markers import Markers
from vsep_app.model.static_picture import StaticPicture
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
    """One card for each method, all on the same axes."""

    def __init__(self) -> None:
        self._range, self._velocity, self._level = Axis(), Axis(), Axis()
        self._scale = LinearColorMapper(palette=MAP_PALETTE, low=0.0, high=1.0)
        self._true_marks, self._true_peaks = empty_marks(), _no_peaks()
        line = crosshair()
        self._cards = [self._card(number, line) for number in range(MAX_METHODS)]
        self._static_picture: StaticPicture | None = None
        self.grid = stack(*(card.column for card in self._cards), row=True, sheet="compare")

    def _card(self, number: int, line: Span) -> "MethodCard":
        card = MethodCard(
            number, axes=(self._range, self._velocity), scale=self._scale, level=self._level
        )
        mark_objects(card.map, card.marks, self._true_marks, card.misses)
        for source, label, role, marker in (
            (self._true_peaks, "true object", "true", "x"),
            (card.peaks, "estimate", "object", "circle"),
        ):
            mark_peaks(card.profile, source, label, colour=COLOURS[role], marker=marker)
        for plot in (card.map, card.profile):
            plot.add_tools(CrosshairTool(overlay=line))
            lighten(plot)
        return card

    def show(self, picture: ComparePicture) -> None:
        """Draw a picture; what stays during a run is sent once."""
        static_picture = picture.static_picture
        if static_picture is not self._static_picture:
            self._static_picture = static_picture
            self._set_axes(static_picture, picture.true_objects)
        self._hold_estimates(picture)
        # The style sheet arranges two, three or four cards.
        count = f"of-{len(picture.method_runs)}"
        if self.grid.css_classes != [count]:
            self.grid.css_classes = [count]
        for card, view in zip(self._cards, picture.method_runs, strict=False):
            card.show(static_picture, view, picture.true_objects)
        for number, card in enumerate(self._cards):
            card.column.visible = number < len(picture.method_runs)

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


class MethodCard:
    """The card of one method.

    Parameters
    ----------
    number : int
        Its place, from 0.
    axes : (Axis, Axis)
        Range and velocity.
    scale : LinearColorMapper
        Levels of the maps.
    level : Axis
        Level of the delay spectra.
    """

    def __init__(
        self, number: int, *, axes: tuple[Axis, Axis], scale: LinearColorMapper, level: Axis
    ) -> None:
        self._image = empty_image()
        self._line = ColumnDataSource({"range": [], "level": []})
        self.marks, self.peaks, self.misses = empty_marks(), _no_peaks(), empty_misses()
        label = "radial velocity [m/s]"
        self.map = map_figure(
            self._image, title=" ", y_label=label, axes=axes, name=f"compare-{number}", scale=scale
        )
        add_colour_bar(self.map, scale)
        labels, name = ("range [m]", "level [dB]"), f"compare-profile-{number}"
        self.profile = plain_figure(name, " ", labels, (axes[0], level))
        self.profile.line(
            "range", "level", source=self._line, line_color=COLOURS["cleaned"], line_width=1.4
        )
        # A pane of a figure takes its visibility from the figure; what is around it does not.
        self._map_pane, self._profile_pane = (
            stack(pn.pane.Bokeh(plot, sizing_mode="stretch_both", margin=0), sheet="")
            for plot in (self.map, self.profile)
        )
        self._profile_pane.visible = False
        panes = self._map_pane, self._profile_pane
        self.column = stack(*panes, sheet="strip", margin=3, flex="0 1 auto")
        self._drawn: MethodView | None = None
        # The colour that the table and the curves have.
        top = {"border-top": f"4px solid {SLOT_COLOURS[number]}"}
        self.column.styles = {**self.column.styles, **top}

    def show(self, static_picture: StaticPicture, view: MethodView, true_objects: Markers) -> None:
        """Draw a method's view; one that has ended is not sent again."""
        if view is self._drawn:
            return
        self._drawn = view
        several = static_picture.radar.num_ramps > 1
        self._map_pane.visible, self._profile_pane.visible = several, not several
        title = f"{view.name}: {_what(view)}"
        if several:
            self.map.title.text = title
            box = image_box(static_picture.map_ranges_m, static_picture.map_velocities_mps)
            self._image.data = {"image": [view.map_cleaned], **box}
            found = None if view.score is None else view.score.found
            put(self.marks, mark_columns(view.objects, found=found))
            put(self.misses, miss_columns(view.score, true_objects, view.objects))
        else:
            self.profile.title.text = title
            self._line.data = {"range": static_picture.ranges_m, "level": view.profile_db}
            put(self.peaks, _peak_columns(view.objects))


def _what(view: MethodView) -> str:
    found = len(view.objects.ranges_m)
    if view.metrics.num_detections is None:
        return f"{view.stage}, iteration {view.metrics.num_repairs}"
    score = counted(found, "object") if view.score is None else view.score.text
    return f"{view.stage}, {score}"


def _no_peaks() -> ColumnDataSource:
    return ColumnDataSource({"range": [], "level": [], "snr": []})


def _peak_columns(marks: Markers) -> dict[str, Any]:
    return {"range": marks.ranges_m, "level": marks.levels_db, "snr": marks.snr_db}

"""Views of the live page: chirps, fast time, delay and maps, with the tables beside them."""

from collections.abc import Callable
from typing import Any

from vsep_app.model.crossing import Crossing
from vsep_app.model.picture import Picture
from vsep_app.server.lesson import Glance
from vsep_app.teaching.staging import Staging
from vsep_app.views.crossing import CrossingView
from vsep_app.views.opening import small_map
from vsep_app.views.pinned import PinnedMarks
from vsep_app.views.pointer import Drag
from vsep_app.views.progress import ProgressView
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import Axis, crosshair
from vsep_app.views.swiped_map import MapObjects, SwipedMap
from vsep_app.widgets.exports import RunTables
from vsep_app.widgets.fold import Fold
from vsep_app.widgets.layout import card, html_pane, progress_card, stack


class LiveViews:
    """All figures and tables of a run.

    `select` is called with a ramp that is clicked, `drag` with what is dragged in the chirps,
    `objects` with what is done to the true objects in the map;
    `cards` are HTML that stands in the place of the tables while these are empty.
    """

    def __init__(
        self,
        select: Callable[[int], None],
        drag: Callable[[Drag, Crossing], None],
        *,
        objects: MapObjects | None = None,
        cards: str = "",
    ) -> None:
        self._cards_html = cards
        range_axis, line = Axis(), crosshair()
        self.crossing = CrossingView(select, drag)
        self.fast_time = FastTimeView()
        self.delay = DelayView(range_axis, line)
        self.map = SwipedMap(range_axis, line, objects)
        self.pinned = PinnedMarks(
            fast_time=self.fast_time.figure,
            delay=self.delay.figure,
            range_doppler=self.map.after,
        )
        #: Made when somebody asks for the curves.
        self.progress: ProgressView | None = None
        self._side: Picture | None = None
        self.tables = RunTables()
        self._hidden: frozenset[str] = frozenset()
        self._parts: dict[str, Any] = {}

    def layout(self) -> Any:
        """Return figures at the left, tables at the right."""
        self._map_row = card(self.map.after, weight=13, look="view")
        signals = [
            card(view.figure, weight=weight, key=view.key, look="view")
            for view, weight in ((self.crossing, 9), (self.fast_time, 9), (self.delay, 9))
        ]
        self._keys = [each[-1] for each in signals[1:]]
        names = "chirps", "fast_time", "delay"
        self._parts |= {**dict(zip(names, signals, strict=True)), "maps": self._map_row}
        views = stack(*signals, self._map_row, weight=17, sheet="stage")
        # Filled when something stands in the tables for the first time.
        self._tables = stack(sheet="column")
        self._cards = stack(html_pane("teaching", self._cards_html, margin=(4, 10)), sheet="card")
        self._cards.visible = False
        side = stack(self._tables, self._cards, weight=10.5)
        self._parts["tables"] = side
        return stack(views, side, row=True, sheet="body")

    def stage(self, staging: Staging) -> None:
        """Hide and zoom as an experiment wants it."""
        self._hidden = frozenset(staging.hide)
        for name, part in self._parts.items():
            part.visible = name not in self._hidden
        self.map.zoom(staging.zoom)

    def show_cards(self, wanted: bool) -> None:
        """Show cards in the place of the tables."""
        if not wanted and not len(self._tables):
            curves = Fold(
                "Progress",
                "Progress: evidence lower bound, noise power and separability over the iterations.",
                self._curves,
                stretch=True,
            )
            panels = self.tables.panels("Objects", log_weight=6)
            self._tables[:] = [*panels, *curves.layout()]
        self._cards.visible, self._tables.visible = wanted, not wanted

    def show_before(self, picture: Picture, *, can_drag: bool, with_map: bool = True) -> None:
        """Draw what needs no estimator, and what it has found, if anything.

        The signal over fast time comes last: the page takes it for the sign that all is drawn.
        """
        several = picture.static_picture.radar.num_ramps > 1
        self._map_row.visible = several and "maps" not in self._hidden
        self._show_keys(picture)
        self.crossing.update(picture, can_drag=can_drag)
        self.delay.update(picture)
        if several:
            self.map.update(picture, with_image=with_map)
        self.pinned.follow(picture)
        self.fast_time.update(picture)

    def show_side(self, picture: Picture) -> None:
        """Draw tables and curves."""
        self._side = picture
        if self.progress is not None:
            self.progress.update(picture)
        self.tables.show(picture)

    def _curves(self) -> list[Any]:
        """Return the card of the curves, drawn."""
        self.progress = ProgressView()
        if self._side is not None:
            self.progress.update(self._side)
        return [progress_card(self.progress)]

    def _show_keys(self, picture: Picture) -> None:
        """Let the keys beside the views name a truth only where one is known."""
        keys = self.fast_time.key, self.delay.key
        if picture.score is None:
            known = picture.static_picture.observation.truth is not None
            first = self.fast_time.recorded_key if known else self.fast_time.untrue_key
            keys = first, self.delay.untrue_key
        for pane, key in zip(self._keys, keys, strict=True):
            if pane.object != key:
                pane.object = key


def glance_of(picture: Picture) -> Glance:
    """Return the map after cancellation in small; of a scene of one ramp words alone."""
    found = "" if picture.score is None else f", {picture.score.text}"
    several = picture.static_picture.radar.num_ramps > 1
    return Glance(
        f"iteration {picture.iteration}{found}", small_map(picture.map_after) if several else None
    )

"""Layouts of a raw capture that nobody described, as small range-Doppler maps to choose from."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import panel as pn
import panel_material_ui as pmu
from bokeh.events import Tap
from bokeh.models import LinearColorMapper
from bokeh.plotting import figure

from vsep.recordings.guess import BEST, Guess
from vsep_app.views.range_doppler import empty_image
from vsep_app.views.style import MAP_PALETTE
from vsep_app.widgets.layout import heading

_WIDTH, _HEIGHT = 104, 72
_PLACE = {each: each for each in ("image", "x", "y", "dw", "dh")}


class GuessPictures:
    """The most plausible layouts; nothing as long as there are none.

    Parameters
    ----------
    choose : callable
        Called with the guess that was clicked.
    """

    def __init__(self, choose: Callable[[Guess], None]) -> None:
        self._choose = choose
        self._guesses: tuple[Guess, ...] = ()
        self._images = [empty_image() for _ in range(BEST)]
        self.buttons = [self._button(number) for number in range(BEST)]
        self._rows = [
            pn.Row(self._map(number), self.buttons[number], margin=(0, 16))
            for number in range(BEST)
        ]
        self.panel = pn.Column(
            heading("Which layout?"), *self._rows, visible=False, sizing_mode="stretch_width"
        )

    def show(self, guesses: Sequence[Guess]) -> None:
        """Offer other layouts, the best one first."""
        self._guesses = tuple(guesses[:BEST])
        self.panel.visible = bool(self._guesses)
        for row in self._rows[len(self._guesses) :]:
            row.visible = False
        for number, guess in enumerate(self._guesses):
            box = {"x": [0], "y": [0], "dw": [1], "dh": [1]}
            self._images[number].data = {"image": [guess.picture], **box}
            self.buttons[number].param.update(
                label=f"{number + 1} · {guess}", description=str(guess.evidence)
            )
            self._rows[number].visible = True

    def _chosen(self, number: int, _event: Any) -> None:
        if number < len(self._guesses):
            self._choose(self._guesses[number])

    def _button(self, number: int) -> Any:
        button = pmu.Button(
            label="",
            variant="text",
            size="small",
            margin=(0, 0, 0, 4),
            sizing_mode="stretch_width",
            sx={"textAlign": "left", "lineHeight": 1.3, "fontSize": "11px"},
        )
        button.on_click(partial(self._chosen, number))
        return button

    def _map(self, number: int) -> Any:
        plot = figure(
            width=_WIDTH,
            height=_HEIGHT,
            toolbar_location=None,
            tools="",
            x_range=(0, 1),
            y_range=(0, 1),
            min_border=0,
        )
        plot.axis.visible = plot.grid.visible = False
        colours = LinearColorMapper(palette=MAP_PALETTE, low=0, high=255)
        plot.image(**_PLACE, source=self._images[number], color_mapper=colours)
        plot.on_event(Tap, partial(self._chosen, number))
        return pn.pane.Bokeh(plot, width=_WIDTH, height=_HEIGHT, margin=0)

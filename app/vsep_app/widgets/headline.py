"""The headline above the views: what the iteration brought, a timeline, a button to begin."""

from collections.abc import Mapping
from html import escape
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep_app.model.picture import Picture
from vsep_app.model.text import LogLine
from vsep_app.views.timeline import timeline_html
from vsep_app.widgets.layout import html_pane


class Headline:
    """A sentence that changes with every iteration; at the first one a button beside it."""

    def __init__(self) -> None:
        self._sentence = self._scene = self._timeline = self._figures = self._pinned = ""
        self._run_number = -1
        self._lines: tuple[LogLine, ...] = ()
        self.text = html_pane("headline", margin=(0, 4), sizing_mode="stretch_width")
        self.play = pmu.Button(
            label="Play",
            icon="play_arrow",
            description="Play: watch the separation from its first iteration.",
            variant="contained",
            size="large",
            margin=(2, 6),
            visible=False,
        )

    def layout(self) -> Any:
        """Return the row."""
        return pn.Row(self.play, self.text, sizing_mode="stretch_width", margin=0, align="center")

    def tell_scene(self, sentence: str) -> None:
        """Say which frame it is, where the controls alone do not; nothing if they do."""
        self._scene = f'<p class="scene">{escape(sentence)}</p>' if sentence else ""
        self._write()

    def tell_pinned(self, sentence: str | None) -> None:
        """Offer to pin what is shown, or say what is pinned; None does neither."""
        self._pinned = "" if sentence is None else _pinned_html(sentence)
        self._write()

    def tell(self, sentence: str) -> None:
        """Show a sentence of what is no iteration, in no other room than that of one that is.

        What is dragged below it must stay under the pointer.
        """
        self._sentence, self._figures = _sentences(sentence, ""), ""
        self._timeline = timeline_html((), shown=0, num_iterations=0)
        self._write()

    def show(self, picture: Picture, *, is_first: bool, remark: str = "") -> None:
        """Show what a picture brought, and the button as long as nothing has happened yet."""
        if picture.run_number != self._run_number or len(picture.log) > len(self._lines):
            self._lines = picture.log
        self._run_number = picture.run_number
        self._sentence = _sentences(picture.headline, remark)
        self._timeline = timeline_html(
            self._lines, shown=picture.iteration, num_iterations=picture.num_iterations
        )
        self._write()
        self.play.visible = is_first

    def describe(self, lines: Mapping[str, str]) -> None:
        """Say in words what the figures show; nobody sees it."""
        items = "".join(f"<li>{name}: {escape(text)}</li>" for name, text in lines.items())
        self._figures = f'<ul class="unseen" aria-label="Figures in words">{items}</ul>'
        self._write()

    def _write(self) -> None:
        told = self._pinned, self._sentence, self._scene, self._timeline, self._figures
        self.text.object = "".join(told)


def _pinned_html(sentence: str) -> str:
    name, label = ("unpin", "Unpin") if sentence else ("pin", "Pin this run")
    return f'<p class="pinned">{escape(sentence)} {_button(name, label)} {_HEAR}</p>'


def _button(name: str, label: str) -> str:
    return f'<button type="button" data-press="{name}">{label}</button>'


_HEAR = f"Listen: {_button('hear received', 'received')} {_button('hear cleaned', 'cleaned')}"


def _sentences(sentence: str, remark: str) -> str:
    more = f'<p class="scene">{escape(remark)}</p>' if remark else ""
    return f'<p class="headline" aria-live="polite">{escape(sentence)}</p>{more}'

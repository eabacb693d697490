"""The headline above the views: what the iteration brought, and one large button to begin."""

from html import escape
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep_app.widgets.layout import html_pane


class Headline:
    """A sentence that changes with every iteration; at the first one a button beside it."""

    def __init__(self) -> None:
        self._sentence = self._scene = ""
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

    def _write(self) -> None:
        self.text.object = (
            f'<p class="headline" aria-live="polite">{self._sentence}</p>{self._scene}'
        )

    def show(self, sentence: str, *, is_first: bool) -> None:
        """Show a sentence, and the button as long as nothing has happened yet."""
        self._sentence = escape(sentence)
        self._write()
        self.play.visible = is_first

"""Sentence above the views for what cannot be shown; it stays until that is mended."""

from html import escape
from typing import Any

from vsep_app.widgets.layout import html_pane

_STALE = {"opacity": "0.25", "filter": "grayscale(1)"}


class FaultNotice:
    """A sentence above the views, which are greyed meanwhile: what they show is of before."""

    def __init__(self) -> None:
        self.pane = html_pane("fault", margin=0, sizing_mode="stretch_width", visible=False)
        self._views: list[Any] = []
        self._shown: tuple[int, int] | None = None

    def cover(self, *views: Any) -> None:
        """Say which views are greyed."""
        self._views = [*views]

    def tell(self, sentence: str, *, shown: tuple[int, int], stale: bool = True) -> None:
        """Show a sentence; `shown` is the run and the iteration that the views are left at.

        They are greyed if they are `stale`, not what the controls say.
        """
        self._shown = shown
        self.pane.param.update(
            object=f'<p class="fault" role="alert">{escape(sentence)}</p>', visible=True
        )
        for view in self._views if stale else ():
            view.styles = {**view.styles, **_STALE}

    def clear(self, *, shown: tuple[int, int]) -> None:
        """Take the sentence away, once another run or iteration is shown."""
        if self._shown in (None, shown):
            return
        self._shown = None
        self.pane.param.update(object="", visible=False)
        for view in self._views:
            view.styles = {key: value for key, value in view.styles.items() if key not in _STALE}

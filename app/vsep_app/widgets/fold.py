"""A part of the page that stays folded, and is not made, until it is asked for."""

from collections.abc import Callable, Sequence
from typing import Any

import panel as pn
import panel_material_ui as pmu


class Fold:
    """A button that opens what is below it and closes it again.

    What it holds costs the browser nothing until it is opened for the first time.

    Parameters
    ----------
    label, text : str
        Of the button, and its tooltip, which begins with the label.
    content : callable
        Makes what is below; called once.
    stretch : bool
        Whether it takes a share of the free height when it is open.
    """

    def __init__(
        self,
        label: str,
        text: str,
        content: Callable[[], Sequence[Any]],
        *,
        stretch: bool = False,
    ) -> None:
        self._content = content
        self.button = pmu.Button(
            label=label,
            icon="expand_more",
            description=text,
            variant="text",
            size="small",
            margin=(4, 8),
            sizing_mode="stretch_width",
            sx={"justifyContent": "flex-start"},
        )
        self._styles = {"flex": "8 1 0", "min-height": "0"} if stretch else {}
        self.place = pn.Column(
            visible=False,
            margin=0,
            sizing_mode="stretch_both" if stretch else "stretch_width",
            styles=self._styles,
        )
        self.button.on_click(lambda _: self.open(not self.place.visible))

    def layout(self) -> list[Any]:
        """Return the button and the place below it."""
        return [self.button, self.place]

    def open(self, wanted: bool = True) -> None:
        """Open or close it."""
        if wanted and not len(self.place):
            self.place[:] = [*self._content()]
        self.place.visible = wanted
        self.button.icon = "expand_less" if wanted else "expand_more"

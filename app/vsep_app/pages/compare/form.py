"""What a user chooses to compare: up to four methods, the mask, and the scene of the live view."""

from collections.abc import Callable
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep_app.model.compare_settings import (
    MAX_METHODS,
    MIN_METHODS,
    NO_METHOD,
    CompareSettings,
    method_labels,
    require_distinct,
)
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.layout import heading

_MASK_LABELS = {
    "Perfect": "truth",
    "Amplitude": "amplitude",
    "Autoregressive": "autoregressive",
    "Residual": "residual",
}
_TIGHT = {"sizing_mode": "stretch_width", "size": "small"}
_HALF = (6, 4, 6, 16), (6, 16, 6, 4)


class CompareForm:
    """The side bar of the compare page.

    Parameters
    ----------
    choice : CompareSettings
        Read and set by the widgets.
    controls : Controls
        The controls of the scene.
    notify_error : callable
        Tells the user what cannot be done.
    """

    def __init__(
        self, choice: CompareSettings, controls: Controls, notify_error: Callable[[str], None]
    ) -> None:
        self.choice, self._controls, self._complain = choice, controls, notify_error
        self.methods = [self._select(number) for number in range(MAX_METHODS)]
        self.mask = pmu.Select(
            label=CompareSettings.param.mask.label,
            options=_MASK_LABELS,
            value=choice.mask,
            description=CompareSettings.param.mask.doc,
            **_TIGHT,
        )
        self.debias = pmu.Switch(
            label=CompareSettings.param.debias.label,
            value=choice.debias,
            description=CompareSettings.param.debias.doc,
            margin=(10, 12, 0, 6),
            size="small",
        )
        self.mask.param.watch(lambda event: choice.param.update(mask=event.new), "value")
        self.debias.param.watch(lambda event: choice.param.update(debias=event.new), "value")
        choice.param.watch(lambda *_: self._show(), ["methods", "mask", "debias"])
        self._show()

    def layout(self) -> list[Any]:
        """Return the side bar from top to bottom."""
        controls = self._controls
        return [
            heading("Methods"),
            _pair(*self.methods[:2]),
            _pair(*self.methods[2:]),
            _pair(self.mask, self.debias),
            *controls.scene(),
            heading("Detection"),
            controls.widgets["schedule"],
            *controls.thresholds(),
            controls.upload,
        ]

    def _select(self, number: int) -> Any:
        options = {name: name for name in method_labels()}
        if number >= MIN_METHODS:
            options = {"none": NO_METHOD, **options}
        select = pmu.Select(
            label=f"Method {number + 1}",
            options=options,
            description=CompareSettings.param.methods.doc,
            **_TIGHT,
        )
        select.param.watch(lambda _: self._take(), "value")
        return select

    def _take(self) -> None:
        """Take the methods chosen; a choice that cannot be is told and undone."""
        chosen = [select.value for select in self.methods if select.value != NO_METHOD]
        if self._showing or chosen == self.choice.methods:
            return
        try:
            self.choice.methods = require_distinct(chosen)
        except InputError as error:
            self._complain(str(error))
            self._show()

    _showing = False

    def _show(self) -> None:
        """Show the choice on the widgets; on the way there nothing is taken from them."""
        self._showing = True
        methods = [*self.choice.methods, *[NO_METHOD] * MAX_METHODS]
        for select, name in zip(self.methods, methods, strict=False):
            select.value = name
        self.mask.value, self.debias.value = self.choice.mask, self.choice.debias
        self._showing = False


def _pair(left: Any, right: Any) -> Any:
    left.margin, right.margin = _HALF
    return pn.Row(left, right, margin=0, sizing_mode="stretch_width")

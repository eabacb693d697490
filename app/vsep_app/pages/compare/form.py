"""Form of the compare page: up to four methods, the mask, the scene of the live view."""

from collections.abc import Callable
from html import escape
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep_app.model.compare_settings import (
    MAX_METHODS,
    MIN_METHODS,
    NO_METHOD,
    CompareSettings,
    method_entries,
    method_groups,
    require_distinct,
)
from vsep_app.widgets.controls import Controls
from vsep_app.widgets.fields import field, pair
from vsep_app.widgets.layout import heading, small_text

_MASK_LABELS = {
    "Perfect": "truth",
    "Amplitude": "amplitude",
    "Autoregressive": "autoregressive",
    "Residual": "residual",
}


class CompareForm:
    """The side bar of the compare page: sets what is compared, and has the controls of the scene.

    `notify_error` tells the user what cannot be done.
    """

    def __init__(
        self, choice: CompareSettings, controls: Controls, notify_error: Callable[[str], None]
    ) -> None:
        self.choice, self._controls, self._notify_error = choice, controls, notify_error
        self.methods = [self._select(number) for number in range(MAX_METHODS)]
        mask, debias = CompareSettings.param.mask, CompareSettings.param.debias
        self._lines = pn.pane.HTML(margin=(0, 16, 6, 16), sizing_mode="stretch_width")
        self.mask = field(pmu.Select, mask.label, mask.doc, options=_MASK_LABELS, value=choice.mask)
        self.debias = pmu.Switch(
            label=debias.label,
            value=choice.debias,
            description=debias.doc,
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
            pair(*self.methods[:2]),
            pair(*self.methods[2:]),
            self._lines,
            pair(self.mask, self.debias),
            *controls.scene(),
            heading("Detection"),
            controls.widgets["schedule"],
            *controls.thresholds(),
            controls.upload,
            controls.refused,
        ]

    def _select(self, number: int) -> Any:
        groups = {group: {name: name for name in names} for group, names in method_groups().items()}
        if number >= MIN_METHODS:
            groups = {"No method": {"none": NO_METHOD}, **groups}
        text = CompareSettings.param.methods.doc
        select = field(pmu.Select, f"Method {number + 1}", text, groups=groups)
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
            self._notify_error(str(error))
            self._show()

    _showing = False

    def _show(self) -> None:
        """Show the choice on the widgets; on the way there nothing is taken from them."""
        self._showing = True
        methods = [*self.choice.methods, *[NO_METHOD] * MAX_METHODS]
        for select, name in zip(self.methods, methods, strict=False):
            select.value = name
        helps = {entry.name: entry.help for entry in method_entries()}
        lines = (f"<b>{escape(name)}</b>: {escape(helps[name])}" for name in self.choice.methods)
        self._lines.object = small_text("<br>".join(lines))
        self.mask.value, self.debias.value = self.choice.mask, self.choice.debias
        self._showing = False

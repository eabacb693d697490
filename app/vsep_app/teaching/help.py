"""Help of every page: the three views, all controls and methods in words, and a glossary."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from html import escape
from typing import Any

import panel as pn
import panel_material_ui as pmu
from panel_material_ui.widgets.base import MaterialWidget

from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.registry import MITIGATIONS
from vsep.presets.registry import PRESETS
from vsep.studies.catalogue import CATALOGUE
from vsep_app.assets import path
from vsep_app.widgets.layout import ICON_ONLY, html_pane, stylesheet


class Help:
    """A button for the header and the dialog that it opens; Escape or a click beside it closes it.

    The tooltips of the controls in the parts of the page that is shown are listed; `parts` returns
    them.
    """

    def __init__(self, parts: Callable[[], Iterable[Any]]) -> None:
        self.button = pmu.Button(
            label="Help",
            icon="help_outline",
            variant="text",
            size="small",
            description="Help: the three views, all controls, scenes, methods, and a glossary.",
            sx={"color": "white", "minWidth": "0", "@media (max-width: 599px)": ICON_ONLY},
            margin=(0, 2),
            align="center",
        )
        self._parts, self._listed = parts, ""
        self.dialog = pmu.Dialog(
            title="Help",
            title_variant="h4",
            show_close_button=True,
            close_on_click=True,
            width_option="md",
            sizing_mode="stretch_width",
        )
        self.button.on_click(self._open)

    def _open(self, _: Any) -> None:
        listed = controls_html(self._parts())
        if not len(self.dialog) or listed != self._listed:
            self._listed = listed
            self.dialog[:] = [self._tabs()]
        self.dialog.open = True

    def _tabs(self) -> Any:
        """Return what the dialog holds; no page has it before it is asked for."""
        return pmu.Tabs(
            ("Views", _document("views")),
            ("Controls", _pane(self._listed)),
            ("Methods", _pane(methods_html())),
            ("Scenes", _pane(scenes_html())),
            ("Glossary", _document("glossary")),
            sizing_mode="stretch_width",
        )


def controls_of(parts: Iterable[Any]) -> Iterator[Any]:
    """Yield all widgets that a user can set, in the order of the page."""
    for part in parts:
        for widget in part.select(MaterialWidget):
            if not isinstance(widget, pmu.LinearProgress):
                yield widget


def controls_html(parts: Iterable[Any]) -> str:
    """Return what the tooltips say: a phone and a keyboard have no pointer to hover with."""
    return _list_html(
        {str(widget.label): str(widget.description or "") for widget in controls_of(parts)}
    )


def methods_html() -> str:
    """Return what every estimator and every mitigation method is, group by group."""
    groups: dict[str, dict[str, str]] = {"Estimators": {}}
    for entry in ESTIMATORS.values():
        groups["Estimators"][f"{entry.label} ({entry.name})"] = entry.help
    for method in MITIGATIONS.values():
        groups.setdefault(method.group, {})[f"{method.label} ({method.name})"] = method.help
    return "".join(
        f"<h4>{escape(group)}</h4>{_list_html(entries)}" for group, entries in groups.items()
    )


def scenes_html() -> str:
    """Return what presets and studies there are."""
    presets = _list_html({preset.label: preset.help for preset in PRESETS.values()})
    studies = _list_html({study.name: study.title for study in CATALOGUE.values()})
    return f"<h2>Presets</h2>{presets}<h2>Studies</h2>{studies}"


def _list_html(entries: Mapping[str, str]) -> str:
    lines = "".join(
        f"<dt>{escape(label)}</dt><dd>{escape(text)}</dd>" for label, text in entries.items()
    )
    return f"<dl>{lines}</dl>"


def _document(name: str) -> Any:
    text = path(f"help/{name}.md").read_text(encoding="utf-8")
    return pn.pane.Markdown(
        text, sizing_mode="stretch_width", margin=(0, 8), stylesheets=[stylesheet("teaching")]
    )


def _pane(html: str) -> Any:
    return html_pane("teaching", html, sizing_mode="stretch_width", margin=(0, 8))

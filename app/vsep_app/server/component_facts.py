"""Changes to Panel's components: what each component works out anew is worked out once a class.

A page is a hundred components or so. Panel copies all parameters of each of them, looks for the
files of its class on the disk, sends with each where a browser would find the modules that the
bundle of all of them holds already, makes a row around each pane for the case that it stands alone,
asks for all properties of a text that changes, looks through the whole page for data that it has
just made, or for links that may concern what has changed, and sends with every page what all of its
classes are, most of which no page uses. `spare_components` ends that. Nor may one page be lost
because another one adds a link while all links are looked through.
"""

from collections.abc import Iterator
from functools import cache, cached_property
from typing import Any, Final
from weakref import WeakKeyDictionary

import bokeh.document.document as document_of_bokeh
import panel as pn
import panel_material_ui as pmu
from bokeh.core.has_props import is_DataModel
from panel.custom import ReactiveESM
from panel.links import Callback
from panel.pane.base import PaneBase
from panel.reactive import ReactiveCustomBase
from panel.util import classproperty
from panel.viewable import Layoutable, Viewable
from panel_material_ui.base import MaterialComponent
from param.parameterized import no_instance_params

from vsep_app.pages.recording.files import DropZone

ALIKE: Final = (
    pmu.Button,
    pmu.DiscreteSlider,
    pmu.FloatSlider,
    pmu.IntSlider,
    pmu.Select,
    pmu.Switch,
    pmu.TextInput,
    pn.Column,
    pn.Row,
    pn.pane.Bokeh,
    pn.pane.HTML,
)
"""Classes that never change the bounds or choices of a parameter for one component alone."""

SENT: Final = (
    *(kind for kind in ALIKE if issubclass(kind, ReactiveESM)),
    pmu.CheckBoxGroup,
    DropZone,
    pmu.Dialog,
    pmu.FileDownload,
    pmu.FileInput,
    pmu.FloatInput,
    pmu.IntInput,
    pmu.LinearProgress,
    pmu.MenuButton,
    pmu.NotificationArea,
    pmu.Page,
    pmu.RadioButtonGroup,
    pmu.Tabs,
    pmu.TextAreaInput,
)
"""Classes that a page knows of when it opens: it may come to use any of them."""

# Panel 1.9 takes this name for the sign that a component is styled by Material UI; 1.10 sends none.
# Nothing asks for what it leads to.
_SIGN: Final = "@mui/material/"
_MODULES: Final[dict[str, Any]] = {
    "imports": {_SIGN: MaterialComponent._importmap["imports"][_SIGN]}
}
_FILES: Final[tuple[tuple[Any, str, Any], ...]] = tuple(
    (kind, name, classproperty(cache(vars(kind)[name].f)))
    for kind in (ReactiveESM, MaterialComponent)
    for name in ("_bundle_path", "_bundle_css")
    if (kind, name) != (MaterialComponent, "_bundle_css")
)


def _classes(kind: Any) -> Iterator[Any]:
    yield kind
    for each in kind.__subclasses__():
        yield from _classes(each)


_unused_data: Final[set[Any]] = {kind._data_model for kind in _classes(ReactiveESM)} - {
    kind._data_model for kind in SENT
}


def _is_sent(kind: Any) -> bool:
    """Whether a page is told of a class: of data, but not of components that no page has."""
    return is_DataModel(kind) and kind not in _unused_data


def _bundled_modules(kind: Any) -> dict[str, Any]:
    """Return where modules of a class are to be found: its bundle brings them."""
    del kind
    return _MODULES


def _tag_own_data(kind: Any, data: Any, reference: str) -> None:
    """Note in the data of a component which page it belongs to; parts of it have done so."""
    del kind
    _unused_data.discard(type(data))
    tag = f"__ref:{reference}"
    if tag not in data.tags:
        data.tags.append(tag)


def _make_pane(self: Any, object: Any = None, **params: Any) -> None:
    """Make a pane; stands in for `PaneBase.__init__`, without the row."""
    self._object_changing = False
    super(PaneBase, self).__init__(object=object, **params)
    applies = self.applies(self.object, **(params if self._applies_kw else {}))
    if applies is False and self.object is not None:
        self._type_error(self.object)


def _row_around(pane: Any) -> Any:
    """Return the row of a pane that somebody asks for, which follows its size."""
    names = [name for name in Layoutable.param if name not in pane._skip_layoutable]
    row = pane.default_layout(pane, **{name: getattr(pane, name) for name in names})
    vars(pane)["layout"] = row
    pane._internal_callbacks.append(pane.param.watch(pane._sync_layoutable, list(Layoutable.param)))
    pane._sync_layoutable()
    return row


def _write_text(self: Any, ref: str, model: Any) -> None:
    """Write the text of a pane anew, and nothing else: what else changes is written by itself."""
    del ref
    model.text = self._transform_object(self.object)["object"]


class _Links(WeakKeyDictionary[Any, Any]):
    """Links of all pages, of which a thread of another page may add some at any time."""

    def values(self) -> Any:
        """Return the links as they are now."""
        held = vars(self)["data"].copy()  # at once, unlike an iteration
        return [links for source, links in held.items() if source() is not None]


def _process_links(
    kind: Any, root_view: Any, root_model: Any, changed: Any = None, old_models: Any = None
) -> None:
    """Make the links of what is new; where no link begins, the whole page is not looked through.

    No link of this program ends at a component: they bring their models as arguments.
    """
    if changed is None or any(each in kind.registry for each in changed.select()):
        _process_all_links(kind, root_view, root_model, changed, old_models)


_process_all_links = vars(Callback)["_process_callbacks"].__func__
_hooks = [each for each in Viewable._preprocessing_hooks if each != Callback._process_callbacks]
_layout = cached_property(_row_around)
_layout.__set_name__(PaneBase, "layout")
CHANGES: Final[tuple[tuple[Any, str, Any], ...]] = (
    *_FILES,
    # Fonts, which the head of a document has (`fonts`), and calendars.
    (MaterialComponent, "_bundle_css", classproperty(lambda _: [])),
    (MaterialComponent, "_process_importmap", classmethod(_bundled_modules)),
    (ReactiveCustomBase, "_patch_datamodel_ref", classmethod(_tag_own_data)),
    (document_of_bokeh, "is_DataModel", _is_sent),
    (PaneBase, "__init__", _make_pane),
    (PaneBase, "layout", _layout),
    (pn.pane.HTML, "_update", _write_text),
    (Callback, "registry", _Links(Callback.registry)),
    (Callback, "_process_callbacks", classmethod(_process_links)),
    # Panel adds the one that is there when it makes the next link.
    (Viewable, "_preprocessing_hooks", _hooks),
)
"""Whose, its name, and what stands in its place."""


def spare_components() -> None:
    """Let components of a class share what is the same for all of them."""
    for kind in ALIKE:
        no_instance_params(kind)
    for owner, name, ours in CHANGES:
        setattr(owner, name, ours)

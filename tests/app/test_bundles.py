"""What browsers do not get: modules, icons and classes that no page uses."""

import gzip
import re
from functools import cache
from pathlib import Path

import pytest
from bokeh.model import DataModel
from bokeh.settings import settings
from fontTools.ttLib import TTFont
from panel.io.resources import DIST_DIR
from panel_material_ui.base import DIST_PATH, FONT_CSS
from vsep_app.assets import path
from vsep_app.pages import PAGES
from vsep_app.server.bundles import KEPT, VERSION, with_version, without_unused
from vsep_app.server.component_facts import SENT
from vsep_app.server.fonts import font_rules

from tests.app.test_model_facts import opened

BUNDLES = {name: settings.bokehjs_path() / "js" / name for name in KEPT}
BUNDLES["panel.min.js"] = DIST_DIR / "panel.min.js"


@cache
def kept(name):
    return without_unused(name, BUNDLES[name].read_text(encoding="utf-8"))


@cache
def icons(file):
    """The words that a font has an icon for."""
    font = TTFont(file)
    letters = {glyph: chr(code) for code, glyph in font.getBestCmap().items()}
    (table,) = font["GSUB"].table.LookupList.Lookup[0].SubTable
    return {
        "".join(letters[glyph] for glyph in (first, *each.Component))
        for first, ligatures in table.ligatures.items()
        for each in ligatures
    }


@pytest.mark.parametrize("route", PAGES)
def test_a_page_uses_what_is_sent(route):
    models = list(opened(route).models)
    code = "".join(map(kept, KEPT))
    for kind in {type(model) for model in models}:
        if kind.__module__.startswith(("panel.models", "bokeh.models.widgets")):
            # Bokeh 3.9 gives a class its name, 3.10 writes it out.
            assert re.search(rf'\.__name__="{kind.__name__}"|class {kind.__name__} ', code), kind
    data = [model for model in models if isinstance(model, DataModel)]
    assert {type(each) for each in data} <= {kind._data_model for kind in SENT}
    shown = {each.icon for each in data if "icon" in each.properties() and each.icon}
    assert shown
    assert shown <= icons(path("fonts/icons.woff"))


@pytest.mark.parametrize("name", KEPT)
def test_what_is_kept_of_a_bundle_is_as_it_was(name):
    whole = BUNDLES[name].read_text(encoding="utf-8")
    lines = set(whole.splitlines())
    changed = [line for line in kept(name).splitlines() if line not in lines]
    assert changed
    assert all(line.endswith(": function _() {},") for line in changed)
    assert "Redistributions of source code must retain" in kept(name)
    assert len(gzip.compress(kept(name).encode())) < 0.2 * len(gzip.compress(whole.encode()))


def test_other_files_and_bundles_of_another_make_are_left_alone():
    assert without_unused("panel.min.js", "export {}") == "export {}"
    text = BUNDLES["panel.min.js"].read_text(encoding="utf-8")
    assert without_unused("bokeh.min.js", text) == text
    renamed = text.replace('"models/html":', '"models/markup":')
    assert without_unused("panel.min.js", renamed) == renamed != text


def test_addresses_of_changed_bundles_say_so():
    page = '<script src="static/js/bokeh.min.js?v=1"></script><script src="a/panel.min.js?v=2">'
    assert with_version(page) == page.replace(
        "panel.min.js?v=2", f"panel.min.js?kept={VERSION}&v=2"
    )


def test_icons_are_those_of_panel():
    """The day Panel's fonts have ranges of characters alone, `fonts` is not needed."""
    (whole,) = DIST_PATH.glob("material-icons-????????.woff")
    assert icons(path("fonts/icons.woff")) < icons(whole)
    sheet = Path(FONT_CSS[0]).read_text(encoding="utf-8")
    assert sheet.count("@font-face") > 3 * sheet.count("unicode-range")
    assert "Material Icons" in font_rules()

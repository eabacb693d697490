"""Fonts of all pages: rules for the head of a document.

Panel sends two style sheets, of which one does not say which characters a file has, so that
browsers fetch what no page writes; each of its components names one of them again; and its font of
icons has two thousand.
"""

import re
from base64 import b64encode

from panel_material_ui import __version__
from panel_material_ui.base import DIST_PATH

from vsep_app.assets import path

_RULE = re.compile(r"@font-face\{font-family:Roboto;[^}]*\}")
_FILE = re.compile(r'src:url\("\./(roboto-(?:latin|math|symbols)-\d00-normal-\w+\.woff2)"\)[^;]*')
_FOLDER = "static/extensions/panel-material-ui/"


def font_rules() -> str:
    """Return the rules: letters, what stands in formulas, and the icons themselves."""
    sheet = (DIST_PATH / "panel-material-ui.bundle.css").read_text(encoding="utf-8")
    address = rf'src:url("{_FOLDER}\1?v={__version__}") format("woff2")'
    letters = "".join(
        _FILE.sub(address, rule) for rule in _RULE.findall(sheet) if _FILE.search(rule)
    )
    icons = b64encode(path("fonts/icons.woff").read_bytes()).decode()
    return (
        f'{letters}@font-face{{font-family:"Material Icons";'
        f'src:url("data:font/woff;base64,{icons}")format("woff")}}'
    )

"""Makes icons.woff: those of Material Icons that the dashboard shows.

Call it with the file of the whole font, as panel-material-ui brings it:

    python make_icons.py PACKAGES/panel_material_ui/dist/material-icons-JLIDJUWE.woff
"""

import string
import sys
from pathlib import Path

from fontTools import subset
from fontTools.ttLib import TTFont

ICONS = (
    "download",
    "expand_less",
    "expand_more",
    "fast_forward",
    "first_page",
    "help_outline",
    "link",
    "open_in_new",
    "pause",
    "photo_camera",
    "play_arrow",
    "present_to_all",
    "replay",
    "save",
    "skip_next",
    "skip_previous",
    "stop",
)


def main() -> None:
    """Read the whole font, write the small one beside this file."""
    font = TTFont(sys.argv[1])
    glyphs = font.getBestCmap()
    letters = {glyph: chr(code) for code, glyph in glyphs.items()}
    (table,) = font["GSUB"].table.LookupList.Lookup[0].SubTable
    kept = {
        first: [
            each
            for each in ligatures
            if "".join(letters[glyph] for glyph in (first, *each.Component)) in ICONS
        ]
        for first, ligatures in table.ligatures.items()
    }
    table.ligatures = {first: ligatures for first, ligatures in kept.items() if ligatures}
    icons = [each.LigGlyph for ligatures in kept.values() for each in ligatures]
    options = subset.Options()
    # Letters alone would keep every icon that can be spelled with them.
    options.layout_closure = False
    options.layout_features = options.name_IDs = ["*"]
    options.hinting = options.glyph_names = False
    options.drop_tables += ["GPOS", "GDEF"]
    subsetter = subset.Subsetter(options)
    subsetter.populate(glyphs=[*icons, *(glyphs[ord(c)] for c in string.ascii_lowercase + "_")])
    subsetter.subset(font)
    font.flavor = "woff"
    font.save(Path(__file__).with_name("icons.woff"))


if __name__ == "__main__":
    main()

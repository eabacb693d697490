"""Recipes of published tables: what made a table, and that it is still as it was made."""

import hashlib
import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from vsep._version import __version__
from vsep.reproduction.figures import Extent, Figure
from vsep.studies.study import Study

NAME: Final = "recipes.json"
"""File of the recipes beside the tables."""


def recipe_of(study: Study) -> str:
    """Return a checksum of all that determines the rows of a study: points, methods, seeds, extent.

    Examples
    --------
    >>> from vsep.studies.catalogue import make_study
    >>> recipe_of(make_study("fig-2")) == recipe_of(make_study("fig-2", realizations=2))
    False
    """
    what = {
        "study": study.name,
        "settings": asdict(study.settings),
        "methods": study.methods,
        "realizations": study.realizations,
        "points": {index: study.points[index].parameters() for index in study.point_indices},
    }
    return _checksum(json.dumps(what, sort_keys=True).encode())


def record_recipe(folder: Path, figure: Figure, extent: Extent) -> None:
    """Write down how the table of a figure in a folder was made; other entries stay."""
    path = folder / NAME
    recipes = read_recipes(folder) if path.exists() else {}
    recipes[figure.name] = {
        "extent": extent,
        "version": __version__,
        "date": datetime.now(UTC).date().isoformat(),
        "recipe": recipe_of(figure.study_of(extent)),
        "table": table_checksum(folder / f"{figure.name}.csv"),
    }
    path.write_text(json.dumps(recipes, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def read_recipes(folder: Path) -> dict[str, Any]:
    """Return the recipes of a folder by figure."""
    recipes: dict[str, Any] = json.loads((folder / NAME).read_text(encoding="utf-8"))
    return recipes


def table_checksum(path: Path) -> str:
    """Return the checksum of a table; line ends of a checkout do not matter."""
    return _checksum(path.read_bytes().replace(b"\r\n", b"\n"))


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()

"""Guided experiments: text files with a setting, one question, what to watch, and the answer.

A file is TOML. Beside its texts it has a table of values under the names that the address of the
page uses, so that a link of the page tells a lecturer what to write.
"""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from vsep.errors import InputError, shown
from vsep.files.opening import read_bounded
from vsep_app.assets import folder as shipped_folder
from vsep_app.model.compare_settings import (
    DEBIAS_KEY,
    MASK_KEY,
    METHODS_KEY,
    CompareSettings,
    parse_choice,
)
from vsep_app.model.settings import PLAN_NAMES, Settings
from vsep_app.model.url import QUERY_NAMES, as_given, parse_query
from vsep_app.teaching.question import Question, read_question
from vsep_app.teaching.staging import STAGING_KEYS, Staging, read_staging

EXPERIMENT_KEY = "experiment"
LIVE, COMPARE = "./", "compare"
_PAGES = {"live": LIVE, "compare": COMPARE}
_TEXTS = ("title", "setting", "question", "watch", "answer")
_MAX_FILE = 65536  # bytes
_KEYS = (*_TEXTS, "page", "values", "ask", *STAGING_KEYS)
_CHOICE_KEYS = (METHODS_KEY, MASK_KEY, DEBIAS_KEY)
_AS_USUAL = Staging()
# A number in front of the name puts the files in their order.
_FILE_NAME = re.compile(r"(?:\d+-)?([a-z][a-z0-9-]*)")


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One guided experiment."""

    name: str  #: What the address calls it.
    #: Its texts; an empty line begins a paragraph.
    title: str
    setting: str
    question: str
    watch: str
    answer: str
    page: str  #: Address of the page that it is for, `LIVE` or `COMPARE`.
    query: Mapping[str, Any]  #: Values under the names of the address.
    staging: Staging = _AS_USUAL  #: What to predict, and what of the page is shown how.
    ask: Question | None = None  #: A number to answer with.

    def settings(self) -> dict[str, Any]:
        """Return all that determines a run: what the file leaves out has its usual value."""
        usual = {name: Settings.param[name].default for name in PLAN_NAMES}
        return {**usual, **parse_query(self.query)[0]}

    def choice(self) -> dict[str, Any]:
        """Return what is compared; what the file leaves out has its usual value."""
        usual = {
            name: CompareSettings.param[name].default for name in ("methods", "mask", "debias")
        }
        return {**usual, **parse_choice(self.query)[0]}

    @property
    def link(self) -> str:
        """Address that opens it."""
        return f"{self.page}?{EXPERIMENT_KEY}={self.name}"


def read_experiment(path: Path) -> Experiment:
    """Read the file of an experiment.

    Raises `InputError` if it cannot be read or is no experiment; one sentence that names the file.
    """
    try:
        content = tomllib.loads(
            read_bounded(path, f"The experiment {path.name}", "a TOML file", _MAX_FILE).decode()
        )
    except UnicodeDecodeError as error:
        raise InputError(f"The experiment {path.name} is no text in UTF-8.") from error
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        # ValueError: no TOML, or a number of thousands of digits; RecursionError: lists in lists.
        reason = "it is nested too deeply" if isinstance(error, RecursionError) else error
        raise InputError(f"The experiment {path.name} cannot be read ({reason}).") from error
    named = _FILE_NAME.fullmatch(path.stem)
    if named is None:
        raise InputError(
            f"The experiment {path.name} needs a file name of small letters, digits and hyphens."
        )
    try:
        return _make(named[1], content)
    except InputError as error:
        raise InputError(f"The experiment {path.name}: {error}") from error


def read_experiments(folder: Path) -> tuple[Experiment, ...]:
    """Read all experiments of a folder, in the order of their file names.

    Raises `InputError` if the folder is not there or holds no experiment, one of its files is no
    experiment, or two have the same name.
    """
    if not folder.is_dir():
        raise InputError(f"The folder of experiments {folder} is not there.")
    experiments = tuple(read_experiment(path) for path in sorted(folder.glob("*.toml")))
    if not experiments:
        raise InputError(f"The folder {folder} holds no experiment, that is no .toml file.")
    require_different(experiments)
    return experiments


def require_different(experiments: Sequence[Experiment]) -> None:
    """Raise `InputError` where two experiments have the same name."""
    names = [experiment.name for experiment in experiments]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"Two experiments are named {twice[0]}; rename one of the files.")


@cache
def shipped_experiments() -> tuple[Experiment, ...]:
    """Return the experiments that come with the program."""
    return read_experiments(shipped_folder("experiments"))


def open_experiment(
    query: Mapping[str, Any], experiments: Sequence[Experiment], page: str
) -> tuple[dict[str, Any], Experiment | None, list[str]]:
    """Return the query that an address with an experiment stands for.

    Parameters
    ----------
    query : mapping
        Decoded query of the address; what it names itself counts before the experiment's value.
    experiments : sequence of Experiment
        Those there are.
    page : str
        The page that is opened; an experiment for another page sets nothing here.

    Returns
    -------
    dict
        The query with the experiment's values.
    Experiment or None
        The experiment.
    list of str
        One sentence if it does not exist.
    """
    name = query.get(EXPERIMENT_KEY)
    if name is None:
        return dict(query), None, []
    found = next((one for one in experiments if one.name == name), None)
    if found is None:
        names = ", ".join(one.name for one in experiments)
        return (
            dict(query),
            None,
            [f"{EXPERIMENT_KEY} is {as_given(name)}; it must be one of {names}."],
        )
    return ({**found.query, **query} if found.page == page else dict(query)), found, []


def _make(name: str, content: Mapping[str, Any]) -> Experiment:
    """Return the experiment that a file holds; an `InputError` says what of it is not right."""
    unknown = [key for key in content if key not in _KEYS]
    if unknown:
        raise InputError(f"it has {shown(unknown[0])}; it may have {', '.join(_KEYS)}.")
    for key in _TEXTS:
        if not isinstance(content.get(key), str) or not content[key].strip():
            raise InputError(f"it has no text {key!r}.")
    page = content.get("page", "live")
    if not isinstance(page, str) or page not in _PAGES:
        raise InputError(f"its page is {shown(page)}; it must be one of {', '.join(_PAGES)}.")
    query = content.get("values", {})
    if not isinstance(query, Mapping):
        raise InputError("its values are no table; write them below a line [values].")
    allowed = (*QUERY_NAMES.values(), *(_CHOICE_KEYS if page == "compare" else ()))
    unknown = [key for key in query if key not in allowed]
    if unknown:
        raise InputError(f"it sets {shown(unknown[0])}; it may set {', '.join(allowed)}.")
    errors = [*parse_query(query)[1], *parse_choice(query)[1]]
    if errors:
        raise InputError(errors[0])
    texts = {key: content[key].strip() for key in _TEXTS}
    if "ask" in content and content.get("predict"):
        raise InputError("it has both predict and ask; one question is enough.")
    return Experiment(
        name=name,
        page=_PAGES[page],
        query=dict(query),
        staging=read_staging(content),
        ask=read_question(content["ask"]) if "ask" in content else None,
        **texts,
    )

"""Settings over which a recorded run has several runs, each with a slider."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from typing import Any

from vsep.errors import InputError, shown
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, SETTINGS, Plan
from vsep_app.model.url import QUERY_NAMES, parse_query
from vsep_app.report.spec import ReportSpec

MOST_VARIED, MOST_RUNS = 2, 12
_NAMES = {
    key: name
    for name, key in QUERY_NAMES.items()
    if name in PLAN_NAMES
    and isinstance(SETTINGS[name].default, int | float)
    and not isinstance(SETTINGS[name].default, bool)
}


@dataclass(frozen=True, kw_only=True)
class VariedSetting:
    """A setting with the values of its slider."""

    name: str  #: As a plan has it.
    label: str
    values: tuple[float, ...]


def read_varied(texts: Sequence[str], plan: Plan) -> tuple[VariedSetting, ...]:
    """Return the settings that are varied.

    Parameters
    ----------
    texts : sequence of str
        Each a name as an address has it, and values: ``sir=-30,-20,-10``.
    plan : Plan
        What they vary.

    Raises
    ------
    InputError
        If one cannot be used, or they are too many.

    Examples
    --------
    >>> from vsep_app.report.spec import default_plan
    >>> (varied,) = read_varied(["sir=-30,-20"], default_plan("simulation-2-b"))
    >>> varied.name, varied.values
    ('sir_db', (-30.0, -20.0))
    """
    if texts and plan.preset == LOADED_FRAME:
        raise InputError(f"--vary {texts[0]} needs a simulated scene, as --preset names one.")
    varied = tuple(_read(text, plan) for text in texts)
    if len({each.name for each in varied}) < len(varied):
        raise InputError(f"--vary {texts[-1]} varies a setting again; give each once.")
    number = prod(len(each.values) for each in varied)
    if len(varied) > MOST_VARIED or number > MOST_RUNS:
        raise InputError(
            f"--vary asks for {number} runs over {len(varied)} settings; it may be at most "
            f"{MOST_RUNS} over {MOST_VARIED}."
        )
    return varied


def varied_specs(spec: ReportSpec, varied: Sequence[VariedSetting]) -> tuple[ReportSpec, ...]:
    """Return a spec for every combination of values; the last setting varies fastest."""
    names = [each.name for each in varied]
    return tuple(
        replace(spec, plan=replace(spec.plan, **dict(zip(names, values, strict=True))))
        for values in product(*(each.values for each in varied))
    )


def _read(text: str, plan: Plan) -> VariedSetting:
    key, equals, listed = text.partition("=")
    if not equals or key not in _NAMES:
        raise InputError(
            f"--vary is {shown(text)}; it must be one of {', '.join(sorted(_NAMES))}, and values: "
            "sir=-30,-20,-10."
        )
    name = _NAMES[key]
    values: list[Any] = []
    for value in listed.split(","):
        taken, errors = parse_query({"preset": plan.preset, key: value})
        if errors:
            raise InputError(f"--vary {shown(text)}: {errors[0]}")
        values.append(taken[name])
    return VariedSetting(name=name, label=SETTINGS[name].form_label, values=tuple(values))

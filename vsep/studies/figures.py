"""From rows to the panels of a study's figure: which metric over which parameter."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from vsep.studies.axes import X_LABELS, x_value
from vsep.studies.catalogue import CATALOGUE
from vsep.studies.distributions import box_panels, quantile_panels
from vsep.studies.groups import groups
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.panels import AnyPanel, Panel, Series, reference
from vsep.studies.plans import PLANS, Plan
from vsep.studies.summary import Measure, summarise
from vsep.studies.trial import Row

_CALIBRATED = {"fig-3": "3b", "fig-5": "5d-f"}
_BOX_LEVELS = ((60.0, 15.0), (60.0, -15.0))


def study_panels(rows: Iterable[Row]) -> list[AnyPanel]:
    """Return the panels of all studies that have rows, in the order of the catalogue.

    Parameters
    ----------
    rows : iterable of dict
        Of one or several studies; examples (figures 2, 4, 6) have no statistics and no panels
        here, see `vsep.studies.example`.

    Returns
    -------
    list
        Panels that have nothing to show are left out.
    """
    by_study: dict[str, list[Row]] = {}
    for row in rows:
        by_study.setdefault(row["study"], []).append(row)
    panels: list[AnyPanel] = []
    for name in CATALOGUE:
        if name in by_study and not CATALOGUE[name].example:
            panels += _panels_of(name, by_study[name])
    return panels


def _panels_of(name: str, rows: list[Row]) -> list[AnyPanel]:
    plans = PLANS[name]
    metrics = dict.fromkeys(plan.metric for plan in plans)
    if any(plan.with_bound for plan in plans):
        metrics["root_crlb"] = None
    measures = summarise(rows, metrics)
    panels: list[AnyPanel] = [_curve_panel(plan, measures) for plan in plans]
    panels = [panel for panel in panels if isinstance(panel, Panel) and panel.series]
    grouped = groups(rows)
    if name == "fig-5":
        panels += [box for level in _BOX_LEVELS for box in box_panels(grouped, *level)]
    if name in _CALIBRATED:
        panels += quantile_panels(grouped, _CALIBRATED[name])
    return panels


def _curve_panel(plan: Plan, measures: Sequence[Measure]) -> Panel:
    chosen = [
        m
        for m in measures
        if m.point["panel"] == plan.panel
        and m.metric == plan.metric
        and (plan.methods is None or m.method in plan.methods)
    ]
    # The reference first, so that the others are drawn over it.
    methods = sorted(
        dict.fromkeys(measure.method for measure in chosen),
        key=lambda method: method != NO_INTERFERENCE,
    )
    series = []
    for number, variant in enumerate(_variants(chosen, plan.variant)):
        for method in methods[:1] if plan.of_scene else methods:
            own = [
                measure
                for measure in chosen
                if measure.method == method
                and (plan.variant is None or measure.point[plan.variant] == variant)
            ]
            role = "scene" if plan.of_scene else method
            label = ", ".join(text for text in (role, _variant_text(plan.variant, variant)) if text)
            series.append(_curve(own, plan.x, label=label, role=role, variant=number))
    if plan.with_bound and chosen:
        series.append(_bound(plan, measures))
    series += [_guide(label, value, series) for label, value in plan.guides if series]
    return Panel(
        title=plan.title,
        x_label=X_LABELS[plan.x],
        y_label=plan.y_label,
        series=tuple(series),
        note=_note(chosen),
        log_x=plan.log_x,
        log_y=plan.log_y,
    )


def _variants(measures: Sequence[Measure], name: str | None) -> list[Any]:
    if name is None:
        return [None]
    found = {measure.point[name] for measure in measures}
    return sorted(found, key=lambda value: (value is None, value))


def _variant_text(name: str | None, value: Any) -> str:
    if name == "butterworth_order":
        return f"order {value}"
    if name == "interferer_slope_hz_per_s":
        return f"slope {value / 1e12:g} MHz/µs"
    return ""


def _curve(measures: Sequence[Measure], x: str, *, label: str, role: str, variant: int) -> Series:
    ordered = sorted(measures, key=lambda measure: x_value(measure.point, x))
    intervals = [measure.interval for measure in ordered]
    return Series(
        label=label,
        role=role,
        kind="curve",
        variant=variant,
        x=np.array([x_value(measure.point, x) for measure in ordered]),
        y=np.array([interval.value for interval in intervals]),
        low=np.array([interval.low for interval in intervals]),
        high=np.array([interval.high for interval in intervals]),
    )


def _bound(plan: Plan, measures: Sequence[Measure]) -> Series:
    """Root CRLB over the panel's axis; it is the same for all methods."""
    values = {
        x_value(measure.point, plan.x): measure.interval.value
        for measure in measures
        if measure.metric == "root_crlb" and measure.point["panel"] == plan.panel
    }
    x = np.array(sorted(values))
    return reference("root CRLB", "bound", x, np.array([values[key] for key in x.tolist()]))


def _guide(label: str, value: float, series: Sequence[Series]) -> Series:
    ends = np.concatenate([one.x for one in series])
    x = np.array([ends.min(), ends.max()])
    return reference(label, "guide", x, np.full(2, value))


def _note(measures: Sequence[Measure]) -> str:
    """Say how the intervals were made and of how many realisations."""
    intervals = [m.interval for m in measures if m.interval.method != "none"]
    if not intervals:
        return "too few realizations for intervals"
    methods = ", ".join(dict.fromkeys(interval.method for interval in intervals))
    counts = [interval.num_samples for interval in intervals]
    span = f"{min(counts)}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
    return f"{100 * intervals[0].level:g} % intervals ({methods}), {span} realizations a point"

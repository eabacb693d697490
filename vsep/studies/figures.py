"""Panels of the studies' figures, made of their rows."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from vsep.studies.axes import x_label, x_value
from vsep.studies.catalogue import CATALOGUE
from vsep.studies.distributions import box_panels, quantile_panels
from vsep.studies.groups import groups
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.panel_specs import BoxSpec, PanelSpec, QuantileSpec
from vsep.studies.panels import AnyPanel, FigurePanel, Series, reference
from vsep.studies.study import Study
from vsep.studies.summary import Measure, summarise
from vsep.studies.trial import Row


def study_panels(rows: Iterable[Row], *own: Study) -> list[AnyPanel]:
    """Return the panels of all studies that have rows, in the order of the catalogue.

    Parameters
    ----------
    rows : iterable of dict
        Of one or several studies; examples (figures 2, 4, 6) have no statistics and no panels
        here, see `vsep.studies.example`.
    *own : Study
        Studies that are not in the catalogue.

    Returns
    -------
    list
        Panels that have nothing to show are left out.
    """
    by_study: dict[str, list[Row]] = {}
    for row in rows:
        by_study.setdefault(row["study"], []).append(row)
    studies = CATALOGUE | {study.name: study for study in own}
    return [
        panel
        for name, study in studies.items()
        if name in by_study and not study.example
        for panel in _panels_of(study, by_study[name])
    ]


def _panels_of(study: Study, rows: list[Row]) -> list[AnyPanel]:
    metrics = dict.fromkeys(spec.metric for spec in study.curves)
    if any(spec.with_bound for spec in study.curves):
        metrics["root_crlb"] = None
    measures, grouped = summarise(rows, metrics), groups(rows)
    panels: list[AnyPanel] = []
    for spec in study.panels:
        if isinstance(spec, BoxSpec):
            panels += box_panels(grouped, spec)
        elif isinstance(spec, QuantileSpec):
            panels += quantile_panels(grouped, spec)
        elif (panel := _curve_panel(spec, measures)).series:
            panels.append(panel)
    return panels


def _curve_panel(spec: PanelSpec, measures: Sequence[Measure]) -> FigurePanel:
    chosen = [
        m
        for m in measures
        if m.point["panel"] == spec.panel
        and m.metric == spec.metric
        and (spec.methods is None or m.method in spec.methods)
    ]
    # The reference first, so that the others are drawn over it.
    methods = sorted(
        dict.fromkeys(measure.method for measure in chosen),
        key=lambda method: method != NO_INTERFERENCE,
    )
    series = []
    for number, variant in enumerate(_variants(chosen, spec.variant)):
        for method in methods[:1] if spec.of_scene else methods:
            own = [
                measure
                for measure in chosen
                if measure.method == method
                and (spec.variant is None or measure.point[spec.variant] == variant)
            ]
            role = "scene" if spec.of_scene else method
            label = ", ".join(text for text in (role, _variant_text(spec.variant, variant)) if text)
            series.append(_curve(own, spec.x, label=label, role=role, variant=number))
    if spec.with_bound and chosen:
        series.append(_bound(spec, measures))
    series += [_guide(label, value, series) for label, value in spec.guides if series]
    return FigurePanel(
        title=spec.title,
        x_label=spec.x_label or x_label(spec.x),
        y_label=spec.y_label,
        series=tuple(series),
        note=_note(chosen),
        log_x=spec.log_x,
        log_y=spec.log_y,
    )


def _variants(measures: Sequence[Measure], name: str | None) -> list[Any]:
    if name is None:
        return [None]
    found = {measure.point[name] for measure in measures}
    return sorted(found, key=lambda value: (value is None, value))


def _variant_text(name: str | None, value: Any) -> str:
    if name == "butterworth_order":
        return f"order {value}"
    if name in ("prior", "prior_source", "threshold", "domain", "mask"):
        return f"{name.replace('_', ' ')} {value}"
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


def _bound(spec: PanelSpec, measures: Sequence[Measure]) -> Series:
    """Root CRLB over the panel's axis; it is the same for all methods."""
    values = {
        x_value(measure.point, spec.x): measure.interval.value
        for measure in measures
        if measure.metric == "root_crlb" and measure.point["panel"] == spec.panel
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

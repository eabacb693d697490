"""Rows sorted by point and method, each beside its reference, and values of single frames.

Over single objects "detected" means an error below half a resolution cell, and "exact" that the
number of objects was right, the paper's condition (Sec. IV-A).
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from vsep._typing import FloatArray
from vsep.studies.methods import MASKED, NO_INTERFERENCE
from vsep.studies.trial import DONE, Row

GroupKey: TypeAlias = tuple[str, int, str]

DETECTION_CELLS = 0.5


@dataclass(frozen=True, kw_only=True, slots=True)
class Group:
    """Rows of one method at one point, and of two others on the same realisations."""

    rows: tuple[Row, ...]  #: finished rows, by realisation
    #: the reference's row of the same realisation, where there is one
    references: tuple[Row | None, ...]
    masked: tuple[Row | None, ...]  #: the same of the masked estimator
    num_failed: int  #: rows without results

    def column(self, name: str) -> FloatArray:
        """(n,) one number a row; NaN where there is none."""
        return np.array([number(row.get(name)) for row in self.rows], dtype=np.float64)

    def reference_column(self, name: str) -> FloatArray:
        """(n,) the same of the reference."""
        return _column(self.references, name)

    def masked_column(self, name: str) -> FloatArray:
        """(n,) the same of the masked estimator."""
        return _column(self.masked, name)


def _column(rows: Sequence[Row | None], name: str) -> FloatArray:
    values = [number(row.get(name)) if row else np.nan for row in rows]
    return np.array(values, dtype=np.float64)


def number(value: Any) -> float:
    """Return a number of a row, which writes NaN as null."""
    return float("nan") if value is None else float(value)


def groups(rows: Iterable[Row]) -> dict[GroupKey, Group]:
    """Sort rows by study, point and method, each beside the reference and the masked estimator.

    Returns
    -------
    dict
        ``(study, point_index, method)`` to `Group`, in ascending order of study and point.
    """
    sorted_rows: dict[GroupKey, dict[int, Row]] = defaultdict(dict)
    for row in rows:
        sorted_rows[row["study"], row["point_index"], row["method"]][row["realization"]] = row
    found = {}
    for study, index, method in sorted(sorted_rows, key=lambda key: key[:2]):
        own = sorted_rows[study, index, method]
        done = [row for _, row in sorted(own.items()) if row["status"] == DONE]
        references = sorted_rows.get((study, index, NO_INTERFERENCE), {})
        masked = sorted_rows.get((study, index, MASKED), {})
        found[study, index, method] = Group(
            rows=tuple(done),
            references=_partners(done, references),
            masked=_partners(done, masked),
            num_failed=len(own) - len(done),
        )
    return found


def _partners(rows: Sequence[Row], others: Mapping[int, Row]) -> tuple[Row | None, ...]:
    """Return the finished rows of another method on the same realisations."""
    found = (others.get(row["realization"]) for row in rows)
    return tuple(row if row and row["status"] == DONE else None for row in found)


def single_object_errors(rows: Sequence[Row | None], *, exact: bool = False) -> FloatArray:
    """Signed beat errors of single objects that were detected, NaN where they were not.

    `rows`: frames of one object; `exact`: count only frames with the right number of objects, as
    the paper does. Returns (n,).
    """
    return np.array([_single_object_error(row, exact) for row in rows], dtype=np.float64)


def _single_object_error(row: Row | None, exact: bool) -> float:
    if row is None or row["num_objects_true"] != 1 or not row["beat_errors"]:
        return float("nan")
    if exact and row["num_objects"] != 1:
        return float("nan")
    error = row["beat_errors"][0]
    cells = abs(error) * row["num_samples"]
    if row["num_ramps"] > 1:
        cells = float(np.hypot(cells, row["doppler_errors"][0] * row["num_ramps"]))
    return error if cells < DETECTION_CELLS else float("nan")


def standardised_errors(row: Row) -> FloatArray:
    """Return errors over their own reported standard deviation, beats first, then Dopplers."""
    errors = [*row["beat_errors"], *row.get("doppler_errors", [])]
    stds = [*row["beat_stds"], *row.get("doppler_stds", [])]
    with np.errstate(divide="ignore", invalid="ignore"):  # of a deviation of zero
        ratio = np.array([number(e) for e in errors]) / np.array([number(s) for s in stds])
    return np.asarray(ratio[np.isfinite(ratio)], dtype=np.float64)


def mean_assigned_errors(group: Group) -> FloatArray:
    """(n,) mean distance of the assigned pairs of every frame, normalised frequency."""
    means = [float(np.mean(row["errors"])) if row["errors"] else np.nan for row in group.rows]
    return np.array(means, dtype=np.float64)

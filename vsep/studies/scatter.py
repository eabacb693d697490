"""Single realisations beside the averages: one value a trial, with the way back to the trial.

An average hides its outliers; here each is a dot whose row can be run again and watched.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_choice
from vsep.studies.axes import x_value
from vsep.studies.groups import number
from vsep.studies.trial import DONE, Row


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scatter:
    """One dot a row."""

    x: FloatArray  #: (n,) the point's parameter
    y: FloatArray  #: (n,) the frame's own value
    rows: tuple[Row, ...]  #: the rows themselves, see `vsep.studies.rows.trial_of_row`


def _mean_error(row: Row) -> float:
    return float(np.mean(row["errors"])) if row["errors"] else float("nan")


FRAME_VALUES: dict[str, Callable[[Row], float]] = {
    "mean assigned error [cycles]": _mean_error,
    "misses": lambda row: number(row["misses"]),
    "false alarms": lambda row: number(row["false_alarms"]),
    "iterations": lambda row: number(row["iterations"]),
    "seconds": lambda row: number(row["seconds"]),
}


def scatter(rows: Iterable[Row], value: str, *, panel: str, method: str, x: str) -> Scatter:
    """Return the values of all finished trials of one panel and method.

    Parameters
    ----------
    rows : iterable of dict
        Of a study.
    value : str
        One of `FRAME_VALUES`.
    panel, method : str
        Whose rows.
    x : str
        The parameter of the point to plot over, for example "sir_db".

    Returns
    -------
    Scatter
        Without frames that have no such value.

    Raises
    ------
    InputError
        If the value is unknown.
    """
    require_choice("value", value, FRAME_VALUES)
    chosen = [
        row
        for row in rows
        if row["status"] == DONE and row["method"] == method and row["point"]["panel"] == panel
    ]
    heights = [FRAME_VALUES[value](row) for row in chosen]
    shown = [index for index, height in enumerate(heights) if np.isfinite(height)]
    return Scatter(
        x=np.array([x_value(chosen[index]["point"], x) for index in shown], dtype=np.float64),
        y=np.array([heights[index] for index in shown], dtype=np.float64),
        rows=tuple(chosen[index] for index in shown),
    )

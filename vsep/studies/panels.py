"""The panels of a figure as numbers: curves with intervals, lines, marks and boxes.

Whoever draws them decides on colours and sizes and computes nothing.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from vsep._typing import FloatArray

SeriesKind: TypeAlias = Literal["curve", "line", "dashed", "stems", "crosses"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Series:
    """One curve, line or set of marks."""

    label: str  #: for the legend
    #: what it stands for, a method's name for example; the same role has the same colour in all
    #: panels
    role: str
    #: "curve" has a marker at every point and an interval; "dashed" is a reference; "stems" and
    #: "crosses" mark single positions
    kind: SeriesKind
    #: (n,) ascending in x, but for marks
    x: FloatArray
    y: FloatArray
    #: (n,) ends of the intervals, NaN where there is none; the foot of a stem is its low end
    low: FloatArray
    high: FloatArray
    variant: int = 0  #: series of one role in one panel are told apart by this number


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class FigurePanel:
    """Axes with their series; `note` says how intervals were made."""

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    note: str = ""
    log_x: bool = False
    log_y: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class Box:
    """Distribution over the realisations: quartiles, whiskers at 1.5 times their distance."""

    role: str  #: the method
    #: lower whisker, quartiles, upper whisker
    low: float
    first: float
    middle: float
    third: float
    high: float
    outliers: tuple[float, ...]  #: values beyond the whiskers


@dataclass(frozen=True, kw_only=True, slots=True)
class BoxPanel:
    """Boxes side by side."""

    title: str
    y_label: str
    boxes: tuple[Box, ...]
    note: str = ""
    log_y: bool = False


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ImagePanel:
    """A picture of levels over two axes, with marks."""

    title: str
    x_label: str
    y_label: str
    #: (M,) and (K,) ascending, evenly spaced
    x: FloatArray
    y: FloatArray
    levels_db: FloatArray  #: (K, M)
    series: tuple[Series, ...] = ()
    note: str = ""
    log_y: bool = False


AnyPanel: TypeAlias = FigurePanel | BoxPanel | ImagePanel


def reference(label: str, role: str, x: FloatArray, y: FloatArray) -> Series:
    """Return a dashed line without intervals."""
    none = np.full(len(x), np.nan)
    return Series(label=label, role=role, kind="dashed", x=x, y=y, low=none, high=none)

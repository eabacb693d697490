"""Questions of an experiment: some outcomes to choose from, or a number with a tolerance.

A choice is judged by the score of the run, a number by the truth of the scene of its seed; nobody
writes a solution down.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from vsep.errors import InputError, shown
from vsep_app.model.static_picture import StaticPicture

_KEYS = ("text", "quantity", "tolerance")
LARGEST = 1e6
"""Of a number that is answered, by its magnitude."""


class Quantity(NamedTuple):
    """A number that the truth of a scene tells."""

    unit: str
    of: Callable[[StaticPicture], float]


def _range_of(pick: Callable[[StaticPicture], int]) -> Callable[[StaticPicture], float]:
    return lambda scene: float(scene.true_objects.ranges_m[pick(scene)])


QUANTITIES: Final[Mapping[str, Quantity]] = {
    "objects": Quantity("", lambda scene: float(len(scene.true_objects.ranges_m))),
    "bursts": Quantity("", lambda scene: float(np.count_nonzero(scene.true_ramps))),
    "nearest": Quantity("m", _range_of(lambda s: int(np.argmin(np.abs(s.true_objects.ranges_m))))),
    "strongest": Quantity("m", _range_of(lambda s: int(np.argmax(s.true_objects.snr_db)))),
    "fastest": Quantity(
        "m/s", lambda scene: float(np.abs(scene.true_objects.velocities_mps).max())
    ),
}
"""What can be asked for: counts of objects and of ramps with a burst, ranges, the largest speed."""


@dataclass(frozen=True, kw_only=True)
class Question:
    """A question to which the answer is a number."""

    text: str
    quantity: str  #: A key of `QUANTITIES`.
    tolerance: float = 0.0  #: So far from the truth an answer is right.

    @property
    def unit(self) -> str:
        """The unit of an answer; empty for a count."""
        return QUANTITIES[self.quantity].unit

    def truth(self, scene: StaticPicture) -> float | None:
        """Return the true number; None for a scene without truth."""
        if not scene.true_objects.ranges_m.size:
            return None
        return QUANTITIES[self.quantity].of(scene)

    def is_right(self, answer: float, scene: StaticPicture) -> bool | None:
        """Whether an answer is right for a scene; None where nobody knows."""
        truth = self.truth(scene)
        return None if truth is None else abs(answer - truth) <= self.tolerance


def read_question(content: Any) -> Question:
    """Return the question of the table ``ask`` of an experiment.

    Raises `InputError` where a value is not what it must be.

    Examples
    --------
    >>> read_question({"text": "How many objects?", "quantity": "objects"}).tolerance
    0.0
    """
    if not isinstance(content, Mapping):
        raise InputError("its ask is no table; write it below a line [ask].")
    unknown = [key for key in content if key not in _KEYS]
    if unknown:
        raise InputError(f"its ask has {shown(unknown[0])}; it may have {', '.join(_KEYS)}.")
    text, quantity = content.get("text"), content.get("quantity")
    if not isinstance(text, str) or not text.strip():
        raise InputError("its ask has no text.")
    if not isinstance(quantity, str) or quantity not in QUANTITIES:
        raise InputError(
            f"its ask is for {shown(quantity)}; it must be for one of {', '.join(QUANTITIES)}."
        )
    tolerance = content.get("tolerance", 0.0)
    is_number = isinstance(tolerance, int | float) and not isinstance(tolerance, bool)
    if not is_number or not 0.0 <= tolerance <= LARGEST:
        raise InputError(
            f"tolerance of its ask is {shown(tolerance)}; it must be a number between 0 and "
            f"{LARGEST:g}."
        )
    return Question(text=text.strip(), quantity=quantity, tolerance=float(tolerance))


def number_of(text: str) -> float | None:
    """Return the number that somebody has typed, with a comma or a point; None if it is none.

    Examples
    --------
    >>> number_of("14,4"), number_of("far"), number_of("1e400")
    (14.4, None, None)
    """
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError:
        return None
    return value if math.isfinite(value) and abs(value) <= LARGEST else None

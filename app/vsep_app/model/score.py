"""Assignment of estimates to true objects, that of GOSPA, and the score."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vsep._typing import BoolArray, IntArray
from vsep.analysis.gospa import cell_distances, gospa
from vsep.inference.core.state import ObjectComponents
from vsep_app.model.static_picture import StaticPicture


@dataclass(frozen=True, kw_only=True, eq=False)
class Score:
    """Which true objects are found, and which estimates are false.

    A pair lies within one resolution cell.
    """

    found: BoolArray  #: (K,) bool: Whether an estimate has a true object.
    missed: IntArray  #: (J,) int: True objects without an estimate.
    #: (J,) int: Their nearest estimates, which are another's or too far; -1 where there is none.
    nearest: IntArray
    num_true: int
    partners: Mapping[int, int]  #: From estimate to true object.

    @property
    def num_found(self) -> int:
        """True objects that have an estimate."""
        return len(self.partners)

    @property
    def num_false(self) -> int:
        """Estimates without a true object."""
        return len(self.found) - self.num_found

    @property
    def text(self) -> str:
        """The score in a few words."""
        return f"{self.num_found} of {self.num_true} found, {self.num_false} false"


def score_of(static_picture: StaticPicture, objects: ObjectComponents) -> Score | None:
    """Return the score of estimates, None where the true objects are not known."""
    truth = static_picture.observation.truth
    if truth is None or not truth.beats.size:
        return None
    true = np.stack([truth.beats, truth.dopplers], axis=-1)
    found = np.stack([objects.beats, objects.dopplers], axis=-1)
    distances = cell_distances(true, found, static_picture.radar.shape)
    pairs = gospa(distances)
    missed = np.setdiff1d(np.arange(len(true)), pairs.true_indices)
    nearest = np.full(len(missed), -1) if not len(found) else distances[missed].argmin(axis=1)
    return Score(
        found=np.isin(np.arange(len(found)), pairs.found_indices),
        missed=missed,
        nearest=nearest,
        num_true=len(true),
        partners=dict(zip(pairs.found_indices.tolist(), pairs.true_indices.tolist(), strict=True)),
    )

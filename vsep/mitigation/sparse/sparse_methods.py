"""The compressive-sensing methods by name, each with the settings that make it work.

The thresholds are those that do best on Simulation II; see assets/docs/mitigation.md.
"""

from vsep.mitigation.sparse.filling import SparseMitigation
from vsep.mitigation.sparse.fista import Fista
from vsep.mitigation.sparse.greedy import Cosamp, Omp
from vsep.mitigation.sparse.message_passing import Amp, Gamp
from vsep.mitigation.sparse.operators import Domain
from vsep.mitigation.sparse.prior import PriorModel, SeenFrame
from vsep.mitigation.sparse.thresholding import IterativeThresholding
from vsep.mitigation.sparse.yall1 import Yall1

_SOFT_CONTROL = 2.5
_HARD_CONTROL = 3.5
_DECAY = 0.8
SOFT_PRIOR = PriorModel()
HARD_PRIOR = PriorModel(largest=0.3)

History = tuple[SeenFrame, ...]


def ist(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Threshold softly, (11)-(13)."""
    return pm_ist(domain, debias=debias, name="ist")


def iht(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Threshold hard, with the schedule."""
    return pm_iht(domain, debias=debias, name="iht")


def iht_plain(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Threshold hard by (12) alone, for comparison: it fails."""
    solver = IterativeThresholding(shrinkage="hard", control=_HARD_CONTROL)
    return SparseMitigation(name="iht-plain", solver=solver, domain=domain, debias=debias)


def pm_ist(
    domain: Domain = "masked-2d",
    *,
    debias: bool = False,
    history: History = (),
    prior: PriorModel = SOFT_PRIOR,
    name: str = "pm-ist",
) -> SparseMitigation:
    """Threshold softly, with a prior from past frames; without any it is `ist`."""
    solver = IterativeThresholding(
        shrinkage="soft", control=_SOFT_CONTROL, relief=prior.relief(history)
    )
    return SparseMitigation(name=name, solver=solver, domain=domain, debias=debias)


def pm_iht(
    domain: Domain = "masked-2d",
    *,
    debias: bool = False,
    history: History = (),
    prior: PriorModel = HARD_PRIOR,
    name: str = "pm-iht",
) -> SparseMitigation:
    """Threshold hard, with schedule and a prior from past frames; without any it is `iht`."""
    solver = IterativeThresholding(
        shrinkage="hard", control=_HARD_CONTROL, decay=_DECAY, relief=prior.relief(history)
    )
    return SparseMitigation(name=name, solver=solver, domain=domain, debias=debias)


def fista(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Threshold softly, with momentum."""
    return SparseMitigation(
        name="fista", solver=Fista(control=_SOFT_CONTROL), domain=domain, debias=debias
    )


def omp(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Add one cell after the other: orthogonal matching pursuit."""
    solver = Omp()
    return SparseMitigation(
        name="omp", solver=solver, domain=domain, debias=debias, max_iterations=solver.max_cells + 1
    )


def cosamp(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Exchange many cells at once: compressive sampling matching pursuit."""
    return SparseMitigation(name="cosamp", solver=Cosamp(), domain=domain, debias=debias)


def amp(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Pass approximate messages, with a soft threshold."""
    return SparseMitigation(
        name="amp", solver=Amp(control=_SOFT_CONTROL), domain=domain, debias=debias
    )


def gamp(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Pass generalised approximate messages, with a Bernoulli-Gaussian prior."""
    return SparseMitigation(name="gamp", solver=Gamp(), domain=domain, debias=debias)


def yall1(domain: Domain = "masked-2d", *, debias: bool = False) -> SparseMitigation:
    """Alternate directions on the dual of the l1 problem."""
    return SparseMitigation(
        name="yall1", solver=Yall1(control=_SOFT_CONTROL), domain=domain, debias=debias
    )

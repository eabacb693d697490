"""Schedules of the updates: the letter of Algorithms 1 to 4 and the robust default."""

from dataclasses import dataclass, replace
from typing import Final

from vsep.errors import InputError, shown
from vsep.signal.template import SignalModel
from vsep.units import from_db

EVERY_WEIGHING = 6  # iterations in which the samples are weighed anew each time, then with searches
LAST_WEIGHING = 24  # iterations after the first


@dataclass(frozen=True, kw_only=True, slots=True)
class Schedule:
    """Order and limits of the updates.

    Parameters
    ----------
    name : str
        What a user selects it by.
    interference_threshold_db : float
        Default of T_beta.
    first_threshold_db : float or None
        Threshold of a ramp's first channel component; the best chirp fitted to pure noise scores
        about 10 dB. None applies T_beta to the first as well and keeps a template in every ramp.
    prune_margin_db : float
        By how much a channel component may fall below its threshold before it is pruned; without
        a margin components close to the threshold come and go for ever.
    bursts_per_ramp : int
        Bursts modelled in a ramp at most.
    early_burst_range_db, burst_range_db : float
        By how much a further burst of a ramp may be weaker than its strongest, up to the last early
        search and after it: what the fit of a burst has not reached yet looks like more bursts.
    channel_additions : int
        Channel components added per ramp and iteration at most.
    late_object_additions : int
        Object components added per iteration at most once `weigh_from` is reached; before, one: an
        object too many is hard to tell from a burst that is not modelled yet.
    early_search : tuple of int
        Iterations in which every ramp is searched for a single chirp; what disagrees with the
        search is dropped or restarted.
    beside_bursts : tuple of int
        Those of them that look for further bursts of the ramps which hold one.
    late_search_period : int or None
        After the last of these, every so many iterations; None never again.
    search_before_convergence : bool
        Whether a run may only end after a search that found nothing new.
    recompute_amplitudes : bool
        Whether beta is recomputed after the last refinement of theta in Algorithm 2; otherwise the
        residual of the objects and lambda have the new theta and the beta of the one before.
    joint_object_step : bool
        Whether a step of all objects together ends Algorithm 3.
    objects_nearby : bool
        Whether the objects are next to where they are from the first iteration on: then all are
        fitted together, and Algorithm 3 follows only where one is new.
    refinement_steps : int
        Newton steps of theta per call.
    least_gain : float
        Nats of log evidence that such a step must promise to be tried.
    correct_filter : tuple of two int, or None
        First and last iteration (from 0) in which the correction of the assumed filter is
        estimated; afterwards it stands still, because it and the channels trade slowly what makes
        no difference to the fit. None never.
    correct_early : int or None
        Iteration (from 0) from which the correction may begin before that, where every interfered
        ramp asks for it: errors of a wrong filter look like objects from the first one on, but
        with channels that are not complete a right filter looks wrong. None not at all.
    weigh_from : int or None
        Iteration (from 0) from which samples that the sources explain badly count less; earlier it
        would be bursts that are not modelled yet. None never.
    noise_spectrum : bool
        Whether noise is estimated over beat frequency; the paper's is white.
    noise_from : int
        Iteration (from 0) from which it is.
    ends_when_calm : bool
        Whether a run whose samples are weighed ends as well when some iterations in a row changed
        next to nothing; otherwise only when one changed nothing that matters.
    smears_from : int
        Iteration (from 0) from which objects that share a resolution cell count as one smear, in
        which each may move on, when it is decided whether an iteration was calm ...
    smear_cells : float
        ... and the size of that cell, in resolution cells.
    merges_objects : bool
        Whether objects that their neighbours explain are given up.
    refines_growing : bool
        Whether theta is refined after Algorithm 4 only where that has added components to many
        bursts; otherwise always.
    """

    name: str
    interference_threshold_db: float
    first_threshold_db: float | None
    prune_margin_db: float
    bursts_per_ramp: int
    early_burst_range_db: float
    burst_range_db: float
    channel_additions: int
    late_object_additions: int
    early_search: tuple[int, ...]
    late_search_period: int | None
    search_before_convergence: bool
    recompute_amplitudes: bool
    joint_object_step: bool
    objects_nearby: bool = False
    refinement_steps: int = 1
    least_gain: float = 1e-4
    correct_filter: tuple[int, int] | None = None
    correct_early: int | None = None
    weigh_from: int | None = None
    noise_spectrum: bool = False
    noise_from: int = 0
    ends_when_calm: bool = False
    smears_from: int = 20
    smear_cells: float = 1.0
    merges_objects: bool = False
    refines_growing: bool = False
    beside_bursts: tuple[int, ...] = ()

    def object_additions(self, iteration: int) -> int:
        """Object components that may be added in this iteration (counted from 0)."""
        return self.late_object_additions if self.weights_begun(iteration) else 1

    def weakest_burst_share(self, iteration: int) -> float:
        """Share of a ramp's strongest burst that a further one must have (counted from 0)."""
        late = self.search_is_late(iteration)
        return float(from_db(-(self.burst_range_db if late else self.early_burst_range_db)))

    def search_is_late(self, iteration: int) -> bool:
        """Whether the early searches are over in this iteration (counted from 0)."""
        return iteration > self.early_search[-1]

    def weights_begun(self, iteration: int) -> bool:
        """Whether samples that are explained badly count less (iterations counted from 0)."""
        return self.weigh_from is not None and iteration >= self.weigh_from

    def weights_due(self, iteration: int) -> bool:
        """Whether the samples are weighed anew in this iteration (counted from 0).

        Every iteration at first; a run cannot settle while samples come and go.
        """
        if self.weigh_from is None:
            return False
        since = iteration - self.weigh_from
        return 0 <= since < EVERY_WEIGHING or (
            0 <= since <= LAST_WEIGHING and self.search_due(iteration)
        )

    def correction_due(self, iteration: int) -> bool:
        """Whether the assumed filter is corrected in this iteration (counted from 0)."""
        if self.correct_filter is None:
            return False
        first, last = self.correct_filter
        return self.correction_is_early(iteration) or first <= iteration <= last

    def correction_is_early(self, iteration: int) -> bool:
        """Whether every interfered ramp must ask for a correction (iterations counted from 0)."""
        if self.correct_filter is None or self.correct_early is None:
            return False
        return self.correct_early <= iteration < self.correct_filter[0]

    def noise_due(self, iteration: int) -> bool:
        """Whether noise over beat frequency may be estimated in this iteration (from 0)."""
        return self.noise_spectrum and iteration >= self.noise_from

    def search_due(self, iteration: int) -> bool:
        """Whether the ramps are searched for bursts in this iteration (counted from 0)."""
        if iteration <= self.early_search[-1] or self.late_search_period is None:
            return iteration in self.early_search
        return iteration % self.late_search_period == 0


ROBUST: Final = Schedule(
    name="robust",
    interference_threshold_db=6.0,
    first_threshold_db=13.0,
    prune_margin_db=1.0,
    bursts_per_ramp=16,
    early_burst_range_db=30.0,
    burst_range_db=40.0,
    channel_additions=4,
    late_object_additions=16,
    early_search=(0, 2, 4, 6, 8, 10, 12),
    late_search_period=4,
    search_before_convergence=True,
    recompute_amplitudes=True,
    joint_object_step=True,
    least_gain=1e-2,
    correct_filter=(4, 14),
    correct_early=2,
    weigh_from=6,
    noise_spectrum=True,
    ends_when_calm=True,
    merges_objects=True,
)

# A measured response errs by some hundredths of a burst, which is many nats: bursts fitted as well
# as that are not moved for hundredths of a nat, and not looked for in every other iteration; nor is
# an object told by so little from its neighbours. Clutter that is kept is a hundred lines at one
# Doppler frequency: many are added at a time, and those within two cells are one smear.
MEASURED: Final = replace(
    ROBUST,
    early_search=(0, 2, 4, 12),
    least_gain=0.3,
    late_object_additions=32,
    smears_from=14,
    smear_cells=2.0,
    refines_growing=True,
    merges_objects=False,
)

# Where ramps are long, searches cost more than all the rest. Those that remain find the bursts
# beside the first ones, what is left before samples are weighed, and what their weights hid.
LONG_RAMPS: Final = replace(
    ROBUST, early_search=(0, 2, 6, 12), beside_bursts=(2,), late_object_additions=64
)
LONG: Final = 512  # samples

PAPER: Final = Schedule(
    name="paper",
    interference_threshold_db=3.0,
    first_threshold_db=None,
    prune_margin_db=0.0,
    bursts_per_ramp=1,
    early_burst_range_db=0.0,
    burst_range_db=0.0,
    channel_additions=1,
    late_object_additions=1,
    early_search=(0,),
    late_search_period=None,
    search_before_convergence=False,
    recompute_amplitudes=False,
    joint_object_step=False,
)

SCHEDULES: Final = {schedule.name: schedule for schedule in (ROBUST, PAPER)}


def schedule_by_name(name: str | Schedule) -> Schedule:
    """Return the schedule called `name`; a record of your own is returned as it is.

    Raises
    ------
    InputError
        If there is none.

    Examples
    --------
    >>> from dataclasses import replace
    >>> schedule_by_name(replace(PAPER, refinement_steps=20)).refinement_steps
    20
    """
    if isinstance(name, Schedule):
        return name
    if name not in SCHEDULES:
        raise InputError(f"schedule is {shown(name)}; it must be one of {', '.join(SCHEDULES)}.")
    return SCHEDULES[name]


def schedule_for(name: str | Schedule, model: SignalModel) -> Schedule:
    """Return the schedule called `name` for the frames of a model.

    The robust one spares a measured response what that is not accurate enough for, and long ramps
    every second early search.
    """
    schedule = schedule_by_name(name)
    if schedule is not ROBUST:
        return schedule
    if model.anti_aliasing_filter.smooth is not None:
        return MEASURED
    return LONG_RAMPS if model.num_samples >= LONG else schedule

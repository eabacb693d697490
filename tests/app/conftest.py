"""Fixtures of the application's tests: finished runs, and the served dashboard."""

from typing import NamedTuple

import pytest

from app.session import Phase, Snapshot
from app.settings import Settings
from app.work import Prepared, advance, prepare
from vsep.inference.state import Step, Termination
from vsep.studies.catalogue import make_study
from vsep.studies.trial import Row, run_trial


class FinishedRun(NamedTuple):
    """A prepared run and all its steps."""

    prepared: Prepared
    steps: tuple[Step, ...]

    def snapshot(self, num_steps: int | None = None) -> Snapshot[Prepared, Step]:
        """Return what a view would get after some of the steps."""
        shown = self.steps if num_steps is None else self.steps[:num_steps]
        return Snapshot(
            run_number=1,
            opening=self.prepared,
            steps=shown,
            num_steps=len(self.steps),
            phase=Phase.FINISHED,
        )


def finish(preset: str, **changes: object) -> FinishedRun:
    """Run a preset to its end."""
    settings = Settings()
    settings.choose_preset(preset)
    settings.param.update(**changes)
    prepared = prepare(settings.plan())
    steps = [advance(prepared, prepared.initial_state)]
    while steps[-1].termination is Termination.RUNNING:
        steps.append(advance(prepared, steps[-1].state))
    return FinishedRun(prepared, tuple(steps))


@pytest.fixture(scope="session")
def one_ramp() -> FinishedRun:
    """Simulation I to its end."""
    return finish("simulation-1")


@pytest.fixture(scope="session")
def many_ramps() -> FinishedRun:
    """Simulation II b to its end."""
    return finish("simulation-2-b")


@pytest.fixture(scope="session")
def study_rows() -> list[Row]:
    """Three realisations of two points of Fig. 3a, by two methods."""
    study = make_study("fig-3", methods=("object-only", "no-interference"), selection="6,9")
    trials = [study.trial(index, r) for r in range(3) for index in study.point_indices]
    return [row for trial in trials for row in run_trial(trial)]

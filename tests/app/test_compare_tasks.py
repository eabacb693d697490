"""A comparison as plain data: methods advance together, frames hand their prior on."""

import numpy as np
import pytest
from vsep_app.jobs.run_session import Phase, Snapshot
from vsep_app.jobs.tasks import make_scene
from vsep_app.model.compare_settings import LAST_FRAME, ComparePlan
from vsep_app.model.settings import LOADED_FRAME, Settings
from vsep_app.pages.compare.tasks import (
    advance,
    compact,
    compose,
    find_mask,
    has_next_frame,
    next_plan,
    prepare,
)

from vsep.analysis.repair import windowed_error_db
from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.registry import make_estimator
from vsep.mitigation.method import mitigate
from vsep.mitigation.registry import make_mitigation
from vsep.mitigation.sparse.sequence import mitigate_sequence
from vsep.mitigation.sparse.thresholding import SOFT_PRIOR, pm_ist


def plan_of(*methods, preset="simulation-2-b", mask="truth", **changes):
    settings = Settings()
    settings.choose_preset(preset)
    settings.param.update(**{"max_iterations": 2, **changes})
    return ComparePlan(
        scene=settings.plan(),
        methods=methods,
        mask=mask,
        debias=False,
        frame_number=0,
        histories={},
        past=(),
    )


def steps_of(comparison):
    steps = [advance(comparison, comparison.initial_state)]
    while steps[-1].termination is Termination.RUNNING:
        steps.append(advance(comparison, steps[-1].state))
    return steps


def snapshot_of(comparison, steps):
    return Snapshot(
        run_number=3,
        prepared_run=comparison,
        steps=steps,
        num_steps=len(steps),
        phase=Phase.FINISHED,
    )


def test_each_method_run_does_what_its_method_does_alone():
    plan = plan_of("ist", "masked", max_iterations=40)
    comparison = prepare(plan)
    last = steps_of(comparison)[-1]
    frame = make_scene(plan.scene).frame
    repaired = mitigate(make_mitigation("ist"), frame.received, frame.perfect_mask)
    ist, masked = last.state
    np.testing.assert_array_equal(ist.observed, repaired.cleaned)
    assert last.views[0].metrics.num_repairs == repaired.iteration
    model = comparison.method_runs[0].estimator.model
    alone = run(
        make_estimator("masked", model, mask=frame.perfect_mask, max_iterations=40), frame.received
    )
    np.testing.assert_array_equal(masked.separation.objects.beats, alone.state.objects.beats)
    expected = frame.received - alone.state.interference_signal
    np.testing.assert_array_equal(masked.cleaned, expected)
    error = windowed_error_db(frame.truth.object_signal, expected)
    metrics = last.views[1].metrics
    assert metrics.windowed_error_db == error
    # This frame: ten objects, all found, and one ghost at most.
    assert (metrics.misses, metrics.false_alarms <= 1) == (0, True)


def test_the_repair_comes_first_and_then_the_detection():
    comparison = prepare(plan_of("zeroing", "ist"))
    steps = steps_of(comparison)
    first = steps[0].views
    assert [view.stage for view in first] == ["detects", "repairs"]
    assert first[0].metrics.num_detections == 0
    assert first[1].metrics.num_detections is None
    assert first[1].metrics.misses is None
    assert steps[-1].termination is Termination.MAX_ITERATIONS
    # A lane that has ended waits for the others, untouched.
    done = next(
        index
        for index, step in enumerate(steps)
        if step.state[0].termination is not Termination.RUNNING
    )
    assert steps[done].state[0] is steps[-1].state[0]


def test_a_compact_step_draws_as_before():
    comparison = prepare(plan_of("linear", "factorised"))
    step = advance(comparison, comparison.initial_state)
    assert compact(step).state == ()
    picture = compose(snapshot_of(comparison, (compact(step),)))
    assert picture.method_runs == step.views
    assert (picture.run_number, picture.iteration) == (3, 1)
    assert compose(snapshot_of(comparison, ())).method_runs == comparison.initial_views


def test_the_frames_of_a_sequence_hand_on_what_the_prior_saw():
    plan = plan_of("pm-ist", "factorised")
    frames, cleaned = [], []
    for number in range(3):
        comparison = prepare(plan)
        assert (plan.frame_number, len(plan.past)) == (number, number)
        last = steps_of(comparison)[-1]
        frames.append(make_scene(plan.scene, frame_number=number).frame)
        cleaned.append(last.state[0].observed)
        plan = next_plan(comparison, last)
    expected = mitigate_sequence(
        lambda history: pm_ist(history=history),
        [(frame.received, frame.perfect_mask) for frame in frames],
        SOFT_PRIOR,
    )
    for own, step in zip(cleaned, expected, strict=True):
        np.testing.assert_array_equal(own, step.state.cleaned)
    assert set(plan.histories) == {"pm-ist"}
    assert comparison.method_runs[0].num_prior_peaks > 0
    assert comparison.method_runs[1].num_prior_peaks is None


def test_only_simulated_scenes_go_on():
    plan = plan_of("ist", "iht")
    assert has_next_frame(plan)
    assert not has_next_frame(plan_of("ist", "iht", preset="real-frame"))
    ended = ComparePlan(**{**vars(plan), "frame_number": LAST_FRAME})
    assert not has_next_frame(ended)


def test_a_frame_without_truth_needs_a_mask_that_is_found():
    frame = make_scene(plan_of("ist", "iht").scene).frame
    blind = Frame(received=frame.received, radar=frame.radar, name="own.npz")
    plan = plan_of("linear", "masked", preset=LOADED_FRAME)
    with pytest.raises(InputError, match=r"own\.npz holds no truth"):
        prepare(plan, blind)
    found = prepare(ComparePlan(**{**vars(plan), "mask": "autoregressive"}), blind)
    view = steps_of(found)[-1].views[1]
    assert view.metrics.misses is None
    assert np.isnan(view.metrics.windowed_error_db)


def test_a_recording_has_a_signal_to_compare_with_but_no_known_objects():
    comparison = prepare(plan_of("zeroing", "linear", preset="real-frame"))
    step = advance(comparison, comparison.initial_state)
    assert step.views[0].metrics.misses is None
    assert step.views[0].metrics.windowed_error_db < comparison.received.windowed_error_db


def test_a_method_that_cannot_work_is_named():
    frame = make_scene(plan_of("ist", "iht").scene).frame
    lost = Frame(
        received=frame.received,
        radar=frame.radar,
        truth_mask=np.ones(frame.received.shape, dtype=bool),
    )
    with pytest.raises(InputError, match="ist: All 2048 samples are flagged"):
        prepare(plan_of("object-only", "ist", preset=LOADED_FRAME), lost)
    assert find_mask(lost, "truth").all()

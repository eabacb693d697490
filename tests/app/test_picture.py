from dataclasses import replace

import numpy as np
import pytest
from vsep_app.jobs.tasks import compose
from vsep_app.model.picture import FADE_ITERATIONS, FLASH_ITERATIONS, make_picture
from vsep_app.model.static_picture import make_static_picture

from vsep.inference.core.progress import ComponentEvent, EventKind, Termination
from vsep.signal.scene import Observation


def _picture(run, num_steps=None, ramp=0, mode="level"):
    return compose(run.snapshot(num_steps), ramp, mode)


def test_the_first_picture_has_the_frame_and_no_component(one_ramp):
    picture = _picture(one_ramp, 0)
    assert picture.iteration == 0
    assert picture.num_iterations == len(one_ramp.steps)
    assert picture.log == ()
    assert picture.objects.ranges_m.size == 0
    assert np.all(np.isnan(picture.burst_level_db))
    assert picture.termination is Termination.RUNNING


def test_the_spectrum_peaks_at_the_object_with_the_level_of_its_stem(one_ramp):
    picture = _picture(one_ramp)
    stem = int(np.argmax(picture.objects.snr_db))
    spectrum = picture.delay.object_estimate
    peak = int(np.argmax(spectrum))
    spacing = picture.delay.axis[1] - picture.delay.axis[0]
    assert abs(picture.delay.axis[peak] - picture.objects.ranges_m[stem]) <= spacing
    # Half a padded bin off its peak a Hann line is 0.1 dB down; weak other components add little.
    assert spectrum[peak] == pytest.approx(picture.objects.levels_db[stem], abs=0.5)


def test_metres_follow_from_the_delay_of_table_i(one_ramp):
    picture = _picture(one_ramp)
    # 80.06 ns there and back.
    assert picture.true_objects.ranges_m == pytest.approx([80.06e-9 * 299_792_458.0 / 2.0])


def test_cleaned_is_received_minus_interference(many_ramps):
    picture = _picture(many_ramps, mode="real")
    fast = picture.fast_time
    assert fast.cleaned == pytest.approx(fast.received - fast.interference, abs=1e-12)
    assert fast.received == pytest.approx(many_ramps.prepared.observation.received[0].real)


def test_level_of_the_median_sample_is_zero(many_ramps):
    static_picture = many_ramps.prepared.static_picture
    power = np.abs(many_ramps.prepared.observation.received) ** 2
    assert np.median(static_picture.level_db(power)) == pytest.approx(0.0, abs=0.1)


def test_levels_do_not_depend_on_the_unit_of_the_samples(many_ramps):
    prepared = many_ramps.prepared
    scaled = prepared.static_picture.level_db(np.array([prepared.static_picture.reference_power]))
    assert scaled == pytest.approx([0.0])


def test_limits_stay_during_a_run(many_ramps):
    first, last = _picture(many_ramps, 1), _picture(many_ramps)
    assert first.static_picture is last.static_picture


def test_the_map_is_cleaner_after_cancellation(many_ramps):
    picture = _picture(many_ramps)
    before, after = picture.static_picture.map_before, picture.map_after
    assert before.dtype == after.dtype == np.uint8
    assert before.shape == after.shape
    assert np.median(after) < np.median(before)


def test_the_map_peaks_at_the_strongest_true_object(many_ramps):
    picture, static_picture = _picture(many_ramps), many_ramps.prepared.static_picture
    strongest = int(np.argmax(picture.true_objects.snr_db))
    row = np.argmin(
        np.abs(static_picture.map_velocities_mps - picture.true_objects.velocities_mps[strongest])
    )
    column = np.argmin(
        np.abs(static_picture.map_ranges_m - picture.true_objects.ranges_m[strongest])
    )
    # On the grid of the map, within the main lobe of a strong line.
    assert picture.map_after[row, column] >= 0.9 * picture.map_after.max()


def test_true_and_estimated_bursts_are_in_the_same_ramps(many_ramps):
    picture = _picture(many_ramps)
    assert np.isfinite(picture.burst_level_db).tolist() == picture.true_ramps.tolist()
    assert picture.true_ramps.sum() == 4


def test_the_table_has_every_true_object_once(many_ramps):
    picture = _picture(many_ramps)
    truths = [row.true_range_m for row in picture.table if row.true_range_m is not None]
    assert sorted(truths) == pytest.approx(sorted(picture.true_objects.ranges_m))
    found = [row for row in picture.table if row.component_id is not None]
    assert len(found) == picture.objects.ranges_m.size


def test_a_new_component_flashes_where_it_is_and_the_flash_fades(many_ramps):
    newest = many_ramps.steps[0].info.events
    first = next(e.component_id for e in newest if e.kind is EventKind.OBJECT_ADDED)
    opacities = []
    for shown in range(1, FLASH_ITERATIONS + 2):
        picture = _picture(many_ramps, shown)
        ids = many_ramps.steps[shown - 1].state.objects.component_ids
        place = picture.objects.ranges_m[list(ids).index(first)]
        opacities.append(float(picture.added.opacity[picture.added.ranges_m == place].sum()))
    expected = [1.0 - age / FLASH_ITERATIONS for age in range(FLASH_ITERATIONS)]
    assert opacities == pytest.approx([*expected, 0.0])


def test_a_pruned_component_fades_where_it_was(many_ramps):
    step = many_ramps.steps[-1]
    event = ComponentEvent(
        kind=EventKind.OBJECT_PRUNED,
        snr_db=9.0,
        threshold_db=11.0,
        component_id=99,
        beat=0.1,
        doppler=0.25,
    )
    pruned = replace(step, info=replace(step.info, events=(event,)))
    for age in range(FADE_ITERATIONS + 1):
        quiet = [replace(step, info=replace(step.info, events=()))] * age
        picture = make_picture(
            many_ramps.prepared.static_picture, many_ramps.prepared.initial_state, [pruned, *quiet]
        )
        if age == FADE_ITERATIONS:
            assert picture.pruned.opacity.size == 0
            break
        assert picture.pruned.opacity == pytest.approx([1.0 - age / FADE_ITERATIONS])
        radar = many_ramps.prepared.static_picture.radar
        assert picture.pruned.ranges_m == pytest.approx([radar.range_from_beat(np.array(0.1))])


def test_ramp_is_clipped_to_those_there_are(many_ramps):
    assert _picture(many_ramps, ramp=999).ramp == 15
    assert _picture(many_ramps, ramp=-1).ramp == 0


def test_progress_has_one_point_an_iteration(one_ramp):
    picture = _picture(one_ramp, 2)
    assert picture.progress.iterations.tolist() == [1.0, 2.0]
    assert picture.progress.elbo[1] == one_ramp.steps[1].info.elbo


def test_a_frame_without_truth_has_a_picture(one_ramp):
    from vsep_app.model.static_picture import make_static_picture

    from vsep.signal.scene import Observation

    prepared = one_ramp.prepared
    static_picture = make_static_picture(
        prepared.static_picture.radar,
        Observation(received=prepared.observation.received),
        title="recorded",
    )
    picture = make_picture(static_picture, prepared.initial_state, one_ramp.steps)
    assert picture.true_objects.ranges_m.size == 0
    assert not picture.true_ramps.any()
    assert np.all(np.isnan(picture.delay.true_object))
    assert static_picture.levels_text == ""


def test_both_conventions_of_the_levels_are_said(one_ramp):
    text = one_ramp.prepared.static_picture.levels_text
    # 30 dB over 256 samples is 30 - 24.1 dB a sample.
    assert "SNR 30.0 dB in total (5.9 dB per sample)" in text
    assert "SIR -20.0 dB in total" in text


def test_bursts_do_not_hide_the_noise_where_no_truth_is_known(many_ramps):
    static_picture = many_ramps.prepared.static_picture
    observation = static_picture.observation
    without = static_picture_of(static_picture.radar, observation.received)
    clean = static_picture_of(
        static_picture.radar, observation.received - observation.truth.interference_signal
    )
    # Four of sixteen ramps are interfered; the floor is that of the others. Limits are rounded to
    # steps of 5 dB.
    assert abs(without.map_limits_db[0] - clean.map_limits_db[0]) <= 5.0


def static_picture_of(radar, received):
    return make_static_picture(radar, Observation(received=received, truth=None), title="")

"""Chirps over the time of a frame: where they cross the band, and what dragging them means."""

from typing import Any

import numpy as np
import pytest
from bokeh.events import Tap
from vsep_app.jobs.tasks import Prepared, compose, prepare, preview
from vsep_app.model.crossing import ALL_RAMPS, SPECTROGRAM, Courses, CrossingPlane
from vsep_app.model.picture import Picture
from vsep_app.model.settings import Settings
from vsep_app.views.crossing import CrossingView
from vsep_app.views.pointer import END, MOVE, START, Drag
from vsep_app.widgets.chirp_drag import ChirpDrag, drawn_ends
from vsep_app.widgets.controls import Controls, slope_remark

from tests.app.conftest import FinishedRun


def first_picture(settings: Settings, mode: str = ALL_RAMPS) -> Picture:
    """The picture before the first iteration, of ramp 0."""
    return preview(settings.plan(), None, 0, 0, "level", 0, mode)


@pytest.fixture
def settings() -> Settings:
    """Of Simulation II b."""
    settings = Settings()
    settings.choose_preset("simulation-2-b")
    return settings


@pytest.fixture
def prepared(settings: Settings) -> Prepared:
    return prepare(settings.plan())


def test_a_burst_is_where_the_chirp_is_in_the_band(settings: Settings) -> None:
    picture = first_picture(settings)
    truth = picture.static_picture.observation.truth
    assert truth is not None
    plane, true = picture.crossing.plane, picture.crossing.true
    times = picture.static_picture.times_us

    def share(bands: float) -> list[float]:
        """Share of each burst's energy within so many half-widths of the band."""
        shares = []
        ends = true.within(bands * plane.band_mhz, plane.ramp_us)
        for ramp, first, last in zip(true.ramps, *ends, strict=True):
            power = np.abs(truth.interference_signal[ramp]) ** 2
            shares.append(float(power[(times >= first) & (times <= last)].sum() / power.sum()))
        return shares

    # The raised cosine passes half of the amplitude at the edge of the band, nothing at 1.25 times.
    assert min(share(1.3)) > 0.98
    assert min(share(1.0)) > 0.9
    assert 0.2 < min(share(0.5)) < max(share(0.5)) < 0.8
    assert set(true.ramps) == set(np.flatnonzero(picture.static_picture.true_ramps))


def test_the_spectrogram_is_brightest_along_the_chirp(settings: Settings) -> None:
    settings.sir_db = -40.0
    picture = first_picture(settings, SPECTROGRAM)
    plane, true, image = picture.crossing.plane, picture.crossing.true, picture.crossing.image
    assert image is not None
    assert image.dtype == np.uint8
    (first,), (last,) = true.within(0.8 * plane.band_mhz, plane.ramp_us)
    times = picture.static_picture.times_us
    bins_a_mhz = len(image) / (2.0 * plane.nyquist_mhz)
    for column in np.flatnonzero((times > first) & (times < last)):
        (expected,) = true.at(times[column : column + 1])
        brightest = image[:, column].argmax() / bins_a_mhz - plane.nyquist_mhz
        assert brightest == pytest.approx(expected, abs=0.35)


@pytest.mark.parametrize("ramp", [None, 3])
def test_a_place_is_read_as_it_was_drawn(ramp: int | None) -> None:
    plane = CrossingPlane(
        num_ramps=8, ramp_us=25.0, band_mhz=1.2, nyquist_mhz=2.5, victim_slope=10.0, ramp=ramp
    )
    x, y = plane.place(np.array([3]), np.array([7.0]), np.array([-0.8]))
    assert plane.read(float(x[0]), float(y[0]), 3) == pytest.approx((7.0, -0.8))
    (left, right), (bottom, top) = plane.limits
    assert left <= x[0] <= right
    assert bottom <= y[0] <= top


def test_a_chirp_of_the_victims_slope_stays_in_the_band_or_never_enters_it() -> None:
    courses = Courses(ramps=np.array([0, 1]), starts_mhz=np.array([0.5, 3.0]), slopes=np.zeros(2))
    first, last = courses.within(1.0, 25.0)
    assert (first[0], last[0]) == (0.0, 25.0)
    assert first[1] > last[1]
    assert courses.crossings_us(25.0).tolist() == [12.5, 12.5]
    assert "steady tone" in slope_remark(courses)


def test_bursts_that_are_found_lie_on_the_true_chirps(many_ramps: FinishedRun) -> None:
    crossing = compose(many_ramps.snapshot(), 0, "level").crossing
    assert crossing.is_true is not None
    assert crossing.is_true.all()
    order = np.argsort(crossing.found.ramps)
    assert crossing.found.ramps[order].tolist() == crossing.true.ramps.tolist()
    np.testing.assert_allclose(crossing.found.slopes[order], crossing.true.slopes, rtol=0.01)
    ramp_us = crossing.plane.ramp_us
    np.testing.assert_allclose(
        crossing.found.crossings_us(ramp_us)[order], crossing.true.crossings_us(ramp_us), atol=0.1
    )
    other = compose(many_ramps.snapshot(0), 0, "level").crossing
    assert len(other.found.ramps) == 0


class Stage:
    """The view, its controls and what is dragged there."""

    def __init__(self, settings: Settings) -> None:
        self.settings, self.moves = settings, 0
        self.controls = Controls(settings, lambda *_: None, self.moved)
        self.chirps = ChirpDrag(settings, self.controls.widgets)
        self.selected: list[int] = []
        self.view = CrossingView(self.selected.append, self.chirps.take)
        self.picture = first_picture(settings)
        self.view.update(self.picture, can_drag=True)
        self.pixel = np.array([16.0 / 1000.0, 10.0 / 150.0])

    def moved(self) -> None:
        self.moves += 1

    def drag(self, phase: Any, x: float, y: float) -> None:
        columns = Drag(phase, x, y, *self.pixel)._asdict()
        self.view.pointer.source.data = {
            **{name: [value] for name, value in columns.items()},
            "number": [self.view.pointer.source.data["number"][0] + 1],
        }

    def chirp(self, index: int, share: float) -> tuple[float, float]:
        """A place on a chirp as it is drawn; 1 is its end."""
        begin, end = drawn_ends(self.picture.crossing.plane, self.picture.crossing.true)
        x, y = begin[index] + share * (end[index] - begin[index])
        return float(x), float(y)


@pytest.fixture
def stage(settings: Settings) -> Stage:
    return Stage(settings)


def test_a_chirp_that_is_dragged_sideways_takes_its_burst_along(stage: Stage) -> None:
    before = stage.picture.crossing
    x, y = stage.chirp(2, 0.5)
    stage.drag(START, x, y)
    stage.drag(MOVE, x + 0.1, y)
    assert stage.controls.widgets["burst_shift"].value == pytest.approx(2.5, abs=0.06)
    assert stage.settings.burst_shift == 0.0
    assert stage.moves > 0
    assert stage.controls.moving_plan().burst_shift == pytest.approx(2.5, abs=0.06)
    stage.drag(END, x + 0.12, y)
    assert stage.settings.burst_shift == pytest.approx(3.0, abs=0.06)
    after = first_picture(stage.settings).crossing
    ramp_us = before.plane.ramp_us
    moved = after.true.crossings_us(ramp_us) - before.true.crossings_us(ramp_us)
    np.testing.assert_allclose(moved, 3.0, atol=0.1)


def test_a_chirp_that_is_turned_at_its_end_runs_through_the_pointer(stage: Stage) -> None:
    x, y = stage.chirp(0, 1.0)
    stage.drag(START, x, y)
    stage.drag(END, x, y - 2.0)
    assert stage.settings.interferer_slope < 9.7
    after = first_picture(stage.settings).crossing
    time_us, frequency_mhz = after.plane.read(x, y - 2.0, 0)
    assert after.true.at(np.full(4, time_us))[0] == pytest.approx(frequency_mhz, abs=0.2)


def test_a_chirp_that_crosses_near_the_end_of_its_ramp_is_turned_at_its_beginning(
    settings: Settings,
) -> None:
    settings.burst_shift = 12.0
    stage = Stage(settings)
    plane, true = stage.picture.crossing.plane, stage.picture.crossing.true
    first, _ = true.within(plane.reach_mhz, plane.ramp_us)
    np.testing.assert_allclose(true.handles_us(plane.reach_mhz, plane.ramp_us), first)
    x, y = stage.chirp(0, 0.0)
    stage.drag(START, x, y)
    stage.drag(END, x, y + 1.0)
    assert stage.settings.interferer_slope < 9.7
    after = first_picture(stage.settings).crossing.true
    assert after.pivots_us(plane.ramp_us)[0] == pytest.approx(
        true.pivots_us(plane.ramp_us)[0], abs=0.5
    )


def test_the_victims_own_slope_is_easy_to_meet(stage: Stage) -> None:
    x, y = stage.chirp(0, 1.0)
    plane = stage.picture.crossing.plane
    time_us, _ = plane.read(x, y, 0)
    (level,) = plane.place(np.array([0]), np.array([time_us]), np.array([0.1]))[1]
    stage.drag(START, x, y)
    stage.drag(MOVE, x, float(level))
    assert stage.controls.widgets["interferer_slope"].value == 10.0
    assert stage.controls.moving_plan().interference_model == "convolution"


def test_a_drag_beside_all_chirps_and_one_that_makes_no_sense_do_nothing(stage: Stage) -> None:
    stage.drag(START, 12.5, 0.0)
    stage.drag(MOVE, 13.5, 0.0)
    x, y = stage.chirp(0, 0.5)
    stage.drag(START, x, y)
    for phase, left in ((MOVE, float("nan")), (7, x), ("1", x), (MOVE, "far")):
        stage.drag(phase, left, y)  # type: ignore[arg-type]
    assert stage.moves == 0


def test_chirps_of_a_loaded_frame_stay_where_they_are(stage: Stage) -> None:
    stage.settings.preset = "loaded-frame"
    x, y = stage.chirp(0, 0.5)
    stage.drag(START, x, y)
    stage.drag(END, x + 0.1, y)
    assert stage.settings.burst_shift == 0.0


def test_a_click_selects_the_ramp_under_it(stage: Stage) -> None:
    for x in (4.5, 15.99, -3.0):
        stage.view._tapped(Tap(stage.view.figure, x=x, y=1.0))
    assert stage.selected == [4, 15, 0]


def test_the_view_has_bands_of_all_ramps_and_rings_of_what_is_found(
    stage: Stage, many_ramps: FinishedRun
) -> None:
    view = stage.view
    assert np.isnan(view._bands.data["x"]).sum() == 16  # a gap after each
    assert view._found.data["x"] == []
    view.update(compose(many_ramps.snapshot(), 0, "level"), can_drag=False)
    assert view._found.data["shape"] == ["circle"] * 4
    assert not view._handles.visible
    view.update(compose(many_ramps.snapshot(), 2, "level", 0, SPECTROGRAM), can_drag=True)
    assert np.isnan(view._bands.data["x"]).sum() == 1
    assert "ramp 2" in view.figure.title.text
    assert len(view._image.data["image"]) == 1

"""Time of the parts: the costs (70) and (71), their refinement, the search, a dashboard frame."""

from dataclasses import replace

import numpy as np
import pytest
from bokeh.models import Span
from vsep_app.jobs.tasks import advance, prepare
from vsep_app.model.picture import make_picture
from vsep_app.model.settings import Settings
from vsep_app.views.range_doppler import RangeDopplerView
from vsep_app.views.signals import DelayView, FastTimeView
from vsep_app.views.style import Axis

from tests.benchmarks.scenes import preset_problem
from vsep.inference.bursts.channel import ChannelGrid
from vsep.inference.bursts.chirp_refinement import ChannelCosts, place_chirps, refine_chirps
from vsep.inference.bursts.chirp_search import find_single_chirps
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.objects.sbl import ActiveSet
from vsep.kernels.complex_parts import split
from vsep.kernels.line_spectra import Columns, columns_as_parts
from vsep.kernels.newton_ascent import ascend
from vsep.kernels.object_cost import cost_jet
from vsep.kernels.ramps import FlatRamps
from vsep.reference_costs import (
    Dictionary,
    channel_atoms,
    chirp_dictionary,
    log_evidence,
    object_atoms,
    refine_chirp,
    refine_object,
)
from vsep.signal.atoms import gram, line_factors, project

WAYS = ["fast", "reference"]
OFF_CELLS = 0.02  # resolution cells from the top at which a refinement starts


@pytest.fixture(scope="module")
def settled():
    """A finished run of Simulation II-c, and its frame."""
    problem = preset_problem("simulation-2-c", 60.0, -20.0)
    return problem, run(problem.separator, problem.received).state


@pytest.fixture(scope="module")
def line(settled):
    """One object of it: where it is, the residual, and the others."""
    problem, state = settled
    objects, shape = state.objects, problem.received.shape
    points = np.stack([objects.beats, objects.dopplers], axis=1)
    residual = problem.received - state.interference_signal
    factors = line_factors(points[1:, 0], shape[1]), line_factors(points[1:, 1], shape[0])
    others = ActiveSet(
        gram(*factors), project(residual, *factors), objects.precisions[1:], state.noise_precision
    )
    amplitudes = others.amplitudes[:, None]
    columns = Columns(*factors, others.covariance, amplitudes, state.noise_precision)
    return points, objects.precisions, residual, columns


@pytest.fixture(scope="module")
def chirp(settled):
    """One burst of it: its cost and where it is."""
    problem, state = settled
    burst, model = state.bursts[0], problem.separator.model
    row = (problem.received - state.object_signal)[burst.ramp]
    return model, burst, row, state.noise_precision


def placed(burst, model):
    """A burst's template."""
    return place_chirps(np.array([burst.start_frequency]), np.array([burst.slope]), model)


def cost_of(chirp):
    """Cost (71) of the burst's ramp."""
    model, burst, row, noise_precision = chirp
    twiddle = ChannelGrid(model.num_samples, model.num_grid_bins).twiddle
    bins, precisions = burst.active_bins.copy(), burst.precisions.copy()
    template = placed(burst, model).templates
    ends, columns = np.array([0, 1]), np.array([0, len(bins)])
    ramps = FlatRamps(template, ends, np.zeros_like(bins), bins, precisions, columns, twiddle)
    return ChannelCosts(
        ramps=ramps,
        moving=ends[:1],
        shared=ends[:1],
        residual=row[None],
        noise_precision=noise_precision,
    )


@pytest.mark.benchmark(group="cost (70)")
@pytest.mark.parametrize("way", WAYS)
def test_cost_of_an_object(timed, line, way):
    points, precisions, residual, others = line
    rest, columns = split(residual), columns_as_parts(others)

    def slow():
        objects = Dictionary(object_atoms(points, residual.shape), precisions)
        return log_evidence(objects, residual.ravel(), others.noise_precision)

    def fast():
        return cost_jet(*points[0], precisions[0], rest, columns).value

    value = timed(fast if way == "fast" else slow, part="one evaluation of (70)", way=way)
    assert np.isfinite(value)


@pytest.mark.benchmark(group="cost (70)")
@pytest.mark.parametrize("way", WAYS)
def test_refinement_of_an_object(timed, line, way):
    points, precisions, residual, others = line
    rest, columns = split(residual), columns_as_parts(others)
    start = points[0] + OFF_CELLS / np.array(residual.shape[::-1])

    def slow():
        fixed = Dictionary(object_atoms(points[1:], residual.shape), precisions[1:])
        return refine_object(start, precisions[0], fixed, residual, others.noise_precision)

    def fast():
        end = ascend(start, precisions[0], rest, columns, 1)
        return np.array([end.beat, end.doppler])

    moved = timed(fast if way == "fast" else slow, part="one refinement of (70)", way=way)
    assert np.linalg.norm(moved - points[0]) < np.linalg.norm(start - points[0])


@pytest.mark.benchmark(group="cost (71)")
@pytest.mark.parametrize("way", WAYS)
def test_cost_of_a_burst(timed, chirp, way):
    model, burst, row, noise_precision = chirp
    bins, precisions = burst.active_bins.copy(), burst.precisions.copy()
    cost = cost_of(chirp)

    def slow():
        template = model.template(np.array([burst.start_frequency]), np.array([burst.slope]))[0]
        columns = template[:, None] * channel_atoms(model)[:, bins]
        return log_evidence(Dictionary(columns, precisions), row, noise_precision)

    def fast():
        return cost.values(np.zeros(1, int), placed(burst, model).templates)[0]

    value = timed(fast if way == "fast" else slow, part="one evaluation of (71)", way=way)
    # Two formulas of the same number of about 1e5.
    assert value == pytest.approx(slow(), rel=1e-9)


@pytest.mark.benchmark(group="cost (71)")
@pytest.mark.parametrize("way", WAYS)
def test_refinement_of_a_burst(timed, chirp, way):
    model, burst, row, noise_precision = chirp
    slope = burst.slope * (1.0 + 1e-3)
    moved = replace(burst, slope=slope, start_frequency=-burst.centre * slope)
    cost = cost_of(chirp)
    theta = np.array([moved.start_frequency, slope])

    def slow():
        bins = burst.active_bins.tolist()
        return refine_chirp(theta, bins, burst.precisions, row, noise_precision, model)[1]

    def fast():
        return refine_chirps(placed(moved, model), model, cost).slope[0]

    found = timed(fast if way == "fast" else slow, part="one refinement of (71)", way=way)
    assert abs(found - burst.slope) < abs(slope - burst.slope)


@pytest.mark.benchmark(group="search")
@pytest.mark.parametrize("way", WAYS)
def test_chirp_search(timed, settled, way):
    problem, _ = settled
    model, received = problem.separator.model, problem.received
    parameters, atoms, energies = chirp_dictionary(model)

    def slow():
        return parameters[np.argmax(np.abs(atoms.conj() @ received.T) ** 2 / energies[:, None], 0)]

    def fast():
        found = find_single_chirps(received, model)
        return np.stack([found.start_frequency, found.slope], axis=1)

    found = timed(fast if way == "fast" else slow, part="chirp search of a frame", way=way)
    interfered = sorted({burst.ramp for burst in settled[1].bursts})
    np.testing.assert_allclose(found[interfered], slow()[interfered])


@pytest.mark.benchmark(group="dashboard")
def test_dashboard_frame(timed):
    settings = Settings()
    settings.choose_preset("simulation-2-c")
    prepared = prepare(settings.plan())
    steps = [advance(prepared, prepared.initial_state)]
    while steps[-1].termination is Termination.RUNNING:
        steps.append(advance(prepared, steps[-1].state))
    axis, crosshair = Axis(), Span(dimension="height")
    views = FastTimeView(), DelayView(axis, crosshair), RangeDopplerView(axis, crosshair)

    def draw():
        picture = make_picture(
            prepared.static_picture,
            prepared.initial_state,
            tuple(steps),
            ramp=0,
            fast_time_mode="level",
            run_number=1,
            num_iterations=len(steps),
        )
        for view in views:
            view.update(picture)
        return picture

    assert timed(draw, part="one dashboard frame: picture and views").progress is not None

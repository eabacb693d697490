"""Sparse solvers as mitigation methods: window, iterations, filled gaps."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from tests.vsep.repair_bench import repair_scene
from tests.vsep.sparse_bench import gap_scene
from vsep.analysis.repair import gap_error_db
from vsep.errors import InputError
from vsep.mitigation.method import iterate_mitigation, mitigate
from vsep.mitigation.registry import make_mitigation
from vsep.mitigation.sparse.filling import SparseMitigation
from vsep.mitigation.sparse.operators import ExplicitMatrix
from vsep.mitigation.sparse.solver import Solver, SolverState
from vsep.mitigation.sparse.thresholding import IterativeThresholding
from vsep.signal.spectra import hann_window

NAMES = [
    *("ist", "iht", "iht-plain", "pm-ist", "pm-iht", "fista"),
    *("omp", "cosamp", "amp", "gamp", "yall1"),
]


@pytest.fixture(scope="module")
def small():
    """Eight ramps of a large frame, every fourth sample: a third of them lost in blocks."""
    received, objects, mask = gap_scene(0, share=0.3, snr_db=10.0)
    return received[:8, ::4], objects[:8, ::4], mask[:8, ::4]


def distance(first, second):
    return np.linalg.norm(first - second) / np.linalg.norm(second)


@pytest.mark.parametrize("name", NAMES)
def test_both_domains_give_the_same_iterates(name, small):
    received, _, mask = small
    masked, explicit = (
        [s.cleaned for s in iterate_mitigation(make_mitigation(name, domain=d), received, mask)]
        for d in ("masked-2d", "explicit-1d")
    )
    assert len(masked) == len(explicit) > 2
    # Rounding, which iterations carry on: 1e-15 was measured, 1e-12 after 300 iterations.
    assert max(map(distance, masked, explicit)) < 1e-10


@pytest.mark.parametrize("name", NAMES)
def test_single_precision_gives_the_same_in_single_precision(name):
    scene = repair_scene(1, tails=False)
    double = mitigate(make_mitigation(name), scene.received, scene.mask).cleaned
    single = mitigate(make_mitigation(name), scene.received.astype(np.complex64), scene.mask)
    assert (double.dtype, single.cleaned.dtype) == (np.complex128, np.complex64)
    assert distance(single.cleaned, double) < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_scale_plays_no_part(name, small):
    received, _, mask = small
    expected = mitigate(make_mitigation(name), received, mask)
    for factor in (1e-150, -2j * 1e100):
        scaled = mitigate(make_mitigation(name), factor * received, mask)
        assert scaled.iteration == expected.iteration
        # 300 iterations of rounding left 1e-12 in the comparison of the domains.
        assert distance(scaled.cleaned / factor, expected.cleaned) < 1e-10


@pytest.mark.parametrize("name", NAMES)
def test_clean_samples_are_kept_and_gaps_are_filled(name, small):
    received, objects, mask = small
    final = mitigate(make_mitigation(name), received, mask)
    np.testing.assert_array_equal(final.cleaned[~mask], received[~mask])
    assert not final.cleaned.flags.writeable
    # Zeros in the gaps would be at 0 dB.
    assert gap_error_db(objects, final.cleaned, mask) < -3.0


def lost_share(shape, share):
    return np.random.default_rng(5).uniform(size=shape) < share


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("case", ["zero", "ramp", "most", "single ramp", "one sample left"])
def test_extreme_frames_end_finite(name, case, small):
    received, _, mask = small
    if case == "zero":
        received = np.zeros_like(received)
    elif case == "ramp":
        mask = mask.copy()
        mask[3] = True
    elif case == "most":
        mask = lost_share(mask.shape, 0.7)
    elif case == "single ramp":
        received, mask = received[:1], mask[:1]
    else:
        mask = np.ones_like(mask)
        mask[4, 5] = False
    cleaned = mitigate(make_mitigation(name, debias=True), received, mask).cleaned
    assert np.all(np.isfinite(cleaned))
    # Nothing is filled that dwarfs what was received.
    assert np.abs(cleaned[mask]).max() <= 10.0 * np.abs(received[~mask]).max()


@pytest.mark.parametrize("name", NAMES)
def test_a_clean_frame_needs_no_step(name, small):
    received, _, mask = small
    assert not list(iterate_mitigation(make_mitigation(name), received, np.zeros_like(mask)))
    unchanged = mitigate(make_mitigation(name), received, np.zeros_like(mask))
    np.testing.assert_array_equal(unchanged.cleaned, received)


def test_a_frame_without_a_clean_sample_is_refused(small):
    received, _, mask = small
    with pytest.raises(InputError, match="at least one must be clean"):
        mitigate(make_mitigation("ist"), received, np.ones_like(mask))


def test_a_run_can_be_paused_and_resumed_in_another_process(small):
    received, _, mask = small
    method = make_mitigation("gamp")
    states = list(iterate_mitigation(method, received, mask))
    stored = pickle.loads(pickle.dumps(states[4]))
    resumed = list(iterate_mitigation(method, received, mask, stored))
    assert len(resumed) == len(states) - 5
    np.testing.assert_array_equal(resumed[-1].cleaned, states[-1].cleaned)


def test_debiasing_is_the_least_squares_fit_of_the_cells_found(small):
    received, _, mask = small
    plain = mitigate(make_mitigation("ist"), received, mask)
    fitted = mitigate(make_mitigation("ist", debias=True), received, mask)
    assert fitted.iteration == plain.iteration + 1
    window = np.outer(hann_window(8), hann_window(32))
    found = plain.memory.spectrum
    matrix = ExplicitMatrix(mask, np.complex128)
    windowed = (window * received)[~mask]
    noise = np.linalg.norm(windowed - matrix.forward(found.ravel())) / np.sqrt(mask.size)
    support = np.abs(found.ravel()) > noise
    columns = np.array([matrix.forward(unit) for unit in np.eye(mask.size)[support]]).T
    dense = np.linalg.lstsq(columns, windowed, rcond=None)[0]
    # Conjugate gradients stop at a relative gradient of 1e-7.
    np.testing.assert_allclose(
        fitted.memory.spectrum.ravel()[support], dense, atol=1e-5 * np.abs(dense).max()
    )


def test_the_window_makes_the_spectrum_sparse():
    solver = IterativeThresholding(shrinkage="hard", control=3.5, decay=0.8)
    errors = np.zeros((3, 2))
    for index in range(3):
        scene = repair_scene(index, shift=4, tails=False)
        for column, window in enumerate(("rectangular", "hann")):
            method = SparseMitigation(name="iht", solver=solver, window=window)
            cleaned = mitigate(method, scene.received, scene.mask).cleaned
            errors[index, column] = gap_error_db(scene.objects, cleaned, scene.mask)
    # Six scenes: -14.6 dB without and -29.2 dB with the window.
    assert errors[:, 1].mean() < errors[:, 0].mean() - 8.0


@dataclass(frozen=True)
class Runaway(Solver):
    """A solver that grows a thousandfold in every iteration."""

    def init(self, operator, measured):
        return SolverState(spectrum=1e-3 * operator.adjoint(measured), may_stop=False)

    def step(self, _operator, _measured, state):
        return SolverState(spectrum=1e3 * state.spectrum, may_stop=False)


def test_a_solver_that_runs_away_ends_with_its_last_good_spectrum(small):
    received, _, mask = small
    states = list(iterate_mitigation(SparseMitigation(name="x", solver=Runaway()), received, mask))
    assert len(states) == 2
    np.testing.assert_array_equal(states[1].cleaned, states[0].cleaned)
    assert states[1].change == 0.0


def test_the_number_of_iterations_is_bounded(small):
    received, _, mask = small
    solver = IterativeThresholding(shrinkage="soft", control=2.5)
    method = SparseMitigation(name="ist", solver=solver, tolerance=1e-12, max_iterations=7)
    assert mitigate(method, received, mask).iteration == 7


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"tolerance": 0.0}, "tolerance is 0"),
        ({"max_iterations": 0}, "max_iterations is 0"),
        ({"domain": "cube"}, "domain is 'cube'"),
        ({"window": "kaiser"}, "window is 'kaiser'; it must be hann or rectangular"),
    ],
)
def test_unusable_settings_are_refused(setting, message):
    solver = IterativeThresholding(shrinkage="soft", control=2.5)
    with pytest.raises(InputError, match=message):
        SparseMitigation(name="ist", solver=solver, **setting)

"""Every layer against dense matrices of a cell's own frame."""

from dataclasses import replace

import numpy as np
import pytest

from vsep.analysis.burst_model import model_bursts
from vsep.analysis.separability import separability
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis, parse_value
from vsep.separability.map_spec import MapSpec
from vsep.signal.atoms import line_factors
from vsep.studies.trial_scenario import simulate_trial

MAPS = [
    ("simulation-1", "sir_db=-40:40:5", "slope_difference=-2e12:-5e10:4", []),
    ("simulation-1", "object_delay=-4e-7:4e-7:6", "filter_cutoff=5e5:4e6:4", []),
    ("simulation-1", "num_objects=1:6:6", "object_delay=-1e-7:2e-7:3", ["slope_difference=4e11"]),
    ("simulation-1", "filter_mismatch=-0.3:0.3:3", "slope_difference=2e11:1e12:3", []),
    ("simulation-2-b", "object_delay=-2e-7:2e-7:4", "slope_difference=-1e12:-2e11:3", []),
    ("simulation-2-c", "num_objects=2:14:5", "interfered_share=0.1:1:4", ["snr_db=40"]),
    ("simulation-2-a", "filter_cutoff=8e5:2e6:3", "slope_difference=-1e12:-2e11:3", []),
]


def make(scene, x, y, fixed=()):
    fixed = tuple(parse_value(text) for text in fixed)
    return MapSpec(scene=scene, x=parse_axis(x), y=parse_axis(y), fixed=fixed)


def dense_coherence(bench):
    """Largest cosine of the principal angles by QR and SVD of whole matrices."""
    truth, (num_ramps, num_samples) = bench.truth, bench.model.shape
    doppler = line_factors(truth.dopplers, num_ramps)
    beat = line_factors(truth.beats, num_samples)
    atoms = (doppler[:, :, None] * beat[:, None, :]).reshape(len(beat), -1)
    model = replace(bench.model, anti_aliasing_filter=bench.scenario.anti_aliasing_filter)
    interferers = bench.scenario.scene.interferers
    bursts = model_bursts(bench.scenario.radar, interferers, model, truth.interference_signal)
    columns = []
    for burst in bursts:
        template = model.template(np.array([burst.start_frequency]), np.array([burst.slope]))
        for line in template * burst.lines(num_samples):
            frame = np.zeros((num_ramps, num_samples), dtype=complex)
            frame[burst.ramp] = line / np.linalg.norm(line)
            columns.append(frame.ravel())
    bases = [np.linalg.qr(np.array(one).T)[0] for one in (atoms, columns)]
    return np.linalg.svd(bases[0].conj().T @ bases[1], compute_uv=False)[0]


@pytest.mark.parametrize("of", MAPS, ids=lambda of: f"{of[0]}, {of[1]}, {of[2]}")
def test_cells_agree_with_dense_matrices(of):
    maps = make(*of)
    found = analytic_map(maps)
    rng = np.random.default_rng(1)
    cells = {(0, 0), (maps.x.count - 1, maps.y.count - 1)}
    cells.add((int(rng.integers(maps.x.count)), int(rng.integers(maps.y.count))))
    for column, row in cells:
        bench = simulate_trial(maps.trial((column, row)))
        truth = bench.truth
        lines = truth.beats, truth.dopplers, truth.amplitudes
        ratio = separability(*lines, truth.interference_signal)
        # Phases of 79 GHz times 100 ns, some 8000 turns, leave 1e-12 of their last digits.
        assert found.whole_db[row, column] == pytest.approx(ratio.whole_db, abs=1e-9)
        assert found.weakest_db[row, column] == pytest.approx(ratio.weakest_db, abs=1e-9)
        # The paths of a short burst are dependent to 1e-7: nine digits of their span are left.
        assert found.coherence[row, column] == pytest.approx(dense_coherence(bench), abs=1e-7)
        unknown, known = bench.bounds()
        loss = 20.0 * np.log10(unknown.root_mean_crlb / known.root_mean_crlb)
        assert found.bound_loss_db[row, column] == pytest.approx(loss, abs=1e-6)


def test_levels_shift_the_condition_and_nothing_else():
    found = analytic_map(make("simulation-2-a", "sir_db=-30:30:4", "snr_db=20:60:3"))
    np.testing.assert_allclose(found.whole_db[1] - found.whole_db[2, 0], [0.0, 20.0, 40.0, 60.0])
    for layer in (found.coherence, found.bound_loss_db):
        assert np.ptp(layer) == 0.0

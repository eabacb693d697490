from dataclasses import replace

import numpy as np
import pytest

from vsep import InputError
from vsep.analysis.burst_model import burst_signal, model_bursts
from vsep.analysis.crlb import dispersion_bound, shared_dispersion_bound, single_line_bound
from vsep.inference.objects.uncertainty import fisher_information
from vsep.presets.scenes import simulate_preset
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.template import SignalModel


def scene(name, *, snr_db=30.0, sir_db=-20.0, seed=0):
    scenario, observation = simulate_preset(name, snr_db=snr_db, sir_db=sir_db, seed=seed)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    truth = observation.truth
    bursts = model_bursts(
        scenario.radar, scenario.scene.interferers, model, truth.interference_signal
    )
    return truth, model, bursts


def test_simulation_1_has_the_stated_bound_and_interference_raises_it_by_a_hundredth_percent():
    truth, model, bursts = scene("simulation-1")
    known = dispersion_bound(truth, model).beats[0]
    unknown = dispersion_bound(truth, model, bursts).beats[0]
    assert known == pytest.approx(4.816e-5, abs=0.5e-8)
    assert known == pytest.approx(single_line_bound(1e3, 256), rel=1e-12)
    # Stated as 0.01 %, to one digit.
    assert unknown / known - 1.0 == pytest.approx(1e-4, abs=0.5e-4)


def mean_signal(parameters, truth, model, bursts):
    """Model (9) as a function of all its real unknowns, written out once more."""
    num_objects = len(truth.beats)
    parts = np.split(parameters[: 4 * num_objects], 4)
    factors = (line_factors(parts[0], model.num_samples), line_factors(parts[1], model.num_ramps))
    signal = synthesize(parts[2] + 1j * parts[3], *factors)
    position = 4 * num_objects
    moved = []
    for burst in bursts:
        num_lines = len(burst.amplitudes)
        start, slope, *weights = parameters[position : position + 2 + 2 * num_lines]
        amplitudes = np.array(weights[:num_lines]) + 1j * np.array(weights[num_lines:])
        moved.append(replace(burst, start_frequency=start, slope=slope, amplitudes=amplitudes))
        position += 2 + 2 * num_lines
    return signal + burst_signal(moved, model)


@pytest.mark.parametrize("name", ["simulation-1", "simulation-2-b"])
def test_the_bound_is_the_inverse_of_a_fisher_information_from_finite_differences(name):
    truth, model, bursts = scene(name, snr_db=40.0)
    # Two bursts are enough, and two of their lines: ten are so alike that the plain inverse of the
    # information matrix below would lose its digits.
    bursts = [
        replace(b, channel_frequencies=b.channel_frequencies[:2], amplitudes=b.amplitudes[:2])
        for b in bursts[:2]
    ]
    columns = [truth.beats, truth.dopplers, truth.amplitudes.real, truth.amplitudes.imag]
    for burst in bursts:
        columns += [[burst.start_frequency, burst.slope]]
        columns += [burst.amplitudes.real, burst.amplitudes.imag]
    parameters = np.concatenate(columns)
    num_objects = len(truth.beats)
    steps = np.full(len(parameters), 1e-6)
    steps[4 * num_objects :] = 1e-5
    for index, _ in enumerate(bursts):
        first = 4 * num_objects + index * (2 + 2 * len(bursts[0].amplitudes))
        steps[first : first + 2] = 1e-7, 1e-9
    gradient = []
    for index, step in enumerate(steps):
        ahead, behind = parameters.copy(), parameters.copy()
        ahead[index] += step
        behind[index] -= step
        difference = mean_signal(ahead, truth, model, bursts)
        difference = difference - mean_signal(behind, truth, model, bursts)
        gradient.append(difference.ravel() / (2.0 * step))
    derivatives = np.array(gradient)
    if model.num_ramps == 1:
        derivatives = np.delete(derivatives, num_objects, axis=0)  # Doppler is not observable
    fisher = 2.0 * truth.noise_precision * (derivatives.conj() @ derivatives.T).real
    # Unit diagonal before the inverse: the parameters differ by ten decades.
    scale = np.sqrt(np.diag(fisher))
    expected = np.sqrt(np.diag(np.linalg.inv(fisher / np.outer(scale, scale)))) / scale
    bound = dispersion_bound(truth, model, bursts)
    # Central differences err by the square of the phase step, (2 pi 256 x 1e-6)^2 / 6 = 4e-7; the
    # information matrix has a condition number of up to 1e6 that magnifies it.
    assert bound.beats == pytest.approx(expected[:num_objects], rel=1e-4)
    if model.num_ramps > 1:
        assert bound.dopplers == pytest.approx(expected[num_objects : 2 * num_objects], rel=1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_many_objects_have_the_bound_that_the_estimators_posterior_reports(seed):
    truth, model, _ = scene("simulation-2-a", snr_db=60.0, seed=seed)
    num_objects = len(truth.beats)
    fisher = fisher_information(
        truth.beats,
        truth.dopplers,
        truth.amplitudes,
        np.zeros(num_objects),
        truth.noise_precision,
        model.shape,
    )
    expected = np.sqrt(np.diag(np.linalg.inv(fisher)))
    bound = dispersion_bound(truth, model)
    # Double precision through a matrix of condition 1e6.
    assert np.concatenate([bound.beats, bound.dopplers]) == pytest.approx(expected, rel=1e-8)


def test_unknown_interference_never_helps():
    truth, model, bursts = scene("simulation-2-c", snr_db=60.0)
    known, unknown = dispersion_bound(truth, model), dispersion_bound(truth, model, bursts)
    assert np.all(unknown.beats > known.beats)
    assert np.all(unknown.dopplers > known.dopplers)
    assert unknown.root_mean_crlb > known.root_mean_crlb


def test_coincident_objects_are_not_observable_and_leave_the_others_alone():
    truth, model, _ = scene("simulation-2-a", snr_db=60.0)
    beats, dopplers = np.array([0.1, 0.1, -0.3]), np.array([0.05, 0.05, 0.2])
    both = replace(
        truth, beats=beats, dopplers=dopplers, amplitudes=np.ones(3, dtype=np.complex128)
    )
    one = replace(both, beats=beats[1:], dopplers=dopplers[1:], amplitudes=both.amplitudes[1:])
    bound = dispersion_bound(both, model)
    assert np.isinf(bound.beats[:2]).all()
    # The twin atoms span one direction less; the far object hardly sees them (sidelobes of -60 dB).
    assert bound.beats[2] == pytest.approx(dispersion_bound(one, model).beats[1], rel=1e-2)


def test_nothing_to_bound():
    truth, model, bursts = scene("simulation-1")
    none = np.zeros(0)
    empty = replace(truth, beats=none, dopplers=none, amplitudes=none.astype(np.complex128))
    bound = dispersion_bound(empty, model, bursts)
    assert len(bound.beats) == 0
    assert np.isnan(bound.root_mean_crlb)
    with pytest.raises(InputError, match="noise_precision"):
        dispersion_bound(replace(truth, noise_precision=float("nan")), model)


@pytest.mark.parametrize("name", ["simulation-1", "simulation-2-a"])
def test_antennas_halve_the_bound_where_there_are_four_of_them(name):
    truth, model, _ = scene(name)
    one = dispersion_bound(truth, model)
    amplitudes = np.repeat(truth.amplitudes[:, None], 4, axis=1)
    four = shared_dispersion_bound(replace(truth, amplitudes=amplitudes), model)
    np.testing.assert_allclose(four.beats, one.beats / 2, rtol=1e-6)
    np.testing.assert_allclose(four.dopplers, one.dopplers / 2, rtol=1e-6)


def test_the_shared_bound_is_the_inverse_of_the_summed_information():
    truth, model, _ = scene("simulation-2-a", seed=3)
    rng = np.random.default_rng(5)
    turned = truth.amplitudes[:, None] * np.exp(2j * np.pi * rng.random((len(truth.beats), 3)))
    bound = shared_dispersion_bound(replace(truth, amplitudes=turned), model)
    none = np.zeros(len(truth.beats))
    fisher = sum(
        fisher_information(
            truth.beats, truth.dopplers, weights, none, truth.noise_precision, model.shape
        )
        for weights in turned.T
    )
    expected = np.sqrt(np.diagonal(np.linalg.inv(fisher)))
    np.testing.assert_allclose(np.append(bound.beats, bound.dopplers), expected, rtol=1e-6)


def test_the_shared_bound_of_nothing_is_empty_and_needs_a_noise_level():
    truth, model, _ = scene("simulation-1")
    nothing = replace(
        truth, beats=np.zeros(0), dopplers=np.zeros(0), amplitudes=np.zeros((0, 4), dtype=complex)
    )
    assert len(shared_dispersion_bound(nothing, model).beats) == 0
    with pytest.raises(InputError, match="noise_precision"):
        shared_dispersion_bound(replace(truth, noise_precision=float("nan")), model)

import numpy as np
import pytest

from vsep.analysis.metrics import (
    error_vector_magnitude,
    frame_errors,
    frame_metrics,
    paired_rms,
    sinr_db,
)
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.scene import GroundTruth

SHAPE = (4, 32)
BEATS, DOPPLERS = np.array([0.1, -0.3]), np.array([0.0, 0.25])


def object_signal(amplitudes):
    factors = line_factors(BEATS, SHAPE[1]), line_factors(DOPPLERS, SHAPE[0])
    return synthesize(np.asarray(amplitudes, dtype=complex), *factors)


def test_errors_are_signed_and_in_the_order_of_the_truths():
    true = np.stack([BEATS, DOPPLERS], axis=1)
    found = true[::-1] + np.array([[3e-4, -4e-4], [-1e-3, 0.0]])
    errors = frame_errors(true, found, SHAPE)
    # 1e-16 is the spacing of the frequencies themselves.
    assert errors.beat_errors == pytest.approx([-1e-3, 3e-4], abs=1e-15)
    assert errors.doppler_errors == pytest.approx([0.0, -4e-4], abs=1e-15)
    assert errors.errors == pytest.approx([1e-3, 5e-4], abs=1e-15)
    assert errors.mean_assigned_error == pytest.approx(7.5e-4, abs=1e-15)
    assert errors.found_indices.tolist() == [1, 0]
    assert (errors.misses, errors.false_alarms) == (0, 0)


def test_the_cell_is_as_wide_as_the_frame_resolves():
    true = np.array([[0.0, 0.0]])
    # 0.9 cells in beat, then 0.9 in both: a Euclidean distance of 1.27 cells.
    assert frame_errors(true, np.array([[0.9 / 32, 0.0]]), SHAPE).misses == 0
    assert frame_errors(true, np.array([[0.9 / 32, 0.9 / 4]]), SHAPE).misses == 1
    assert frame_errors(true, np.array([[0.9 / 32, 0.9 / 4]]), SHAPE, cutoff=1.5).misses == 0


def test_nothing_assigned_has_no_mean_error():
    none = np.zeros((0, 2))
    assert np.isnan(frame_errors(np.zeros((1, 2)), none, SHAPE).mean_assigned_error)
    errors = frame_errors(none, none, SHAPE)
    assert (errors.misses, errors.false_alarms, errors.gospa.value) == (0, 0, 0.0)


def test_sinr_is_the_level_of_what_remains():
    signal = object_signal([1.0, 1.0])
    rest = np.full(SHAPE, np.sqrt(0.01 * np.sum(np.abs(signal) ** 2) / signal.size))
    # Energy ratio 100; rounding of a sum of 128 terms.
    assert sinr_db(signal, signal + rest) == pytest.approx(20.0, abs=1e-10)


def test_error_vector_magnitude_of_a_scaled_signal_is_the_scale():
    signal = object_signal([1.0, 0.01j])
    turned = signal * np.exp(0.1j)
    expected = abs(np.exp(0.1j) - 1.0)
    assert error_vector_magnitude(signal, turned, BEATS, DOPPLERS) == pytest.approx(expected)
    assert error_vector_magnitude(signal, signal, BEATS, DOPPLERS) == 0.0
    assert np.isnan(error_vector_magnitude(signal, signal, np.zeros(0), np.zeros(0)))


def test_pairs_without_a_partner_do_not_count():
    values, reference = np.array([1.0, 2.0, np.nan]), np.array([4.0, np.nan, 1.0])
    assert paired_rms(values, reference) == 3.0
    assert np.isnan(paired_rms(values[2:], reference[2:]))


def test_the_metrics_of_a_frame_are_those_of_its_parts():
    signal = object_signal([1.0, 2.0])
    truth = GroundTruth(
        beats=BEATS,
        dopplers=DOPPLERS,
        amplitudes=np.array([1.0, 2.0], dtype=complex),
        object_signal=signal,
        interference_signal=np.zeros(SHAPE, dtype=complex),
        bursts=(),
        noise_precision=1.0,
    )
    found = np.array([0.1 + 1e-3, 0.4]), np.array([0.0, -0.25])
    metrics = frame_metrics(truth, *found, 1.1 * signal)
    assert (metrics["objects_true"], metrics["objects"]) == (2, 2)
    assert (metrics["misses"], metrics["false_alarms"]) == (1, 1)
    assert metrics["mean_assigned_error"] == pytest.approx(1e-3, abs=1e-15)
    # One pair at 32e-3 cells, one miss and one false alarm at half a cell each.
    assert metrics["gospa"] == pytest.approx(32e-3 + 1.0, abs=1e-12)
    assert metrics["error_vector_magnitude"] == pytest.approx(0.1, abs=1e-12)

"""Algorithm 3: candidates, identities, pruning, and the edges of the frequency range."""

import numpy as np
import pytest

from vsep.inference.core.progress import EventKind
from vsep.inference.objects.workspace import ObjectThreshold, ObjectWorkspace, no_objects

SHAPE = (6, 20)


def atom(point):
    doppler = np.exp(-2j * np.pi * point[1] * np.arange(SHAPE[0]))
    beat = np.exp(-2j * np.pi * point[0] * np.arange(SHAPE[1]))
    return np.kron(doppler, beat) / np.sqrt(SHAPE[0] * SHAPE[1])


def test_single_ramp_keeps_doppler_at_zero():
    rng = np.random.default_rng(2)
    samples = np.arange(64)
    residual = np.exp(-2j * np.pi * 0.2 * samples)[None] + 0.1 * rng.standard_normal((1, 64))
    workspace = ObjectWorkspace(
        no_objects(), residual, 10.0, threshold=ObjectThreshold(10.0), next_id=0
    )
    workspace.add_components(1)
    components = workspace.components()
    assert components.dopplers.tolist() == [0.0]
    # Root CRLB at this SNR is below 1e-3 of a cell; a hundredth of a cell is ten deviations.
    assert components.beats[0] == pytest.approx(0.2, abs=0.01 / 64)


def test_a_frequency_at_the_edge_wraps_around():
    residual = np.exp(-2j * np.pi * 0.4999 * np.arange(64))[None]
    residual = residual + 1e-3 * np.random.default_rng(1).standard_normal((1, 64))
    workspace = ObjectWorkspace(
        no_objects(), residual, 1e4, threshold=ObjectThreshold(10.0), next_id=0
    )
    workspace.add_components(1)
    workspace.update_components()
    beat = workspace.components().beats[0]
    assert -0.5 <= beat < 0.5
    assert abs((beat - 0.4999 + 0.5) % 1.0 - 0.5) < 1e-4


def test_pruning_keeps_the_other_identities():
    rng = np.random.default_rng(4)
    noise = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    strong = 3.0 * atom((0.1, 0.1)) + 3.0 * atom((-0.25, -0.2))
    residual = strong.reshape(SHAPE) + 0.01 * noise
    workspace = ObjectWorkspace(
        no_objects(), residual, 100.0, threshold=ObjectThreshold(10.0), next_id=5
    )
    workspace.add_components(2)
    before = workspace.components()
    assert before.component_ids.tolist() == [5, 6]
    first_gone = residual - (before.amplitudes[0] * atom(workspace.points[0])).reshape(SHAPE)
    again = ObjectWorkspace(before, first_gone, 100.0, threshold=ObjectThreshold(10.0), next_id=7)
    again.update_components()
    assert again.components().component_ids.tolist() == [6]
    assert [event.kind for event in again.events] == [EventKind.OBJECT_PRUNED]
    assert again.events[0].component_id == 5


def test_noise_alone_is_rejected_and_said_so():
    rng = np.random.default_rng(8)
    noise = (rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)) / np.sqrt(2)
    workspace = ObjectWorkspace(
        no_objects(), noise, 1.0, threshold=ObjectThreshold(30.0), next_id=0
    )
    workspace.add_components(1)
    assert workspace.components().num_components == 0
    assert [event.kind for event in workspace.events] == [EventKind.OBJECT_REJECTED]

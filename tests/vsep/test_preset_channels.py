import numpy as np
import pytest

from vsep import InputError
from vsep.parameters import MAX_OBJECTS
from vsep.presets.channels import many_objects, one_object
from vsep.presets.scenes import preset

LEVELS = {"snr_db": 30.0, "sir_db": 0.0}


def drawn(name, **options):
    return preset(name, **LEVELS, rng=np.random.default_rng(3), **options).scene.objects


@pytest.mark.parametrize("name", ["simulation-1", "simulation-2-a"])
def test_more_objects_begin_with_those_of_fewer(name):
    many, few = drawn(name, num_objects=MAX_OBJECTS), drawn(name, num_objects=4)
    usual = drawn(name)
    assert (many.num_paths, few.num_paths) == (MAX_OBJECTS, 4)
    for other in (few, usual):
        count = other.num_paths
        np.testing.assert_array_equal(many.delays_s[:count], other.delays_s)
        np.testing.assert_array_equal(many.weights[:count], other.weights)


def test_further_objects_of_one_ramp_have_the_level_of_their_distance():
    objects = one_object(np.random.default_rng(1), 30)
    metres = objects.delays_s * 299_792_458.0
    level_db = 20.0 * np.log10(np.abs(objects.weights))
    expected = -40.0 * np.log10((metres + 1.0) / (metres[0] + 1.0))
    # Levels are spread by 3 dB; the first object's is 0 dB.
    assert level_db[0] == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.abs(level_db - expected) <= 3.0 + 1e-9)


def test_a_delay_moves_the_first_object_alone():
    usual, moved = drawn("simulation-2-b"), drawn("simulation-2-b", object_delay_s=-1e-7)
    assert moved.delays_s[0] == -1e-7
    np.testing.assert_array_equal(moved.delays_s[1:], usual.delays_s[1:])
    np.testing.assert_array_equal(moved.weights, usual.weights)


def test_the_interference_does_not_depend_on_the_objects():
    few, many = (
        preset("simulation-2-a", **LEVELS, rng=np.random.default_rng(3), num_objects=count).scene
        for count in (2, 30)
    )
    first, second = few.interferers[0].channel, many.interferers[0].channel
    np.testing.assert_array_equal(first.weights, second.weights)


def test_too_many_objects_and_ambiguous_delays_are_refused():
    with pytest.raises(InputError, match="num_objects is 41"):
        many_objects(np.random.default_rng(1), MAX_OBJECTS + 1)
    with pytest.raises(InputError, match="num_objects is 0"):
        drawn("simulation-1", num_objects=0)
    with pytest.raises(InputError, match="object_delay_s is 6e-07 s"):
        drawn("simulation-1", object_delay_s=6e-7)

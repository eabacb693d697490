import numpy as np

from vsep.studies.panels import reference


def test_a_reference_is_dashed_and_has_no_interval():
    line = reference("bound", "bound", np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    assert line.kind == "dashed"
    assert np.isnan(line.low).all()
    assert np.isnan(line.high).all()

"""The measurement operator in its two forms."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.mitigation.sparse.operators import DOMAINS, ExplicitMatrix, MaskedFft, make_operator
from vsep.signal.atoms import line_factors


@pytest.fixture
def mask():
    return np.random.default_rng(0).uniform(size=(6, 10)) < 0.4


def draw(rng, like):
    return rng.standard_normal(like.shape) + 1j * rng.standard_normal(like.shape)


@pytest.mark.parametrize("domain", DOMAINS)
def test_adjoint_is_the_adjoint(domain, mask):
    operator = make_operator(domain, mask, np.complex128)
    rng = np.random.default_rng(1)
    samples = operator.measured(draw(rng, mask))
    spectrum = operator.adjoint(draw(rng, samples))
    image = operator.forward(spectrum)
    left, right = np.vdot(image, samples), np.vdot(spectrum, operator.adjoint(samples))
    # 60 products of numbers near one, each good to 1e-16.
    assert abs(left - right) <= 1e-12 * np.linalg.norm(image) * np.linalg.norm(samples)
    expected = operator.adjoint(samples)
    # In place SciPy's transform may add in another order: 6 stages of numbers near one, 2e-16 each.
    np.testing.assert_allclose(operator.adjoint_of_scratch(samples), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("domain", DOMAINS)
def test_rows_are_orthonormal(domain, mask):
    operator = make_operator(domain, mask, np.complex128)
    samples = operator.measured(draw(np.random.default_rng(2), mask))
    np.testing.assert_allclose(operator.forward(operator.adjoint(samples)), samples, atol=1e-13)


def test_both_forms_are_one_operator(mask):
    masked, explicit = (make_operator(domain, mask, np.complex128) for domain in DOMAINS)
    spectrum = draw(np.random.default_rng(3), mask)
    samples = masked.forward(spectrum)
    np.testing.assert_allclose(explicit.forward(spectrum.ravel()), samples[~mask], atol=1e-13)
    assert not np.any(samples[mask])
    np.testing.assert_allclose(
        explicit.to_map(explicit.adjoint(samples[~mask])), masked.adjoint(samples), atol=1e-13
    )
    assert masked.num_measurements == explicit.num_measurements == np.sum(~mask)


def test_an_object_on_the_grid_is_one_cell():
    # In the paper's sign, exp(-j 2 pi f n): cell k belongs to the frequency k / N.
    atom = np.outer(line_factors(np.array([2 / 6]), 6)[0], line_factors(np.array([3 / 10]), 10)[0])
    spectrum = MaskedFft(np.zeros((6, 10), dtype=bool), np.complex128).adjoint(atom)
    expected = np.zeros((6, 10))
    expected[2, 3] = 1.0
    np.testing.assert_allclose(spectrum, expected, atol=1e-14)


@pytest.mark.parametrize("domain", DOMAINS)
def test_inner_products_are_those_of_the_columns(domain, mask):
    operator = make_operator(domain, mask, np.complex128)
    cells, others = np.array([0, 7, 59, 31]), np.array([12, 7])

    def column(cell):
        unit = np.zeros(mask.shape)
        unit.ravel()[cell] = 1.0
        return MaskedFft(mask, np.complex128).forward(unit)

    expected = [[np.vdot(column(cell), column(other)) for other in others] for cell in cells]
    np.testing.assert_allclose(operator.inner_products(cells, others), expected, atol=1e-14)


@pytest.mark.parametrize("domain", DOMAINS)
def test_single_precision_stays_single(domain, mask):
    operator = make_operator(domain, mask, np.complex64)
    samples = operator.measured(np.ones(mask.shape, dtype=np.complex64))
    spectrum = operator.adjoint(samples)
    assert samples.dtype == spectrum.dtype == operator.forward(spectrum).dtype == np.complex64


def test_what_interfered_samples_hold_plays_no_part(mask):
    frame = np.where(mask, np.nan, 1.0 + 1j)
    assert np.all(np.isfinite(MaskedFft(mask, np.complex128).measured(frame)))


def test_a_matrix_that_would_not_fit_is_refused():
    with pytest.raises(InputError, match=r"256 x 128 samples.*at most 67108864"):
        ExplicitMatrix(np.zeros((256, 128), dtype=bool), np.complex64)


def test_an_unknown_domain_is_refused(mask):
    with pytest.raises(InputError, match="domain is 'cube'; it must be masked-2d or explicit-1d"):
        make_operator("cube", mask, np.complex128)

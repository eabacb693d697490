import pytest
from vsep_app.model.compare_settings import (
    CompareSettings,
    method_entries,
    parse_choice,
    require_distinct,
)

from vsep.errors import InputError
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.registry import MITIGATIONS


def test_every_registered_method_can_be_compared():
    assert {entry.name for entry in method_entries()} == {*MITIGATIONS, *ESTIMATORS}
    assert set(CompareSettings().methods) <= {entry.name for entry in method_entries()}


@pytest.mark.parametrize(
    ("methods", "sentence"),
    [
        (["iht"], "number of methods is 1"),
        (["iht", "ist", "omp", "amp", "gamp"], "number of methods is 5"),
        (["iht", "iht"], "iht is chosen twice"),
        (["iht", "magic"], "method is 'magic'"),
    ],
)
def test_what_is_no_comparison_is_refused_in_a_sentence(methods, sentence):
    with pytest.raises(InputError, match=sentence):
        require_distinct(methods)


def test_an_address_chooses_and_what_is_wrong_in_it_is_told():
    query = {"methods": "omp,masked", "mask": "residual", "debias": True, "snr": 3}
    chosen = {"methods": ["omp", "masked"], "mask": "residual", "debias": True}
    assert parse_choice(query) == (chosen, [])
    values, errors = parse_choice({"methods": "omp", "mask": "guess", "debias": "maybe"})
    assert values == {}
    assert [sentence.split(" is ")[1].split(";")[0] for sentence in errors] == [
        "1",
        "guess",
        "maybe",
    ]

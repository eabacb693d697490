"""`vsep.recordings.settings`: what a settings file may say, and how it is told that it may not."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vsep.errors import InputError
from vsep.recordings.settings import MAX_FILE, parse_settings, read_settings

NEEDED = {
    "format": "npy",
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 3e13,
    "sample_rate_hz": 1e7,
    "ramp_period_s": 1e-4,
}
YAML = """\
format: dca1000-xwr16xx   # an AWR1642
start_frequency_hz: 77e9
slope_hz_per_s: 29.982e12
sample_rate_hz: 10000000
ramp_period_s: 6.0e-5
num_samples: 256
axes:
"""


def told(path: Path, content: str | bytes) -> str:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        read_settings(str(path))
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 500
    assert path.name in text
    return text


def test_yaml_and_json_say_the_same(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(YAML)
    stored = {
        "format": "dca1000-xwr16xx",
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": 29.982e12,
        "sample_rate_hz": 1e7,
        "ramp_period_s": 6e-5,
        "num_samples": 256.0,
    }
    (tmp_path / "b.json").write_text(json.dumps(stored))
    settings = read_settings(str(tmp_path / "a.yaml"))
    assert settings == read_settings(str(tmp_path / "b.json"))
    # YAML 1.1 takes a number without a point and a signed exponent for a text.
    assert settings.start_frequency_hz == 77e9
    assert type(settings.num_samples) is int


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"formt": "npy"}, "'formt' is no setting; did you mean format?"),
        ({"zzz": 1}, "'zzz' is no setting; did you mean format, start_frequency_hz"),
        ({"format": "wav"}, "format is 'wav'; it must be one of npz, npy"),
        ({"format": 3}, "format is 3; a text is needed"),
        ({"format": "tsw1400"}, "num_samples is not given"),
        ({"sign": "plus"}, "sign is 'plus'; it must be one of positive, negative"),
        ({"sample_rate_hz": "fast"}, "sample_rate_hz is 'fast'; a finite number"),
        ({"sample_rate_hz": True}, "sample_rate_hz is True; a finite number"),
        ({"sample_rate_hz": [1e7]}, "sample_rate_hz is a list; a finite number"),
        ({"sample_rate_hz": {"a": 1}}, "sample_rate_hz is a group of settings"),
        ({"sample_rate_hz": float("nan")}, "sample_rate_hz is nan; a finite number"),
        ({"slope_hz_per_s": 10**400}, "slope_hz_per_s is 1000000"),
        ({"num_samples": 12.5}, "num_samples is 12.5; a whole number"),
        ({"num_ramps": 0}, "num_ramps is 0; it must lie between"),
        ({"num_antennas": -1}, "num_antennas is -1; it must lie between"),
        ({"num_transmitters": 1000}, "num_transmitters is 1000; it must lie between"),
        ({"adc_bits": 13}, "adc_bits is '13'; it must be one of 12, 14, 16"),
        ({"frame": -1}, "frame is -1; it must lie between"),
        ({"adc_start_s": -1e-6}, "adc_start_s is -1e-06 s; it must lie between"),
    ],
)
def test_a_wrong_value_is_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_settings(NEEDED | changes)
    assert words in str(caught.value)


@pytest.mark.parametrize("name", NEEDED)
def test_a_missing_value_is_named(name: str) -> None:
    with pytest.raises(InputError, match=f"{name} is not given; needed are format"):
        parse_settings({key: value for key, value in NEEDED.items() if key != name})


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.json", '{"format": "npy",}', "no JSON: "),
        ("a.json", "[" * 60000, "plain name: value"),
        ("a.json", "[1]", "holds no settings"),
        ("a.json", "", "no JSON"),
        ("a.yaml", "a: [", "no YAML: something is wrong in line 1"),
        ("a.yaml", "{" * 20000, "."),
        ("a.yaml", "", "holds no settings"),
        ("a.yaml", "!!python/object/apply:os.system ['true']", "no YAML"),
        ("a.yaml", "2 : 3", "'2' is no setting"),
        ("a.yaml", "? [1, 2]\n: 3", "no YAML"),
        ("a.yml", "sample_rate_hz: 2020-01-01", "format is not given"),
        ("a.txt", "format: npy", "suffix '.txt'; it must be .json, .yaml or .yml"),
        ("a.json", b"\xff\xfe\x00", "no text in UTF-8"),
        ("a.json", " " * (MAX_FILE + 1), "larger than 65536 bytes"),
    ],
)
def test_a_file_that_is_none_is_told(
    tmp_path: Path, name: str, content: str | bytes, words: str
) -> None:
    assert words in told(tmp_path / name, content)


def test_aliases_that_would_grow_are_not_followed(tmp_path: Path) -> None:
    lines = ["a: &a0 [x]"] + [f"b{i}: &a{i + 1} [*a{i}, *a{i}, *a{i}]" for i in range(40)]
    assert "refers to parts of itself" in told(tmp_path / "a.yaml", "\n".join(lines))
    wide = "\n".join(["sample_rate_hz: &a0 [x]", *lines[1:]])
    assert "refers to parts of itself" in told(tmp_path / "a.yaml", wide)


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.json does not exist"):
        read_settings(str(tmp_path / "nowhere.json"))


def test_yaml_without_its_library_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yaml", None)
    assert "it needs yaml: pip install 'vsep[yaml]'" in told(tmp_path / "a.yaml", YAML)


@given(
    st.dictionaries(
        st.sampled_from([*NEEDED, "num_samples", "axes", "key", "frame"]),
        st.none()
        | st.booleans()
        | st.integers()
        | st.floats()
        | st.text(max_size=20)
        | st.lists(st.integers(), max_size=2),
    )
)
def test_any_values_make_settings_or_one_sentence(changes: dict[str, Any]) -> None:
    sentence = ""
    try:
        parse_settings(NEEDED | changes)
    except InputError as error:
        sentence = str(error)
    assert len(sentence) < 500

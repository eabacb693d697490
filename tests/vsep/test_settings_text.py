"""`vsep.recordings.settings_text`: settings as lines that a person edits."""

import pytest

from vsep.errors import InputError
from vsep.recordings.settings_text import settings_text, values_of, with_value


def test_lines_say_what_they_were_made_of() -> None:
    values = {"format": "npy", "slope_hz_per_s": 2.9306e13, "ramp_period_s": 2.956e-05}
    values |= {"num_samples": 512, "key": None, "start_frequency_hz": 77.123456789e9}
    again = values_of(settings_text(values))
    # YAML takes a number without a point for a text; it is a number all the same.
    assert {key: float(again[key]) for key in ("slope_hz_per_s", "start_frequency_hz")} == {
        key: values[key] for key in ("slope_hz_per_s", "start_frequency_hz")
    }
    assert again["key"] is None
    assert list(again) == list(values)


def test_a_value_is_set_in_its_line_and_remarks_stay() -> None:
    text = "format: npy\nsign: positive  # guessed\n# as printed on the box\nframe: 2"
    changed = with_value(text, "frame", 3)
    assert changed == text.replace("frame: 2", "frame: 3")
    assert with_value(changed, "axes", "ramps,samples") == changed + "\naxes: ramps,samples\n"
    assert with_value("", "frame", 1) == "frame: 1\n"


def test_a_text_in_braces_becomes_lines() -> None:
    assert with_value("{format: npy, frame: 2}", "frame", 5) == "format: npy\nframe: 5\n"


def test_what_is_no_settings_is_one_sentence() -> None:
    with pytest.raises(InputError, match=r"cannot be read: settings.yaml is no YAML"):
        values_of("format: [npy")
    with pytest.raises(InputError, match="lines of name: value"):
        with_value("only words", "frame", 1)

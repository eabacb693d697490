"""Questions with a number for an answer, and the bars of a class."""

import pytest
from vsep_app.server.lesson import Answer
from vsep_app.teaching.experiment import read_experiment
from vsep_app.teaching.histogram import MOST_BARS, bars, histogram_html
from vsep_app.teaching.question import QUANTITIES, Question, number_of, read_question

from vsep.errors import InputError

TEXTS = "\n".join(f'{key} = "x"' for key in ("title", "setting", "question", "watch", "answer"))
ASKED = {"text": "How many ramps?", "quantity": "bursts"}


@pytest.fixture(scope="module")
def scene(many_ramps):
    return many_ramps.prepared.static_picture


def test_numbers_are_judged_by_the_truth_of_the_seed(scene):
    truth = scene.observation.truth
    hit = len({burst.ramp for burst in truth.bursts})
    asked = Question(**ASKED)
    assert [asked.is_right(hit + error, scene) for error in (-1, 0, 1)] == [False, True, False]
    ranges = abs(scene.radar.range_from_beat(truth.beats))
    nearest = Question(text="Where?", quantity="nearest", tolerance=0.5)
    assert nearest.is_right(ranges.min() + 0.4, scene)
    assert not nearest.is_right(ranges.min() + 0.6, scene)
    assert nearest.unit == "m"
    strongest = Question(text="Where?", quantity="strongest", tolerance=1e-6)
    assert strongest.is_right(
        scene.radar.range_from_beat(truth.beats[abs(truth.amplitudes).argmax()]), scene
    )


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_of_a_scene_without_truth_nobody_knows(quantity, scene):
    bare = type(scene)(**{**scene.__dict__, "true_objects": _without(scene.true_objects)})
    assert Question(text="?", quantity=quantity).is_right(1.0, bare) is None


def _without(objects):
    return type(objects)(
        **{name: value[:0] for name, value in vars(objects).items() if value is not None}
    )


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("seven", "is no table"),
        ({**ASKED, "hint": "x"}, "it may have text, quantity, tolerance"),
        ({"quantity": "bursts"}, "has no text"),
        ({**ASKED, "quantity": "moons"}, "it must be for one of objects, bursts"),
        ({**ASKED, "tolerance": -1}, "a number between 0 and"),
        ({**ASKED, "tolerance": True}, "a number between 0 and"),
    ],
)
def test_a_bad_question_is_one_sentence(content, told):
    with pytest.raises(InputError, match=told):
        read_question(content)


def test_an_experiment_asks_one_thing(tmp_path):
    file = tmp_path / "mine.toml"
    ask = '\n[ask]\ntext = "How many?"\nquantity = "objects"\n'
    file.write_text(TEXTS + ask)
    assert read_experiment(file).ask == Question(text="How many?", quantity="objects")
    predict = '\n[[predict]]\ntext = "a"\nfound = 1\n[[predict]]\ntext = "b"\nfound = 2\n'
    file.write_text(TEXTS + predict + ask)
    with pytest.raises(InputError, match="one question is enough"):
        read_experiment(file)


def test_a_number_is_typed_with_a_comma_or_a_point():
    assert [number_of(text) for text in ("4", " -1,5 ", "nan", "", "1e7")] == [
        4.0,
        -1.5,
        None,
        None,
        None,
    ]


def test_numbers_of_a_class_make_so_many_bars(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(TEXTS + '\n[ask]\ntext = "How <many>?"\nquantity = "nearest"\n')
    asked = read_experiment(file)
    few = {str(n): Answer(float(n % 3)) for n in range(9)}
    assert bars(asked, few) == [("0", 3), ("1", 3), ("2", 3)]
    many = {str(n): Answer(float(n), n == 4) for n in range(100)}
    assert len(bars(asked, many)) == MOST_BARS
    assert sum(count for _, count in bars(asked, many)) == 100
    html = histogram_html(asked, many, with_right=True)
    assert "How &lt;many&gt;? [m]" in html
    assert "100 answers, 1 of 100 judged are right" in html

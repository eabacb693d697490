import re

from vsep_app.jobs.tasks import compose
from vsep_app.model.text import LogLine
from vsep_app.views.timeline import timeline_html
from vsep_app.widgets.headline import Headline
from vsep_app.widgets.keys import Keys

from tests.app.conftest import FinishedRun


def test_beads_stand_at_their_iterations_and_name_what_happened() -> None:
    lines = [
        LogLine(iteration=5, text="object added at 3.0 m", kind="added"),
        LogLine(iteration=5, text="object added at <4> m", kind="added"),
        LogLine(iteration=10, text="burst found in ramp 2", kind="burst"),
        LogLine(iteration=12, text="paths", kind="quiet"),
    ]
    html = timeline_html(lines, shown=10, num_iterations=40)
    assert html.count("<i ") == 2
    assert 'data-press="iteration 5" style="left:12.50%"' in html
    assert "object added at 3.0 m; object added at &lt;4&gt; m" in html
    assert '<span class="here" style="left:25.00%">' in html


def test_beads_of_later_iterations_stay_when_an_earlier_one_is_shown(
    many_ramps: FinishedRun,
) -> None:
    headline = Headline()

    def beads(num_steps: int | None) -> int:
        headline.show(compose(many_ramps.snapshot(num_steps), 0, "level"), is_first=False)
        return len(re.findall("<i ", headline.text.object))

    last = beads(None)
    assert beads(3) == last > 3
    headline.tell("Let go.")
    assert "<i " not in headline.text.object


def test_only_what_the_page_knows_is_pressed() -> None:
    pressed: list[str] = []
    keys = Keys(pressed.append)
    for name in (
        "toggle",
        "iteration 12",
        "predict 1",
        "iteration -1",
        "predict 99",
        "page compare",
        "page compare?seed=3",
        "page compare\n",
        "page ../etc/passwd",
        "close",
        "__init__",
    ):
        keys.pressed.data = {"name": [name], "number": [len(pressed)]}
    assert pressed == ["toggle", "iteration 12", "predict 1", "page compare"]
    keys.went.data = {"page": ["compare"], "search": ["?seed=3"], "number": [1]}
    keys.went.data = {"page": ["../etc"], "search": [""], "number": [2]}
    assert pressed[3:] == ["page compare", "page compare?seed=3"]

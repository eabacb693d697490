"""The bar of a long run tells the truth, and nothing where nobody looks."""

import io
import re

from vsep_app.cli.progress import IterationProgress

from tests.benchmarks.scenes import preset_problem
from vsep.inference.core.run import iterate

LINE = re.compile(
    r"frame: (\d+) of at most 40 iterations \|([^|\r]*)\| [^\r]*?, (\d+) objects, (\d+) bursts"
)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def shown(stream, **options):
    problem = preset_problem("simulation-2-a", 60.0, -20.0)
    bar = IterationProgress(40, stream=stream, **options)
    bar.begin("frame")
    states = []
    for step in iterate(problem.separator, problem.received):
        bar.show(step)
        states.append(step.state)
    bar.end()
    return states


def test_the_bar_says_where_the_run_is():
    terminal = Terminal()
    states = shown(terminal, delay_s=0.0, interval_s=0.0)
    lines = [match.groups() for match in LINE.finditer(terminal.getvalue())]
    assert {int(iteration) for iteration, *_ in lines} == set(range(1, len(states) + 1))
    for iteration, bar, objects, bursts in lines:
        state = states[int(iteration) - 1]
        assert (int(objects), int(bursts)) == (state.objects.num_components, len(state.bursts))
        full = sum(bar.count(block) for block in "█#") / len(bar)
        assert abs(full - state.iteration / 40) <= 1.0 / len(bar)


def test_a_run_that_is_over_soon_shows_none():
    terminal = Terminal()
    shown(terminal, delay_s=60.0)
    assert "iterations" not in terminal.getvalue()


def test_nothing_is_written_where_there_is_no_terminal():
    stream = io.StringIO()
    shown(stream, delay_s=0.0)
    assert stream.getvalue() == ""

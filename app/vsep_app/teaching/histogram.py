"""Answers of a class as bars, one for each choice or for each part of the numbers."""

from collections.abc import Mapping, Sequence
from html import escape
from itertools import pairwise

import numpy as np

from vsep_app.server.lesson import Answer
from vsep_app.teaching.experiment import Experiment

MOST_BARS = 8
"""Of numbers; fewer if there are few of them."""


def bars(experiment: Experiment, answers: Mapping[str, Answer]) -> list[tuple[str, int]]:
    """Return the name and the height of each bar.

    Examples
    --------
    >>> from vsep_app.teaching.experiment import shipped_experiments
    >>> given = {"a": Answer(0.0), "b": Answer(0.0), "c": Answer(2.0)}
    >>> [count for _, count in bars(shipped_experiments()[0], given)]
    [2, 0, 1]
    """
    values = [answer.value for answer in answers.values()]
    choices = experiment.staging.predictions
    if experiment.ask is None:
        return [(each.text, values.count(place)) for place, each in enumerate(choices)]
    different = sorted(set(values))
    if len(different) <= MOST_BARS:
        return [(f"{value:g}", values.count(value)) for value in different]
    counts, edges = np.histogram(values, bins=MOST_BARS)
    names = [f"{a:.3g} to {b:.3g}" for a, b in pairwise(edges)]
    return list(zip(names, counts.tolist(), strict=True))


def histogram_html(
    experiment: Experiment, answers: Mapping[str, Answer], *, with_right: bool
) -> str:
    """Return the question, the bars and, if wanted, how many are right."""
    rows = bars(experiment, answers)
    most = max((count for _, count in rows), default=0) or 1
    lines = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td class="bar">'
        f'<span style="width:{100.0 * count / most:.0f}%"></span></td><td>{count}</td></tr>'
        for name, count in rows
    )
    told = [f"{len(answers)} answers"]
    if with_right:
        right = sum(answer.is_right is True for answer in answers.values())
        judged = sum(answer.is_right is not None for answer in answers.values())
        told.append(f"{right} of {judged} judged are right")
    question = experiment.title if experiment.ask is None else experiment.ask.text
    unit = "" if experiment.ask is None else experiment.ask.unit
    named = f"{escape(question)}{f' [{escape(unit)}]' if unit else ''}"
    return (
        f'<section class="answers"><h3>{named}</h3><table>{lines}</table>'
        f"<p>{', '.join(told)}</p></section>"
    )


def asking(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Return the experiments that ask for an answer."""
    return [one for one in experiments if one.ask is not None or one.staging.predictions]

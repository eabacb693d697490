"""Replay of runs: one HTML file in which a slider goes through every iteration.

The views are given every picture of the run, and what their sources then hold is kept; the page's
script hands it back to them. So the record shows what the dashboard would, and knows nothing of
what the views are made of. Long curves are kept as whole numbers between their extremes, each as
its difference from the one before, which packs well; maps as the bytes they are, and everything
that is the same twice only once.
"""

import base64
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from html import escape
from typing import Any

import numpy as np
from bokeh.models import BoxAnnotation, ColorBar, ColumnDataSource, Range1d

from vsep.files.results import as_json
from vsep_app.assets import path
from vsep_app.figures.document import document_html
from vsep_app.model.picture import Picture
from vsep_app.report.page import ReportViews, found, page_variables
from vsep_app.report.run import ReportRun
from vsep_app.report.variations import VariedSetting
from vsep_app.views.tables import layers_html, table_html

MAX_VIEWS = 232
"""Iterations times ramps, of all runs: what keeps Simulation II below 1 MB."""
MAX_ITERATIONS = 44
"""Of several runs together: each has a map of its own, which is most of what it takes."""
SHORT_CURVE = 48
LEVELS = 766
"""Steps of a long curve between its least and its largest value; one more code means undefined."""
_UNDEFINED = -1024


class Replay:
    """Collects values, each once; what is kept is addressed by a number."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self._numbers: dict[str, int] = {}

    def keep(self, value: Any) -> int:
        """Return the number of a value, which is data for JSON."""
        key = json.dumps(value)
        if key not in self._numbers:
            self._numbers[key] = len(self.values)
            self.values.append(value)
        return self._numbers[key]


def record_html(
    runs: Sequence[ReportRun], varied: Sequence[VariedSetting] = (), *, guide: str = ""
) -> str:
    """Return recorded runs as one HTML document that asks for nothing else.

    Parameters
    ----------
    runs : sequence of ReportRun
        One, or one for every combination of the varied settings, the last of which varies fastest.
    varied : sequence of VariedSetting
        Each gets a slider.
    guide : str
        HTML that stands above the run.
    """
    first = runs[0]
    several = first.static_picture.radar.num_ramps > 1
    views = ReportViews(several=several)
    frames = [recorded_iterations(len(run.steps), len(runs)) for run in runs]
    # Of several runs nothing is told twice, so that there is room for fewer ramps.
    room = MAX_VIEWS // (sum(map(len, frames)) * (1 if len(runs) == 1 else 4))
    last = _last_picture(first, 0)
    views.update(last)
    replays = {"values": Replay(), "versions": Replay(), "tables": Replay()}
    players, scales = _players(views.plots), _scales(views.plots)
    recorded = [
        _recorded(run, number, views, (players, scales), replays, frames=own, room=room)
        for number, (run, own) in enumerate(zip(runs, frames, strict=True))
    ]
    views.update(last)
    replay = {
        "players": [player.id for player in (*players, *scales)],
        "values": replays["values"].values,
        "versions": replays["versions"].values,
        "tables": replays["tables"].values,
        "runs": recorded,
        "varied": [asdict(each) for each in varied],
    }
    return document_html(
        views.plots,
        template="record.html",
        title=f"vsep: {first.static_picture.title}, recorded",
        variables={
            **page_variables(first, last),
            "guide": guide,
            "replay": as_json(replay).replace("<", "\\u003c"),
            "script": path("report/record.js").read_text(encoding="utf-8"),
            "last": len(frames[0]) - 1,
            "varied": [asdict(each) for each in varied],
            "several": several,
        },
    )


def _last_picture(run: ReportRun, number: int) -> Picture:
    return replace(run.picture(), run_number=number)


def _recorded(
    run: ReportRun,
    number: int,
    views: ReportViews,
    models: tuple[Sequence[Any], Sequence[Any]],
    replays: Mapping[str, Replay],
    *,
    frames: Sequence[int],
    room: int,
) -> dict[str, Any]:
    """Return what is played of a run: its pictures by iteration and ramp, and its words."""
    several = run.static_picture.radar.num_ramps > 1
    players, scales = models
    ramps = recorded_ramps(run, room)
    last = _last_picture(run, number)
    # Axes only grow within a run: after the last picture they hold all of them.
    views.update(last)
    axes = [_set(replays, len(players) + n, _scale(each)) for n, each in enumerate(scales)]
    shown = []
    for i in frames:
        seen = []
        for ramp in ramps:
            picture = replace(run.picture(i, ramp), run_number=number)
            # A clean slate: a view draws the map as received once a scene only.
            views.update(picture)
            seen.append([_version(player, n, replays) for n, player in enumerate(players)])
        table = table_html(picture.table, moving=several) + layers_html(picture)
        shown.append(
            {
                "versions": seen,
                "table": replays["tables"].keep(table),
                "status": status(picture, len(run.steps)),
            }
        )
    words = page_variables(run, last)
    return {
        "axes": axes,
        "iterations": shown,
        "numbers": list(frames),
        "ramps": ramps,
        "ramp": ramps.index(run.ramp),
        "levels": words["levels"],
        "events": replays["tables"].keep(words["log"]),
        "log": [line.iteration for line in reversed(last.log) if line.kind != "quiet"],
    }


def recorded_iterations(last: int, num_runs: int) -> list[int]:
    """Return the iterations that a record shows: all of a single run, else more of the first ones.

    Examples
    --------
    >>> recorded_iterations(14, 1) == list(range(15))
    True
    >>> recorded_iterations(14, 9)
    [0, 1, 5, 14]
    """
    room = max(2, MAX_ITERATIONS // num_runs)
    if num_runs == 1 or last < room:
        return list(range(last + 1))
    places = np.geomspace(1.0, last + 1.0, room) - 1.0
    return sorted({round(place) for place in places.tolist()})


def recorded_ramps(run: ReportRun, room: int) -> list[int]:
    """Return the ramps that a record shows: with bursts, strongest first, as many as find room."""
    energies = (np.abs(run.seen.interference_signal) ** 2).sum(axis=1)
    hit = run.static_picture.true_ramps | (energies > 0.0)
    hit[run.ramp] = True
    order = [int(ramp) for ramp in np.argsort(-energies, kind="stable") if hit[ramp]]
    return sorted([run.ramp, *(ramp for ramp in order if ramp != run.ramp)][: max(1, room)])


def status(picture: Picture, last: int) -> str:
    """Say in one line where a run is."""
    ended = f", {picture.termination.name.lower()}" if picture.iteration == last else ""
    return f"iteration {picture.iteration} of {last}{ended}: {found(picture)}"


def encoded(column: Any) -> Any:
    """Return a column of a source as data for JSON; `decode` of the script is the inverse.

    Parameters
    ----------
    column : array or list
        A long curve becomes whole numbers, exact to half of 1/766 of its span; a list that
        holds one map becomes its bytes; a short column becomes 32-bit numbers.
    """
    if isinstance(column, np.ndarray):
        return _encoded_curve(column)
    if len(column) == 1 and isinstance(column[0], np.ndarray):
        return {"kind": "map", "data": _text(column[0])}
    return {"kind": "list", "data": [_plain(value) for value in column]}


def _encoded_curve(column: "np.ndarray[Any, np.dtype[Any]]") -> dict[str, Any]:
    finite = np.isfinite(column)
    if len(column) <= SHORT_CURVE or not finite.any():
        return {"kind": "short", "data": _text(column.astype("<f4"))}
    lowest, highest = float(column[finite].min()), float(column[finite].max())
    step = (highest - lowest) / LEVELS or 1.0
    codes = np.full(len(column), _UNDEFINED)
    codes[finite] = np.round((column[finite].astype(np.float64) - lowest) / step)
    differences = np.diff(codes, prepend=0).tolist()
    return {"kind": "curve", "data": differences, "lowest": lowest, "step": step}


def _text(array: "np.ndarray[Any, np.dtype[Any]]") -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _players(plots: Sequence[Any]) -> list[Any]:
    """Return all that changes in a run: sources, titles, and the frame around the ramp shown."""
    sources: Iterable[Any] = (s for plot in plots for s in plot.select({"type": ColumnDataSource}))
    unique = {source.id: source for source in sources}
    frames = [item for plot in plots for item in plot.center if isinstance(item, BoxAnnotation)]
    titles = [plot.title for plot in plots]
    return [unique[key] for key in sorted(unique, key=lambda key: int(key[1:]))] + titles + frames


def _version(player: Any, number: int, replays: Mapping[str, Replay]) -> int:
    """Keep what a player shows now, and return its number."""
    if isinstance(player, ColumnDataSource):
        columns = {
            name: replays["values"].keep(encoded(column)) for name, column in player.data.items()
        }
        return replays["versions"].keep([number, "data", columns])
    if isinstance(player, BoxAnnotation):
        return _set(replays, number, {"left": player.left, "right": player.right})
    return _set(replays, number, {"text": escape(player.text, quote=False)})


def _set(replays: Mapping[str, Replay], number: int, values: Mapping[str, Any]) -> int:
    return replays["versions"].keep([number, "set", dict(values)])


def _scales(plots: Sequence[Any]) -> list[Any]:
    """Return what changes between runs only: ranges of axes, and levels of the colours."""
    ranges = [each for plot in plots for each in (plot.x_range, plot.y_range)]
    bars = [bar.color_mapper for plot in plots for bar in plot.select({"type": ColorBar})]
    numeric = [each for each in ranges if isinstance(each, Range1d)]
    return [*{each.id: each for each in (*numeric, *bars)}.values()]


def _scale(model: Any) -> dict[str, Any]:
    ends = ("start", "end", "reset_start", "reset_end") if isinstance(model, Range1d) else ()
    return {name: getattr(model, name) for name in ends or ("low", "high")}

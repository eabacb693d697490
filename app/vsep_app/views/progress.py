"""Evidence lower bound, noise power and condition (27) over iterations."""

import numpy as np
from bokeh.models import ColumnDataSource, Span
from bokeh.plotting import figure

from vsep_app.model.picture import Picture
from vsep_app.views.style import COLOURS, Axis, lighten, plain_figure, short

SHOWN_ITERATIONS = 20
_CURVES = (
    ("elbo", "evidence lower bound, ELBO [nats]", "object"),
    ("noise_db", "noise power [dB]", "received"),
    ("ratio_db", "separability, ratio of condition (27) [dB]", "interference"),
)
_NO_RATIO = "separability: no burst is modelled, so there is no ratio"


class ProgressView:
    """Three small curves with a common iteration axis; their axes only ever grow in a run."""

    def __init__(self) -> None:
        self._x = Axis()
        self._y = {name: Axis() for name, *_ in _CURVES}
        self._source = ColumnDataSource({name: [] for name in ("iteration", *self._y)})
        self._run_number = -1
        self._unset: set[str] = set()
        self.figures: tuple[figure, ...] = tuple(
            self._figure(name, label, role) for name, label, role in _CURVES
        )
        self.figures[-1].xaxis.axis_label = "iteration"
        for plot in self.figures[:-1]:
            plot.xaxis.visible = False

    def _figure(self, name: str, label: str, role: str) -> figure:
        axes = self._x, self._y[name]
        plot = plain_figure(f"progress-{name}", label, ("", ""), axes, tools=False)
        plot.min_border_left = 52
        plot.yaxis.ticker.desired_num_ticks = 3
        plot.yaxis.formatter.use_scientific = False
        plot.line("iteration", name, source=self._source, color=COLOURS[role], line_width=1.8)
        plot.scatter("iteration", name, source=self._source, color=COLOURS[role], size=4)
        lighten(plot)
        if name == "ratio_db":
            plot.add_layout(
                Span(location=0.0, dimension="width", line_dash=[4, 4], line_color="#8C8C8C")
            )
        return plot

    def update(self, picture: Picture) -> None:
        """Draw another picture."""
        progress = picture.progress
        fresh = picture.run_number != self._run_number or picture.iteration == 0
        if fresh:
            self._unset = set(self._y)
        self._run_number = picture.run_number
        last = max(picture.num_iterations, 1)
        blocks = int(np.ceil((last + 1) / SHOWN_ITERATIONS))
        self._x.grow((0.0, float(blocks * SHOWN_ITERATIONS)), fresh=fresh)
        columns = {name: getattr(progress, name) for name in self._y}
        for name, axis in self._y.items():
            limits = _padded(columns[name])
            if limits is not None:
                axis.grow(limits, fresh=name in self._unset)
                self._unset.discard(name)
        known = bool(np.isfinite(progress.ratio_db).any()) or not progress.ratio_db.size
        self.figures[-1].title.text = _CURVES[-1][1] if known else _NO_RATIO
        self._source.data = {
            "iteration": short(progress.iterations),
            **{name: short(column) for name, column in columns.items()},
        }


def _padded(
    values: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
) -> tuple[float, float] | None:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return None
    lowest, highest = float(finite.min()), float(finite.max())
    margin = max(0.12 * (highest - lowest), 1.0)
    return lowest - margin, highest + margin

"""Tables of the document on mitigation, from those of the reproduction.

As a script it writes them into the document, each in the place of the one with the same head:

    python tests/vsep/mitigation_tables.py
"""

import csv
from math import isfinite
from pathlib import Path

ASSETS = Path(__file__).parents[2] / "assets"
FOLDER, DOCUMENT = ASSETS / "results" / "reproduction", ASSETS / "docs" / "mitigation.md"
SPARSE = ("ist", "iht-plain", "iht", "omp", "cosamp", "fista", "amp", "gamp", "yall1")
REPAIRS = {
    "without interference": "no-interference",
    "zeroing": "zeroing",
    "blanking, edges of 4 samples": "blanking",
    "linear": "linear",
    "slow-time": "slow-time",
    "autoregressive, order 8": "autoregressive",
    "noise-canceller": "noise-canceller",
    "mca, per ramp": "mca",
    "mca-unmasked, per ramp": "mca-unmasked",
    "mca-2d": "mca-2d",
}


class Figures:
    """Figures of one table of the reproduction."""

    def __init__(self, name):
        with (FOLDER / f"{name}.csv").open(newline="", encoding="utf-8") as file:
            self._rows = list(csv.DictReader(file))

    def point(self, **parameters):
        """Index of the point of these parameters."""
        (index,) = {
            row["point_index"]
            for row in self._rows
            if all(same(row[name], value) for name, value in parameters.items())
        }
        return index

    def text(self, method, metric, point, digits=1, *, interval=True, scale=1.0):
        """A figure with its interval."""
        (row,) = (
            row
            for row in self._rows
            if (row["method"], row["metric"], row["point_index"]) == (method, metric, point)
        )
        value, low, high = (scale * float(row[end] or "nan") for end in ("value", "low", "high"))
        text = f"{value:.{digits}f}"
        if interval and isfinite(low):
            text += f" [{low:.{digits}f}, {high:.{digits}f}]"
        return text.replace("-", "\N{MINUS SIGN}")


def same(cell, value):
    """Whether a cell of a file holds a value."""
    return (
        cell == value
        if isinstance(value, str)
        else cell not in ("", None)
        and (cell == str(value) or (not isinstance(value, bool) and float(cell) == value))
    )


def table(head, lines):
    """Text of a table."""
    rule = ["---"] * len(head)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, rule, *lines))


def tables():
    """All tables of the document."""
    return [*_of_repairs(), _of_detectors(), *_of_sequences(), *_of_solvers(), _of_sizes()]


def _of_repairs():
    repairs = Figures("repairs")
    points = [
        repairs.point(panel=panel, rolled_ramps=rolled)
        for panel in ("cut", "as simulated")
        for rolled in (0, 4)
    ]
    yield table(
        ["Simulation II, SNR 60, SIR \N{MINUS SIGN}20 dB", "misses", "false alarms", "iterations"],
        [
            [
                label,
                *(
                    repairs.text(method, *what)
                    for what in zip(_COUNTS, [point] * 3, (2, 2, 1), strict=True)
                ),
            ]
            for label, method, point in (
                ("without interference", "no-interference", points[0]),
                ("masked, cut", "masked", points[0]),
                ("masked, as simulated", "masked", points[2]),
            )
        ],
    )
    head = ["cut", "cut, rolled", "as simulated", "as simulated, rolled"]
    for kind, methods in (
        ("repair", REPAIRS),
        ("compressive sensing", {f"`{name}`": name for name in SPARSE}),
    ):
        lines = [
            [label, *(repairs.text(method, "windowed_error_db", point) for point in points)]
            for label, method in methods.items()
        ]
        yield table([kind, *head], lines)


_COUNTS = ("misses", "false_alarms", "iterations")


def _of_detectors():
    figures = Figures("detectors")
    lines = []
    for mask in ("truth", "amplitude", "autoregressive", "residual"):
        for sir_db in (-20.0, 0.0, 10.0):
            cut, whole = (
                figures.point(panel=panel, mask=mask, sir_db=sir_db)
                for panel in ("cut", "as simulated")
            )
            shares = [
                "0"
                if mask == "truth"
                else figures.text("masked", name, point, interval=False, scale=100.0)
                for point in (cut, whole)
                for name in ("mask_missed", "mask_false")
            ]
            repaired = figures.text("mca-2d", "windowed_error_db", cut)
            level = f"{sir_db:.0f}".replace("-", "\N{MINUS SIGN}")
            lines.append([mask, level, *shares, repaired])
    return table(
        [
            *("mask", "SIR", "missed, cut", "false, cut", "missed, as simulated"),
            *("false, as simulated", "`mca-2d`, cut"),
        ],
        lines,
    )


def _of_sequences():
    shares, priors = Figures("mru-share"), Figures("mru-prior")
    few = shares.point(panel="share-0-db", share_lost=0.1)
    half = shares.point(panel="share-20-db", share_lost=0.5)
    yield table(
        [
            *("method", "10 % lost, 0 dB a sample", "iterations", "50 % lost, 20 dB a sample"),
            *("iterations", "false objects"),
        ],
        [
            [
                f"`{name}`",
                shares.text(name, "gap_error_db", few),
                shares.text(name, "iterations", few, 0, interval=False),
                shares.text(name, "gap_error_db", half),
                shares.text(name, "iterations", half, 0, interval=False),
                shares.text(name, "false_alarms", half),
            ]
            for name in SPARSE
        ],
    )
    at = {
        panel: priors.point(panel=panel, num_prior_frames=3)
        for panel in ("frames", "source", "wrong", "debiased")
    }
    columns = {
        "plain": ("", "frames"),
        "prior": ("pm-", "frames"),
        "debiased, no prior": ("", "debiased"),
        "prior, debiased": ("pm-", "debiased"),
        "prior of original frames": ("pm-", "source"),
        "prior of other objects": ("pm-", "wrong"),
    }
    yield table(
        ["thresholds", *columns],
        [
            [
                label,
                *(
                    priors.text(f"{start}{name}", "gap_error_db", at[panel])
                    for start, panel in columns.values()
                ),
            ]
            for label, name in (("soft", "ist"), ("hard", "iht"))
        ],
    )
    counts = (1, 2, 3, 5, 8)
    yield table(
        ["earlier frames Q", *map(str, counts)],
        [
            [
                label,
                *(
                    priors.text(
                        name, "gap_error_db", priors.point(panel="frames", num_prior_frames=count)
                    )
                    for count in counts
                ),
            ]
            for label, name in (("soft", "pm-ist"), ("hard", "pm-iht"))
        ],
    )


def _of_solvers():
    figures = Figures("mru-solver")
    kinds = {"adaptive": "(12)", "constant": "constant", "falling": "falling"}
    yield table(
        ["β", *(f"{text}: {what}" for text in kinds.values() for what in ("error", "false"))],
        [
            [
                f"{control:g}",
                *(
                    figures.text(
                        "ist", name, figures.point(threshold=kind, control=control, panel="control")
                    )
                    for kind in kinds
                    for name in ("gap_error_db", "false_alarms")
                ),
            ]
            for control in (1.0, 2.0, 2.5, 3.0, 4.0, 5.0)
        ],
    )
    widths, counts = (0.2, 0.4, 0.6, 0.8, 1.0), (8, 16, 32, 48, 64)
    points = [figures.point(panel="step", step_width=width) for width in widths]
    yield table(
        ["step width θ", *(f"{width:g}" for width in widths)],
        [
            ["error", *(figures.text("ist", "gap_error_db", point) for point in points)],
            ["iterations", *(figures.text("ist", "iterations", point, 0) for point in points)],
        ],
    )
    points = [figures.point(panel="drawn", samples_per_ramp=count) for count in counts]
    yield table(
        ["p of 64 clean samples", *map(str, counts)],
        [["error", *(figures.text("ist", "gap_error_db", point) for point in points)]],
    )


def _of_sizes():
    figures = Figures("mru-size")
    lines = []
    for size in (16, 32, 64, 128, 256):
        cells = []
        for domain in ("explicit-1d", "masked-2d"):
            if size > 64 and domain == "explicit-1d":
                cells += ["", ""]
                continue
            point = figures.point(panel="size", num_ramps=size, domain=domain)
            cells += [
                figures.text("ist", name, point, 2, interval=False)
                for name in ("iteration_ms", "operator_megabytes")
            ]
        lines.append([f"{size} x {size}", *cells])
    return table(["frame", "matrix: ms", "matrix: MB", "masked: ms", "masked: MB"], lines)


def with_tables(text):
    """Return the document with its tables as they are made now."""
    for new in tables():
        head = new.partition("\n")[0]
        start = text.index(f"\n{head}\n") + 1
        end = text.index("\n\n", start)
        text = f"{text[:start]}{new}{text[end:]}"
    return text


if __name__ == "__main__":
    DOCUMENT.write_text(with_tables(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")

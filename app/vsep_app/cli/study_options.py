"""Options of ``vsep study``."""

import argparse
from typing import Any

_EXAMPLES = """\
examples:
  vsep study list
  vsep study run fig-3 --points 3b --realizations 100 --workers 2 --out fig-3.jsonl
  vsep study plot fig-3.jsonl --out fig-3.html
  vsep study run fig-3 --repeat 20,17 --frame outlier.npz
      one trial alone, its rows on standard output, its frame for `vsep report` and the dashboard

A study that was stopped goes on where it was: give the same command again.
"""


def add_study(commands: Any) -> None:
    """Add ``study`` with its own commands to the command line's."""
    study = commands.add_parser(
        "study",
        help="Monte-Carlo studies: the paper's figures with intervals",
        description="Make the paper's figures again, with intervals.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    actions = study.add_subparsers(title="commands", metavar="COMMAND", required=True)
    listing = actions.add_parser("list", help="list the studies", allow_abbrev=False)
    listing.set_defaults(command=_list)
    _add_run(actions)
    _add_plot(actions)
    _add_summary(actions)


def _add_run(actions: Any) -> None:
    parser = actions.add_parser("run", help="run a study, or go on with it", allow_abbrev=False)
    parser.set_defaults(command=_run)
    parser.add_argument("study", metavar="NAME", help="see `vsep study list`")
    parser.add_argument(
        "--realizations", type=int, metavar="N", help="per point (default: see `vsep study list`)"
    )
    parser.add_argument(
        "--points",
        metavar="WHICH",
        help="panels, indices and ranges, such as 3b,0,40-51 (default: all)",
    )
    parser.add_argument(
        "--out", metavar="FILE", help="the rows, one line of JSON each; appended to if it exists"
    )
    parser.add_argument(
        "--repeat", metavar="POINT,REALIZATION", help="run this one trial and print its rows"
    )
    parser.add_argument(
        "--frame",
        metavar="FILE",
        help="with --repeat: keep the trial's frame as a frame file, *.npz",
    )
    where = parser.add_argument_group("where")
    where.add_argument(
        "--workers", type=int, default=1, metavar="N", help="local processes (default: 1)"
    )
    where.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="use the workers of this Dask scheduler, such as tcp://host:8786",
    )
    what = parser.add_argument_group("what")
    what.add_argument("--seed", type=int, default=1, metavar="N", help="of the study (default: 1)")
    what.add_argument(
        "--estimator",
        action="append",
        metavar="NAME",
        help="run this one only; may be given several times; no-interference is one too "
        "(default: all)",
    )
    what.add_argument(
        "--schedule",
        choices=("robust", "paper"),
        default="robust",
        help="order of updates (default: robust)",
    )
    what.add_argument(
        "--object-threshold-db",
        type=float,
        metavar="X",
        help="in the place of the study's own threshold",
    )
    what.add_argument(
        "--gospa-cutoff",
        type=float,
        default=1.0,
        metavar="X",
        help="resolution cells beyond which an object is missed (default: 1)",
    )
    what.add_argument(
        "--gospa-order", type=float, default=1.0, metavar="X", help="order of GOSPA (default: 1)"
    )


def _add_plot(actions: Any) -> None:
    parser = actions.add_parser("plot", help="draw the rows of a study", allow_abbrev=False)
    parser.set_defaults(command=_plot)
    parser.add_argument("rows", metavar="FILE", help="what `vsep study run` wrote")
    parser.add_argument(
        "--out", required=True, metavar="FILE", help="the figure, *.html, *.png, *.svg or *.pdf"
    )


def _add_summary(actions: Any) -> None:
    parser = actions.add_parser(
        "summary", help="write all figures with their intervals", allow_abbrev=False
    )
    parser.set_defaults(command=_summary)
    parser.add_argument("rows", metavar="FILE", help="what `vsep study run` wrote")
    parser.add_argument("--out", required=True, metavar="FILE", help="a table, *.csv")


def _list(options: argparse.Namespace) -> int:
    from vsep_app.cli.study_commands import list_studies

    return list_studies(options)


def _run(options: argparse.Namespace) -> int:
    from vsep_app.cli.study_commands import run_study

    return run_study(options)


def _plot(options: argparse.Namespace) -> int:
    from vsep_app.cli.study_commands import plot_study

    return plot_study(options)


def _summary(options: argparse.Namespace) -> int:
    from vsep_app.cli.study_commands import summarise_study

    return summarise_study(options)

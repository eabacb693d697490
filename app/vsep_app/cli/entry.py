"""The command, as `vsep` and as ``python -m vsep``.

The matrices are small: a second thread of the linear algebra gains nothing, and where other
programs want the cores, too, the threads wait for each other. Twelve frames of Simulation II took
25 s with two threads and 2 s with one beside two busy programs on two cores. The libraries look at
the environment once, when they are loaded: so this comes before all of them. Who sets the number of
threads has it.
"""

import os
import sys

from vsep._processes import SINGLE_THREAD


def main() -> int:
    """Run the command line with one thread of linear algebra; return the exit code."""
    for name in SINGLE_THREAD:
        os.environ.setdefault(name, "1")
    from vsep_app.cli.main import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())

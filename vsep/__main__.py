"""``python -m vsep``: the command line, which lives with the application."""

import sys

from vsep_app.cli.main import main

if __name__ == "__main__":
    sys.exit(main())

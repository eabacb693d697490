"""Trials on their way to worker processes, with the methods that a caller handed over."""

import pickle
import sys
from io import BytesIO
from types import FunctionType
from typing import Any

from vsep._optional import require_library
from vsep.studies.study import Trial
from vsep.studies.trial import Row, run_trial


def dump_trial(trial: Trial) -> bytes:
    """Pickle a trial: what worker processes can import by reference, the rest by value.

    A class of a notebook or of an interactive session exists nowhere else, so it has to travel
    itself, which takes cloudpickle.

    Raises `InputError` if worker processes cannot import a method and cloudpickle is missing.
    """
    file = BytesIO()
    pickler = _Pickler(file)
    try:
        pickler.dump(trial)
    except (pickle.PicklingError, AttributeError, TypeError):
        # Of a function's inside, for example: it has no name to import it by.
        pickler.homeless = pickler.homeless or ", ".join(entry.name for entry in trial.handed)
    if not pickler.homeless:
        return file.getvalue()
    where = f"{pickler.homeless} stands in no module that worker processes can import"
    purpose = f"{where}: put it into one; sending it along"
    content: bytes = require_library("cloudpickle", purpose, "cluster").dumps(trial)
    return content


def run_dumped_trial(content: bytes) -> list[Row]:
    """Run what `dump_trial` made."""
    trial: Trial = pickle.loads(content)
    return run_trial(trial)


class _Pickler(pickle.Pickler):
    """Notices classes and functions that a spawned process cannot import."""

    homeless = ""

    def reducer_override(self, value: Any) -> Any:
        """Leave the pickling as it is, and look."""
        if isinstance(value, type | FunctionType) and value.__module__ == "__main__":
            main = sys.modules["__main__"]
            # What a spawned process runs again to have the same names: a file or a module.
            if getattr(main, "__spec__", None) is None and not hasattr(main, "__file__"):
                self.homeless = value.__qualname__
        return NotImplemented

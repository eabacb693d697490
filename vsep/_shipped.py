"""Files that the application ships and the library reads: recorded frames."""

from importlib.util import find_spec
from pathlib import Path

from vsep.errors import InputError


def shipped_file(name: str) -> Path:
    """Path of a shipped file, in a checkout as in an installed wheel.

    The application's package holds it or, in a checkout, stands beside it; it is not imported.

    Parameters
    ----------
    name : str
        Path below ``assets/``.

    Raises
    ------
    InputError
        If the application is not installed beside the library.

    Examples
    --------
    >>> shipped_file("frames/openradar_doppler_example_1.npz").name
    'openradar_doppler_example_1.npz'
    """
    found = find_spec("vsep_app")
    for folder in (found.submodule_search_locations or ()) if found else ():
        for candidate in (
            Path(folder) / "static" / name,
            Path(folder).parents[1] / "assets" / name,
        ):
            if candidate.is_file():
                return candidate
    raise InputError(f"The file {name} is missing; install vsep with its application.")

"""Where the program finds the files that it ships: example frames and style sheets."""

from pathlib import Path

_PACKAGE = Path(__file__).parent


def path(name: str) -> Path:
    """Path of a shipped file, in a checkout as in an installed wheel.

    Parameters
    ----------
    name : str
        Path below ``assets/``, for example ``"frames/openradar_doppler_example_1.npz"``.

    Raises
    ------
    FileNotFoundError
        If no such file is shipped.

    Examples
    --------
    >>> path("frames/openradar_doppler_example_1.npz").name
    'openradar_doppler_example_1.npz'
    """
    candidates = (_PACKAGE.parent / "assets" / name, _PACKAGE / "static" / name)
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise FileNotFoundError(f"the program ships no file {name!r}")

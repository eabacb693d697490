"""Paths of shipped files: frames, style sheets, experiments, help."""

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
    for candidate in _candidates(name):
        if candidate.is_file():
            return candidate
    raise FileNotFoundError(f"the program ships no file {name!r}")


def folder(name: str) -> Path:
    """Path of a shipped folder, as `path` for a file.

    Raises `FileNotFoundError` if no such folder is shipped.
    """
    for candidate in _candidates(name):
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(f"the program ships no folder {name!r}")


def _candidates(name: str) -> tuple[Path, Path]:
    return _PACKAGE.parents[1] / "assets" / name, _PACKAGE / "static" / name

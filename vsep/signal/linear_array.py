"""Uniform linear array of receive antennas, and scenes with directions.

With theta counted from broadside towards the last antenna, a plane wave travels ``a d sin(theta)``
less to antenna a than to the first. In the paper's sign the antennas then receive it with the
weights ``exp(+j 2 pi a d sin(theta))``, d in wavelengths. The delay's change is below a resolution
cell and neglected, as everywhere in such radars.
"""

import math
from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.signal.scene import Scene


@dataclass(frozen=True, kw_only=True, slots=True)
class UniformLinearArray:
    """Equally spaced receive antennas of one transmitter."""

    num_antennas: int  #: A
    spacing_wavelengths: float = 0.5  #: d; up to half a wavelength every direction is told apart

    def __post_init__(self) -> None:
        """Check number and spacing."""
        require_range("num_antennas", self.num_antennas, 1, 1024)
        require_range("spacing_wavelengths", self.spacing_wavelengths, 1e-3, 1e3)

    @property
    def unambiguous_angle_deg(self) -> float:
        """Angle up to which, to both sides of broadside, directions are told apart.

        Examples
        --------
        >>> array = UniformLinearArray(num_antennas=2, spacing_wavelengths=1.0)
        >>> round(array.unambiguous_angle_deg, 6)
        30.0
        """
        return math.degrees(math.asin(min(1.0, 0.5 / self.spacing_wavelengths)))

    def steering(self, angles_deg: FloatArray) -> ComplexArray:
        """(L, A) weights of plane waves from some directions.

        Examples
        --------
        >>> import numpy as np
        >>> np.round(UniformLinearArray(num_antennas=3).steering(np.array([30.0])))
        array([[ 1.+0.j,  0.+1.j, -1.+0.j]])
        """
        sines = np.sin(np.radians(np.asarray(angles_deg, dtype=np.float64)))
        places = self.spacing_wavelengths * np.arange(self.num_antennas)
        return np.asarray(np.exp(2j * np.pi * np.outer(sines, places)))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class AntennaScene:
    """A scene, the antennas that receive it, and the directions of all that is in it."""

    scene: Scene  #: as the first antenna receives it; SNR and SIR are those of one antenna
    antennas: UniformLinearArray  #: who receives it
    object_angles_deg: FloatArray  #: (L,) of every object
    interferer_angles_deg: FloatArray  #: (I,) of every interferer, for all its paths

    def __post_init__(self) -> None:
        """Check that everything has one direction, and freeze them."""
        counts = self.scene.objects.num_paths, len(self.scene.interferers)
        names = "object_angles_deg", "interferer_angles_deg"
        for name, count in zip(names, counts, strict=True):
            angles = np.array(getattr(self, name), dtype=np.float64)
            if angles.shape != (count,):
                raise InputError(f"{name} has shape {angles.shape}; it must be ({count},).")
            for angle in angles:
                require_range(name, float(angle), -90.0, 90.0, "degrees")
            object.__setattr__(self, name, frozen(angles))

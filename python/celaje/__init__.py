"""Spectral radiance of the whole sky, from a place and a time.

Degrees at every boundary; azimuth clockwise from true north, elevation up, directions are where the observer looks.
Wavelengths in vacuum [nm], spectral radiance in W m⁻² sr⁻¹ nm⁻¹, spectral irradiance in W m⁻² nm⁻¹.

Examples
--------
>>> import celaje
>>> sky = celaje.sky(at=(41.65, -0.88), time="2026-06-21T18:30Z", wavelengths="400:700:50")
>>> img = sky.render("fisheye", size=8, spp=2)
>>> img.radiance.shape
(8, 8, 7)
"""

from ._atmosphere import AerosolColumn, Atmosphere, Species
from ._climate import climate
from ._conditions import Climate, Condition, Conditions
from ._core import __version__
from ._errors import (
    CelajeError,
    FileError,
    InvalidInputError,
    OutOfRangeError,
    ShapeMismatchError,
    TooLargeError,
    UnknownNameError,
)
from ._film import Film, Irradiance, Radiance
from ._medium import Medium, Phase
from ._optics import (
    Aerosol,
    MieSphere,
    SizeDistribution,
    aerosol,
    component,
    mie,
    rayleigh_cross_section,
)
from ._skies import sky, tables
from ._sky import Sky

__all__ = [
    "Aerosol",
    "AerosolColumn",
    "Atmosphere",
    "CelajeError",
    "Climate",
    "Condition",
    "Conditions",
    "FileError",
    "Film",
    "InvalidInputError",
    "Irradiance",
    "Medium",
    "MieSphere",
    "OutOfRangeError",
    "Phase",
    "Radiance",
    "ShapeMismatchError",
    "SizeDistribution",
    "Sky",
    "Species",
    "TooLargeError",
    "UnknownNameError",
    "__version__",
    "aerosol",
    "climate",
    "component",
    "mie",
    "rayleigh_cross_section",
    "sky",
    "tables",
]

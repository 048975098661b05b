"""What the air of a sky is made of, and what each part of it does to light."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from . import _core
from ._arrays import Floats
from ._errors import InvalidInputError

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Species:
    """A gas or a layer of aerosol, along altitude (z) and wavelength (w).

    Attributes
    ----------
    name : str
        ``"air"``, ``"ozone"``, ``"nitrogen dioxide"``, ``"water vapour"``, ``"oxygen"``, ``"oxygen pairs"``, or that of
        the aerosol's layer.
    is_aerosol : bool
        Whether it is a layer of aerosol.
    number_density : ndarray, shape (z,)
        Molecules or particles; linear between nodes. [m⁻³]
    sigma_s, sigma_a : ndarray, shape (z, w)
        Scattering and absorption coefficients. [m⁻¹]
    tau_s, tau_a : ndarray, shape (w,)
        Vertical optical depths of scattering and absorption, from the ground to space. [1]
    asymmetry : ndarray, shape (w,), or None
        Mean cosine of the scattering angle; None for what does not scatter. [1]
    phase : ndarray, shape (w, angle), or None
        Phase function, 1 over the sphere. [sr⁻¹]
    """

    name: str
    is_aerosol: bool
    number_density: Floats
    sigma_s: Floats
    sigma_a: Floats
    tau_s: Floats
    tau_a: Floats
    asymmetry: Floats | None
    phase: Floats | None

    @property
    def tau(self) -> Floats:
        """Vertical optical depth from the ground to space, shape (w,). [1]."""
        return self.tau_s + self.tau_a


@dataclass(frozen=True)
class AerosolColumn:
    """All aerosol from the ground to space together; NaN where there is none.

    Attributes
    ----------
    tau : ndarray, shape (w,)
        Vertical optical depth. [1]
    ssa : ndarray, shape (w,)
        Single-scattering albedo. [1]
    asymmetry : ndarray, shape (w,)
        Mean cosine of the scattering angle. [1]
    angstrom : ndarray, shape (w,)
        Ångström exponent between neighbouring wavelengths. [1]
    phase : ndarray, shape (w, angle)
        Phase function, weighted by scattering. [sr⁻¹]
    """

    tau: Floats
    ssa: Floats
    asymmetry: Floats
    angstrom: Floats
    phase: Floats


class Atmosphere:
    """What the air holds, part by part; ``sky.atmosphere``. In a notebook it shows itself as a figure.

    Attributes
    ----------
    altitude_m : ndarray, shape (z,)
        Nodes above sea level, the ground first; all profiles are linear between them. [m]
    temperature_k : ndarray, shape (z,)
        Temperature. [K]
    pressure_pa : ndarray, shape (z,)
        Pressure. [Pa]
    wavelength_nm : ndarray, shape (w,)
        Vacuum wavelengths. [nm]
    theta_deg : ndarray, shape (angle,)
        Scattering angles of the phase functions. [deg]
    species : mapping of str to Species
        Gases, then layers of aerosol from the lowest up.
    aerosol : AerosolColumn
        All aerosol together.
    extrapolated : bool
        Whether a refractive index was extrapolated below the first wavelength of its table.

    Examples
    --------
    >>> import celaje
    >>> air = celaje.sky(sun_elevation=30, aerosol="rural", aod_550=0.3, wavelengths=[450, 550]).atmosphere
    >>> list(air.species)[:3]
    ['air', 'ozone', 'nitrogen dioxide']
    >>> round(float(air.species["air"].tau[1]), 3), round(float(air.aerosol.ssa[1]), 2)
    (0.097, 0.9)
    """

    def __init__(self, raw: _core.Inventory, metadata: list[tuple[str, str]]) -> None:
        self._raw = raw
        self._metadata = metadata
        self.altitude_m: Floats = raw.altitude_m
        self.temperature_k: Floats = raw.temperature_k
        self.pressure_pa: Floats = raw.pressure_pa
        self.wavelength_nm: Floats = raw.wavelength_nm
        self.theta_deg: Floats = raw.theta_deg
        self.extrapolated: bool = raw.extrapolated
        self.species: Mapping[str, Species] = MappingProxyType(
            {fields["name"]: Species(**fields) for fields in raw.species()}
        )
        self.aerosol = AerosolColumn(**raw.aerosol())

    @property
    def tau(self) -> Floats:
        """Vertical optical depth of everything, shape (w,). [1]."""
        total: Floats = np.sum([s.tau for s in self.species.values()], axis=0)
        return total

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file, whole or not at all, in the format that its extension names.

        ``.svg`` is a figure, ``.nc`` NetCDF with everything, ``.csv`` one number a line.

        Parameters
        ----------
        path : str or path
            An older file is overwritten.

        Raises
        ------
        FileError
            Unknown extension, missing folder, no permission, full disk.
        """
        self._raw.save(os.fspath(path), self._metadata)

    def xarray(self) -> xarray.Dataset:
        """All of it as a dataset; needs ``celaje[xarray]``.

        Returns
        -------
        xarray.Dataset
            Coefficients over (species, altitude, wavelength), phase functions over (scatterer, wavelength, angle), and
            the same names as in the NetCDF file.
        """
        try:
            import xarray
        except ImportError:
            raise InvalidInputError(
                "xarray is not installed", 'install it: pip install "celaje[xarray]"'
            ) from None
        parts = list(self.species.values())
        scatter = [s for s in parts if s.asymmetry is not None and s.phase is not None]
        column = self.aerosol

        def stack(field: str) -> Floats:
            return np.stack([getattr(s, field) for s in parts])

        cube, plane = ("species", "altitude", "wavelength"), ("species", "wavelength")
        data = {
            "temperature": ("altitude", self.temperature_k, {"units": "K"}),
            "pressure": ("altitude", self.pressure_pa, {"units": "Pa"}),
            "number_density": (cube[:2], stack("number_density"), {"units": "m-3"}),
            "scattering_coefficient": (cube, stack("sigma_s"), {"units": "m-1"}),
            "absorption_coefficient": (cube, stack("sigma_a"), {"units": "m-1"}),
            "scattering_optical_depth": (plane, stack("tau_s"), {"units": "1"}),
            "absorption_optical_depth": (plane, stack("tau_a"), {"units": "1"}),
            "aerosol_optical_depth": ("wavelength", column.tau, {"units": "1"}),
            "aerosol_single_scattering_albedo": ("wavelength", column.ssa, {"units": "1"}),
            "aerosol_asymmetry": ("wavelength", column.asymmetry, {"units": "1"}),
            "aerosol_angstrom_exponent": ("wavelength", column.angstrom, {"units": "1"}),
            "asymmetry": (
                ("scatterer", "wavelength"),
                np.array([*(s.asymmetry for s in scatter), column.asymmetry]),
                {"units": "1"},
            ),
            "phase_function": (
                ("scatterer", "wavelength", "angle"),
                np.array([*(s.phase for s in scatter), column.phase]),
                {"units": "sr-1"},
            ),
        }
        wavelength = {"units": "nm", "standard_name": "radiation_wavelength"}
        coordinates = {
            "altitude": ("altitude", self.altitude_m, {"units": "m", "standard_name": "altitude"}),
            "wavelength": ("wavelength", self.wavelength_nm, wavelength),
            "angle": (
                "angle",
                self.theta_deg,
                {"units": "degree", "standard_name": "scattering_angle"},
            ),
            "species": [s.name for s in parts],
            "scatterer": [*(s.name for s in scatter), "all aerosol"],
        }
        attributes = {"Conventions": "CF-1.11", "source": f"celaje {_core.__version__}"}
        return xarray.Dataset(data, coordinates, {**attributes, **dict(self._metadata)})

    def _repr_svg_(self) -> str:
        return self._raw.svg(self._metadata)

    def __repr__(self) -> str:
        z, w = self.altitude_m, self.wavelength_nm
        return (
            f"<Atmosphere of {', '.join(self.species)}; {z.size} altitudes {z[0]:g} to {z[-1]:g} m, "
            f"{w.size} wavelengths {w[0]:g} to {w[-1]:g} nm>"
        )

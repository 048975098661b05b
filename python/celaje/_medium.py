"""A medium of one's own, entered at the optics stage: arrays in, no files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, as_float, per_wavelength, vector
from ._errors import ShapeMismatchError

if TYPE_CHECKING:
    from ._sky import Sky


class Phase:
    """How a species scatters: a density over the sphere [sr⁻¹] whose integral is 1.

    Made by :meth:`rayleigh`, :meth:`henyey_greenstein`, :meth:`table` or :meth:`legendre`. Parameters are the same at
    every wavelength, or given per wavelength of the medium.

    Examples
    --------
    >>> import celaje
    >>> p = celaje.Phase.henyey_greenstein(0.7)
    >>> p.at([0.0, 90.0, 180.0]).round(4).tolist()
    [[1.5031, 0.0223, 0.0083]]
    """

    def __init__(self, raw: _core.Phase) -> None:
        self._raw = raw

    @classmethod
    def rayleigh(cls, depolarisation: ArrayLike = 0.0279) -> Phase:
        """Molecules.

        Parameters
        ----------
        depolarisation : float or array_like, shape (wavelength,)
            Of unpolarised light, 0 to 6/7. [1]

        Returns
        -------
        Phase
            ``3 / (16π (1 + 2γ)) · [(1 + 3γ) + (1 − γ) cos²θ]``, ``γ = ρ / (2 − ρ)``.

        References
        ----------
        .. [1] Bucholtz (1995), Appl. Opt. 34, 2765-2773, :doi:`10.1364/AO.34.002765`, eq. 12.
        """
        return cls(_core.Phase.rayleigh(vector("depolarisation", depolarisation)))

    @classmethod
    def henyey_greenstein(cls, g: ArrayLike) -> Phase:
        """Particles, by one number.

        Parameters
        ----------
        g : float or array_like, shape (wavelength,)
            Mean cosine of the scattering angle, -0.9999 to 0.9999. [1]

        Returns
        -------
        Phase

        References
        ----------
        .. [1] Henyey & Greenstein (1941), ApJ 93, 70-83, :doi:`10.1086/144246`.
        """
        return cls(_core.Phase.henyey_greenstein(vector("g", g)))

    @classmethod
    def table(
        cls,
        theta_deg: ArrayLike,
        p: ArrayLike,
        p12: ArrayLike | None = None,
        p33: ArrayLike | None = None,
        p34: ArrayLike | None = None,
    ) -> Phase:
        """A table over the scattering angle, linear in ``cos θ`` between its nodes.

        Parameters
        ----------
        theta_deg : array_like, shape (t,)
            Strictly increasing from 0 to 180. [deg]
        p : array_like, shape (t,) or (wavelength, t)
            At least 0; its integral over the sphere must be 1 within 2 % and is then made 1. [sr⁻¹]
        p12, p33, p34 : array_like, shape of `p`, optional
            The other elements of the scattering matrix of spheres (F22 = F11, F44 = F33), with the signs of Bohren &
            Huffman 1983; what is left out is 0. Without any of them what is scattered leaves unpolarised. [sr⁻¹]

        Returns
        -------
        Phase

        Raises
        ------
        InvalidInputError
            Angles that do not run from 0 to 180, or an integral that is not 1.
            Other elements larger than `p` allows.
        ShapeMismatchError
            As many values as angles are needed.
        """
        angles, values = vector("theta_deg", theta_deg), np.atleast_2d(as_float("p", p))
        others = {"p12": p12, "p33": p33, "p34": p34}
        if all(element is None for element in others.values()):
            return cls(_core.Phase.table(angles, values))
        elements = [
            np.zeros_like(values) if element is None else np.atleast_2d(as_float(name, element))
            for name, element in others.items()
        ]
        return cls(_core.Phase.spheres(angles, values, *elements))

    @classmethod
    def legendre(cls, c: ArrayLike) -> Phase:
        """A Legendre series, ``p = 1/(4π) Σ c_l P_l(cos θ)``.

        Parameters
        ----------
        c : array_like, shape (l,)
            ``c_0 = 1``, ``c_l = (2l + 1) g_l``. [1]

        Returns
        -------
        Phase

        Raises
        ------
        InvalidInputError
            A series that is not normalised, or negative beyond 10⁻³ of its mean.
        """
        return cls(_core.Phase.legendre(vector("c", c)))

    def at(self, theta_deg: ArrayLike) -> Floats:
        """Values at some scattering angles.

        Parameters
        ----------
        theta_deg : array_like, shape (n,)
            0 to 180. [deg]

        Returns
        -------
        ndarray, shape (wavelength, n)
            One row if the phase function is the same at every wavelength. [sr⁻¹]
        """
        return self._raw.values(vector("theta_deg", theta_deg))

    def __repr__(self) -> str:
        return repr(self._raw)


class Medium:
    """Scattering and absorption along altitude and wavelength, in concentric shells.

    Parameters
    ----------
    altitude_m : array_like, shape (z,)
        Nodes, strictly increasing, at least two: the first is the ground, the last the top of the atmosphere. [m]
    wavelength_nm : array_like, shape (w,)
        Vacuum, strictly increasing. [nm]
    planet_radius_m : float
        Radius of altitude 0. [m]

    Raises
    ------
    OutOfRangeError, InvalidInputError
        Arrays that do not increase, or are not numbers.

    Examples
    --------
    >>> import celaje
    >>> import numpy as np
    >>> z = np.linspace(0.0, 100e3, 401)
    >>> m = celaje.Medium(z, [450.0, 650.0], planet_radius_m=6_371_000.0)
    >>> m.add(np.exp(-z / 8000.0)[:, None] * [2.7e-5, 0.6e-5], 0.0, celaje.Phase.rayleigh())
    >>> m.vertical_optical_depth().round(3).tolist()
    [0.216, 0.048]
    >>> sky = m.sky(sun_elevation=30, albedo=0.1)
    >>> L = sky.radiance([0.0, 180.0], [45.0, 45.0], spp=16)
    >>> L.radiance.shape
    (2, 2)
    """

    def __init__(
        self,
        altitude_m: ArrayLike,
        wavelength_nm: ArrayLike,
        planet_radius_m: float = 6_360_000.0,
    ) -> None:
        self._raw = _core.Medium(
            vector("altitude_m", altitude_m),
            vector("wavelength_nm", wavelength_nm),
            float(planet_radius_m),
        )

    @classmethod
    def _of(cls, raw: _core.Medium) -> Medium:
        medium = cls.__new__(cls)
        medium._raw = raw
        return medium

    def add(self, sigma_s: ArrayLike, sigma_a: ArrayLike, phase: Phase) -> None:
        """Add a species.

        Parameters
        ----------
        sigma_s, sigma_a : array_like, shape (altitude, wavelength)
            Scattering and absorption coefficients, at least 0, linear between nodes. A number, or an axis of length 1,
            holds everywhere. [m⁻¹]
        phase : Phase
            How it scatters.

        Raises
        ------
        ShapeMismatchError, OutOfRangeError
            The medium is then unchanged.
        """
        self._raw.add(self._nodes("sigma_s", sigma_s), self._nodes("sigma_a", sigma_a), phase._raw)

    def _nodes(self, name: str, values: ArrayLike) -> Floats:
        shape = (self.altitude_m.size, self.wavelength_nm.size)
        array = as_float(name, values)
        # A flat array could mean either axis: it is not guessed.
        fits = array.ndim in (0, 2) and all(
            n in (1, m) for n, m in zip(array.shape, shape, strict=False)
        )
        if not fits:
            raise ShapeMismatchError(
                f"{name} has shape {array.shape}, expected (altitude, wavelength) = {shape}",
                f"give one value per altitude and wavelength, such as {name}[:, None] * per_wavelength",
            )
        return np.ascontiguousarray(np.broadcast_to(array, shape))

    @property
    def altitude_m(self) -> Floats:
        """Nodes above sea level, the ground first, shape (z,). [m]."""
        return self._raw.altitude_m

    @property
    def wavelength_nm(self) -> Floats:
        """Vacuum wavelengths, shape (w,). [nm]."""
        return self._raw.wavelength_nm

    @property
    def planet_radius_m(self) -> float:
        """Radius of altitude 0. [m]."""
        return self._raw.planet_radius_m

    @property
    def sigma_t(self) -> Floats:
        """Extinction coefficient of all species, shape (altitude, wavelength). [m⁻¹]."""
        return self._raw.sigma_t()

    @property
    def sigma_s(self) -> Floats:
        """Scattering coefficient of all species, shape (altitude, wavelength). [m⁻¹]."""
        return self._raw.sigma_s()

    @property
    def sigma_a(self) -> Floats:
        """Absorption coefficient of all species, shape (altitude, wavelength). [m⁻¹]."""
        return np.maximum(self.sigma_t - self.sigma_s, 0.0)

    @property
    def species(self) -> list[tuple[Floats, Phase]]:
        """Scattering coefficient [m⁻¹], shape (altitude, wavelength), and phase function of each species."""
        return [(sigma_s, Phase(raw)) for sigma_s, raw in self._raw.species()]

    def vertical_optical_depth(self) -> Floats:
        """Optical depth from the ground straight up, shape (w,). [1]."""
        return self._raw.vertical_optical_depth()

    def sky(
        self,
        sun_elevation: float,
        sun_azimuth: float = 180.0,
        albedo: ArrayLike = 0.0,
        irradiance: ArrayLike = 1.0,
        sun_angular_radius_deg: float = 0.0,
    ) -> Sky:
        """The sky of this medium, as it is now, under a sun of one's own.

        Parameters
        ----------
        sun_elevation, sun_azimuth : float
            True direction of the sun's middle; azimuth clockwise from north. [deg]
        albedo : float or array_like, shape (w,)
            Lambertian reflectance of the ground, 0 to 1. [1]
        irradiance : float or array_like, shape (w,)
            Above the air, on a plane that faces the sun. [W m⁻² nm⁻¹]
        sun_angular_radius_deg : float
            0 is a collimated beam, which is left out of radiances. [deg]

        Returns
        -------
        Sky
            Its ``conditions`` and ``atmosphere`` are None.
        """
        from ._sky import Sky

        count = self.wavelength_nm.size
        raw = _core.Sky.from_medium(
            self._raw,
            float(sun_elevation),
            float(sun_azimuth),
            per_wavelength("albedo", albedo, count),
            per_wavelength("irradiance", irradiance, count),
            float(sun_angular_radius_deg),
        )
        return Sky(raw)

    def __repr__(self) -> str:
        z, w = self.altitude_m, self.wavelength_nm
        return (
            f"Medium({z.size} altitudes {z[0]:g} to {z[-1]:g} m, "
            f"{w.size} wavelengths {w[0]:g} to {w[-1]:g} nm)"
        )

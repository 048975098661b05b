"""What particles and molecules do to light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Floats, as_float, vector
from ._errors import InvalidInputError

_Optics = Callable[[str, float, Floats], tuple[Floats, Floats, Floats, Floats, Floats]]


@dataclass(frozen=True)
class _AtWavelength:
    """Optics at one wavelength."""

    extinction_m: float
    ssa: float
    asymmetry: float
    theta_deg: Floats
    phase: Floats


class Aerosol:
    """Optics of an aerosol type or component; made by :func:`aerosol` and :func:`component`.

    Every method takes a vacuum wavelength [nm], 280 to 2500, as a number (and returns one) or as an array of any shape
    (and returns one like it). What was computed once is kept.

    Attributes
    ----------
    name : str
        Type or component.
    humidity : float
        Relative humidity. [%]
    """

    def __init__(self, name: str, humidity: float, optics: _Optics) -> None:
        self.name = name
        self.humidity = float(humidity)
        self._optics = optics
        self._known: dict[float, _AtWavelength] = {}
        # One cheap wavelength tells at once whether name and humidity are right.
        self._at(np.array([550.0]))

    def extinction(self, wavelength_nm: ArrayLike) -> Floats | float:
        """Extinction coefficient at the ground.

        Parameters
        ----------
        wavelength_nm : float or array_like
            Vacuum. [nm]

        Returns
        -------
        float or ndarray
            For a type, in the amount of its definition at sea level; for a component, at 1 cm⁻³. [km⁻¹]
        """
        return self._each(wavelength_nm, lambda at: at.extinction_m * 1e3)

    def ssa(self, wavelength_nm: ArrayLike) -> Floats | float:
        """Single-scattering albedo at the ground: scattering over extinction. [1].

        Parameters
        ----------
        wavelength_nm : float or array_like
            Vacuum. [nm]

        Returns
        -------
        float or ndarray
        """
        return self._each(wavelength_nm, lambda at: at.ssa)

    def asymmetry(self, wavelength_nm: ArrayLike) -> Floats | float:
        """Mean cosine of the scattering angle at the ground. [1].

        Parameters
        ----------
        wavelength_nm : float or array_like
            Vacuum. [nm]

        Returns
        -------
        float or ndarray
        """
        return self._each(wavelength_nm, lambda at: at.asymmetry)

    def phase(self, wavelength_nm: ArrayLike, theta_deg: ArrayLike) -> Floats | float:
        """Phase function at the ground; its integral over the sphere is 1.

        Parameters
        ----------
        wavelength_nm : float or array_like, shape (w,)
            Vacuum. [nm]
        theta_deg : float or array_like, shape (n,)
            Scattering angle, 0 (forward) to 180. [deg]

        Returns
        -------
        float or ndarray
            Shape of `wavelength_nm` and then that of `theta_deg`: (n,) for one wavelength and n angles. [sr⁻¹]
        """
        wavelength = as_float("wavelength_nm", wavelength_nm)
        theta = as_float("theta_deg", theta_deg)
        if theta.size and not (theta.min() >= 0.0 and theta.max() <= 180.0):
            raise InvalidInputError(
                "scattering angles must lie between 0 and 180 deg", "give theta_deg in [0, 180]"
            )
        rows = []
        for at in self._at(wavelength.ravel()):
            # Linear in cos θ, as the transport takes it; np.interp wants rising abscissae.
            cos_nodes = np.cos(np.radians(at.theta_deg))[::-1]
            rows.append(np.interp(np.cos(np.radians(theta)), cos_nodes, at.phase[::-1]))
        values = np.array(rows).reshape(wavelength.shape + theta.shape)
        return values if values.ndim else float(values)

    def _each(
        self, wavelength_nm: ArrayLike, quantity: Callable[[_AtWavelength], float]
    ) -> Floats | float:
        wavelength = as_float("wavelength_nm", wavelength_nm)
        values = np.array([quantity(at) for at in self._at(wavelength.ravel())])
        return values.reshape(wavelength.shape) if wavelength.ndim else float(values[0])

    def _at(self, wavelength_nm: Floats) -> list[_AtWavelength]:
        """Optics at each wavelength, computed where not known already."""
        if np.isnan(wavelength_nm).any():
            self._optics(self.name, self.humidity, np.array([np.nan]))
        new = sorted(set(wavelength_nm.tolist()) - self._known.keys())
        if new:
            extinction, ssa, asymmetry, theta_deg, phase = self._optics(
                self.name, self.humidity, np.array(new)
            )
            for i, nm in enumerate(new):
                self._known[nm] = _AtWavelength(
                    float(extinction[i]), float(ssa[i]), float(asymmetry[i]), theta_deg, phase[i]
                )
        return [self._known[nm] for nm in wavelength_nm.tolist()]

    def __repr__(self) -> str:
        return f"<Aerosol {self.name} at {self.humidity:g} % humidity>"


def aerosol(name: str, humidity: float = 80.0) -> Aerosol:
    """Optics of an aerosol type at the ground.

    Parameters
    ----------
    name : str
        ``"desert"`` or ``"aiaa:desert"``, ``"opac:continental-average"``, …
    humidity : float
        Relative humidity, 0 to 99. [%]

    Returns
    -------
    Aerosol

    Raises
    ------
    UnknownNameError
        The message lists the types there are.
    OutOfRangeError
        For the humidity.

    References
    ----------
    .. [1] Hess, Koepke & Schult (1998), BAMS 79, 831-844.
    .. [2] AIAA G-003, Guide to Reference and Standard Atmosphere Models.

    Examples
    --------
    >>> import celaje
    >>> a = celaje.aerosol("opac:continental-average", humidity=80)
    >>> round(a.extinction(550.0), 3), round(a.ssa(550.0), 3), round(a.asymmetry(550.0), 3)
    (0.075, 0.925, 0.703)
    >>> a.phase(550.0, [0.0, 90.0, 180.0]).shape
    (3,)
    """
    return Aerosol(name, humidity, _core.aerosol)


def component(name: str, humidity: float = 80.0) -> Aerosol:
    """Optics of one OPAC component, 1 particle per cm³.

    Parameters
    ----------
    name : str
        ``"inso"``, ``"waso"``, ``"soot"``, ``"ssam"``, ``"sscm"``, ``"minm"``, ``"miam"``, ``"micm"``, ``"mitr"``,
        ``"suso"``.
    humidity : float
        Relative humidity, 0 to 99. [%]

    Returns
    -------
    Aerosol

    References
    ----------
    .. [1] Hess, Koepke & Schult (1998), BAMS 79, 831-844.

    Examples
    --------
    >>> import celaje
    >>> waso = celaje.component("waso", humidity=80)
    >>> f"{waso.extinction(550.0):.3e}"
    '9.598e-06'
    """
    return Aerosol(name, humidity, _core.component)


class MieSphere:
    """What one homogeneous sphere does to light; made by :func:`mie`."""

    def __init__(self, raw: _core.MieSphere) -> None:
        self._raw = raw

    @property
    def q_ext(self) -> float:
        """Extinction efficiency: cross section over ``π r²``. [1]."""
        return self._raw.q_ext

    @property
    def q_sca(self) -> float:
        """Scattering efficiency. [1]."""
        return self._raw.q_sca

    @property
    def asymmetry(self) -> float:
        """Mean cosine of the scattering angle. [1]."""
        return self._raw.asymmetry

    def s1(self, theta_deg: ArrayLike) -> NDArray[np.complex128]:
        """Amplitude perpendicular to the scattering plane.

        Parameters
        ----------
        theta_deg : float or array_like
            Scattering angle, 0 to 180. [deg]

        Returns
        -------
        ndarray of complex, of the shape of `theta_deg`
            In the convention of Bohren & Huffman, eq. 4.74. [1]
        """
        return self._amplitudes(theta_deg)[0]

    def s2(self, theta_deg: ArrayLike) -> NDArray[np.complex128]:
        """Amplitude parallel to the scattering plane; as :meth:`s1`.

        Parameters
        ----------
        theta_deg : float or array_like
            Scattering angle, 0 to 180. [deg]

        Returns
        -------
        ndarray of complex, of the shape of `theta_deg`
        """
        return self._amplitudes(theta_deg)[1]

    def _amplitudes(
        self, theta_deg: ArrayLike
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        theta = as_float("theta_deg", theta_deg)
        s1, s2 = self._raw.amplitudes(theta.ravel())
        return s1.reshape(theta.shape), s2.reshape(theta.shape)


def mie(refractive_index: complex, size_parameter: float) -> MieSphere:
    """Scattering of a plane wave by a homogeneous sphere (Lorenz–Mie).

    Parameters
    ----------
    refractive_index : complex
        ``n + ik`` relative to the medium around, ``k ≥ 0`` for absorption. [1]
    size_parameter : float
        ``x = 2π r / λ``, 1e-8 to 1e5. [1]

    Returns
    -------
    MieSphere
        ``.q_ext``, ``.q_sca``, ``.asymmetry``, ``.s1(theta_deg)``, ``.s2(theta_deg)``.

    Raises
    ------
    OutOfRangeError
        A negative ``k``, the other sign convention, is refused rather than conjugated.

    References
    ----------
    .. [1] Bohren & Huffman (1983), Absorption and Scattering of Light by Small Particles, ch. 4.

    Examples
    --------
    >>> import celaje
    >>> sphere = celaje.mie(refractive_index=1.5 + 0.01j, size_parameter=10.0)
    >>> round(sphere.q_ext, 4), round(sphere.q_sca, 4)
    (2.7707, 2.3441)
    """
    m = complex(refractive_index)
    return MieSphere(_core.mie(m.real, m.imag, float(size_parameter)))


def rayleigh_cross_section(wavelength_nm: ArrayLike) -> Floats | float:
    """Scattering cross section of air per molecule.

    Parameters
    ----------
    wavelength_nm : float or array_like
        Vacuum, 200 to 4000. [nm]

    Returns
    -------
    float or ndarray, of the shape of `wavelength_nm`
        Cross section. [m²]

    Raises
    ------
    OutOfRangeError
        Outside 200 to 4000 nm.

    References
    ----------
    .. [1] Bucholtz (1995), Appl. Opt. 34, 2765-2773, :doi:`10.1364/AO.34.002765`.

    Examples
    --------
    >>> import celaje
    >>> f"{celaje.rayleigh_cross_section(550.0):.3e}"
    '4.509e-31'
    """
    wavelength = as_float("wavelength_nm", wavelength_nm)
    values = _core.rayleigh_cross_section(vector("wavelength_nm", wavelength.ravel()))
    return values.reshape(wavelength.shape) if wavelength.ndim else float(values[0])

"""What particles and molecules do to light."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Floats, as_float, vector
from ._errors import InvalidInputError, ShapeMismatchError

_Optics = Callable[[str, float, Floats], tuple[Floats, Floats, Floats, Floats, Floats]]


@dataclass(frozen=True)
class _AtWavelength:
    """Optics at one wavelength."""

    extinction_m: float
    ssa: float
    asymmetry: float
    theta_deg: Floats
    phase: Floats


@dataclass(frozen=True)
class SizeDistribution:
    """How large particles are: one log-normal mode or several, cut at two radii.

    ``dN/dln r = Σ f_i / (√(2π) ln σ_i) exp(−½ [ln(r/r_i) / ln σ_i]²)``, not renormalised after the cut.

    Attributes
    ----------
    r_mode_um : float or sequence of float
        Mode (median) radius, 1e-5 to 1000, one per mode. [µm]
    sigma : float or sequence of float
        Geometric standard deviation, above 1, one per mode or one for all. [1]
    number_fraction : float or sequence of float
        Share of the particles, not negative and not all 0; need not add up to 1. [1]
    r_min_um, r_max_um : float, optional
        Smallest and largest radius; a thousandth of the smallest mode and a thousand times the largest by default,
        within 1e-5 and 100. [µm]

    Examples
    --------
    >>> import celaje
    >>> fine_and_coarse = celaje.SizeDistribution([0.08, 0.5], [1.6, 2.0], number_fraction=[0.99, 0.01])
    """

    r_mode_um: float | Sequence[float]
    sigma: float | Sequence[float]
    number_fraction: float | Sequence[float] = 1.0
    r_min_um: float | None = None
    r_max_um: float | None = None

    def _modes(self) -> list[tuple[float, float, float]]:
        """Number fraction, radius and width of each mode."""
        radius = vector("r_mode_um", self.r_mode_um)
        if radius.size == 0:
            raise InvalidInputError("a size distribution without a mode", "give r_mode_um")
        width = per_mode("sigma", self.sigma, radius.size)
        share = per_mode("number_fraction", self.number_fraction, radius.size)
        return list(zip(share.tolist(), radius.tolist(), width.tolist(), strict=True))

    def _bounds(self) -> tuple[float, float]:
        radius = vector("r_mode_um", self.r_mode_um)
        low = max(1e-3 * float(radius.min()), 1e-5) if self.r_min_um is None else self.r_min_um
        high = min(1e3 * float(radius.max()), 100.0) if self.r_max_um is None else self.r_max_um
        return float(low), float(high)


def per_mode(name: str, values: ArrayLike, count: int) -> Floats:
    """One value per mode, from such an array or one number for all."""
    array = vector(name, values)
    if array.size not in (1, count):
        raise ShapeMismatchError(
            f"{name} has shape {array.shape}, expected ({count},), one value per mode",
            "give one number, or one per mode",
        )
    return np.broadcast_to(array, (count,))


class Aerosol:
    """An aerosol: of one's own, or a type or component by name (:func:`aerosol`, :func:`component`).

    One's own are homogeneous spheres of one kind of matter; Mie theory is worked out on the spot. For a sky:
    ``celaje.sky(aerosol=..., aod_550=...)``. Every method takes a vacuum wavelength [nm], 280 to 2500, as a number
    (and returns one) or as an array of any shape (and returns one like it). What was computed once is kept.

    Parameters
    ----------
    refractive_index : complex, or (array_like, array_like)
        ``n + ik``, ``k ≥ 0``: one for all wavelengths, or vacuum wavelengths [nm], increasing, and an index for each.
        In between it is linear, below the first a cubic (flagged in ``sky.atmosphere.extrapolated``), above the last
        an error. [1]
    size_distribution : SizeDistribution
        How large the particles are.
    profile : float, or (array_like, array_like)
        How they thin out: a scale height [m] up to the tropopause (13 km), or altitudes above sea level [m],
        increasing, and relative number densities there: exponential in between, nothing outside.
    name : str
        What to call it.

    Attributes
    ----------
    name : str
        What it is called.
    humidity : float
        Relative humidity; without effect on an aerosol of one's own. [%]

    Raises
    ------
    OutOfRangeError, InvalidInputError, ShapeMismatchError
        A negative ``k`` (the other sign convention is refused, not conjugated), ``sigma`` not above 1, bounds in the
        wrong order, fractions that are negative or all 0, altitudes that do not increase.

    Examples
    --------
    >>> import celaje
    >>> smoke = celaje.Aerosol(
    ...     refractive_index=1.52 + 0.02j,
    ...     size_distribution=celaje.SizeDistribution(r_mode_um=0.08, sigma=1.6),
    ...     profile=([0, 2000, 3000, 5000], [0.1, 0.2, 1.0, 0.0]),
    ...     name="smoke",
    ... )
    >>> round(smoke.ssa(550.0), 2), round(smoke.asymmetry(550.0), 2)
    (0.9, 0.62)
    >>> sky = celaje.sky(sun_elevation=20, aerosol=smoke, aod_550=0.5, wavelengths=[450, 550, 650])
    >>> sky.conditions.aerosol.value
    'smoke'
    """

    def __init__(
        self,
        refractive_index: complex | tuple[ArrayLike, ArrayLike],
        size_distribution: SizeDistribution,
        profile: float | tuple[ArrayLike, ArrayLike],
        *,
        name: str = "own",
    ) -> None:
        if not isinstance(size_distribution, SizeDistribution):
            raise InvalidInputError(
                f"the size distribution {size_distribution!r} is none",
                "give celaje.SizeDistribution(r_mode_um=0.1, sigma=1.6)",
            )
        samples, scale_height = _profile(profile)
        own = _core.OwnAerosol(
            str(name),
            _index(refractive_index),
            size_distribution._modes(),
            size_distribution._bounds(),
            samples,
            scale_height,
        )
        self._describe(str(name), 0.0, lambda _name, _humidity, nm: _core.own_aerosol(own, nm))
        self._own: _core.OwnAerosol | None = own

    @classmethod
    def _named(cls, name: str, humidity: float, optics: _Optics, *, is_type: bool) -> Aerosol:
        made = cls.__new__(cls)
        made._describe(name, float(humidity), optics)
        made._own = None
        made._is_type = is_type
        # One cheap wavelength tells at once whether name and humidity are right.
        made._at(np.array([550.0]))
        return made

    def _describe(self, name: str, humidity: float, optics: _Optics) -> None:
        self.name = name
        self.humidity = humidity
        self._optics = optics
        self._is_type = True
        self._known: dict[float, _AtWavelength] = {}

    def _for_a_sky(
        self, humidity: float | None
    ) -> tuple[_core.OwnAerosol | None, str | None, float | None]:
        """The extension's own aerosol, or the name of a type and the humidity it is in."""
        if self._own is not None:
            return self._own, None, humidity
        if not self._is_type:
            raise InvalidInputError(
                f"'{self.name}' is a component, not an aerosol type",
                "give the name of a type, or celaje.Aerosol(refractive_index, size_distribution, profile)",
            )
        return None, self.name, self.humidity if humidity is None else humidity

    def extinction(self, wavelength_nm: ArrayLike) -> Floats | float:
        """Extinction coefficient at the ground.

        Parameters
        ----------
        wavelength_nm : float or array_like
            Vacuum. [nm]

        Returns
        -------
        float or ndarray
            For a type, in the amount of its definition at sea level; for a component, or an aerosol of one's own, at
            1 cm⁻³. [km⁻¹]
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
        if self._own is not None:
            return f"<Aerosol {self.name}, of one's own>"
        return f"<Aerosol {self.name} at {self.humidity:g} % humidity>"


def _index(
    index: complex | tuple[ArrayLike, ArrayLike],
) -> tuple[list[float], list[float], list[float]]:
    """Wavelengths, n and k; no wavelength for an index that is the same everywhere."""
    try:
        if isinstance(index, tuple):
            nm, value = index
            wavelength = vector("wavelength_nm of the refractive index", nm).tolist()
        else:
            wavelength, value = [], index
        numbers = np.atleast_1d(np.asarray(value, dtype=np.complex128))
        if numbers.ndim != 1 or (not wavelength and numbers.size != 1):
            raise ValueError
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"the refractive index {index!r} is not understood",
            "give one complex number such as 1.5+0.01j, or a tuple (wavelength_nm, index) of two arrays",
        ) from None
    return wavelength, numbers.real.tolist(), numbers.imag.tolist()


def _profile(
    profile: float | tuple[ArrayLike, ArrayLike],
) -> tuple[tuple[list[float], list[float]] | None, float]:
    """Altitudes and densities, or a scale height."""
    try:
        if isinstance(profile, tuple):
            altitude, relative = profile
            samples = (
                vector("altitude_m of the profile", altitude).tolist(),
                vector("densities of the profile", relative).tolist(),
            )
            return samples, 0.0
        return None, float(profile)
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"the profile {profile!r} is not understood",
            "give a scale height in m, or a tuple (altitude_m, relative) of two arrays",
        ) from None


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
    return Aerosol._named(name, humidity, _core.aerosol, is_type=True)


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
    return Aerosol._named(name, humidity, _core.component, is_type=False)


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

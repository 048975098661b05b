"""A sky, and looking at it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, vector, wavelength_grid
from ._atmosphere import Atmosphere
from ._climate import Place, When, Words, read_conditions
from ._conditions import Conditions
from ._errors import (
    InvalidInputError,
    NotBuiltError,
    OutOfRangeError,
    ShapeMismatchError,
    TooLargeError,
    UnknownNameError,
)
from ._film import Film, Irradiance, Radiance
from ._medium import Medium
from ._optics import Aerosol

PROJECTIONS = ("fisheye", "latlong", "perspective")
DEFAULT_SPP = 64
# A first guess at the noise, and how much more than it asks for is spent.
PILOT_SPP = 64
NOISE_MARGIN = 1.15
MAX_SPP = 2**32 - 1


class Sky:
    """A sky; made by :func:`celaje.sky` or :meth:`Medium.sky`."""

    def __init__(self, raw: _core.Sky, conditions: Conditions | None = None) -> None:
        self._raw = raw
        self._conditions = conditions
        self._origin: dict[str, str] = {}

    @property
    def conditions(self) -> Conditions | None:
        """Every condition in force, with its reason; None for a medium of one's own."""
        return self._conditions

    @property
    def atmosphere(self) -> Atmosphere | None:
        """What the air holds, part by part, made anew each time; None for a medium of one's own."""
        raw = self._raw.inventory()
        if raw is None or self._conditions is None:
            return None
        return Atmosphere(raw, list(self._conditions.metadata()))

    @property
    def medium(self) -> Medium:
        """Scattering and absorption along altitude and wavelength; a copy, free to be changed."""
        return Medium._of(self._raw.medium())

    @property
    def wavelength_nm(self) -> Floats:
        """Vacuum wavelengths, shape (w,). [nm]."""
        return self._raw.wavelength_nm

    @property
    def albedo(self) -> Floats:
        """Reflectance of the ground, shape (w,). [1]."""
        return self._raw.albedo

    @property
    def sun_irradiance(self) -> Floats:
        """Irradiance above the air on a plane that faces the sun, shape (w,). [W m⁻² nm⁻¹]."""
        return self._raw.sun_irradiance

    def render(
        self,
        projection: str = "fisheye",
        size: int | str | tuple[int, int] = 256,
        *,
        fov: float | None = None,
        look: tuple[float, float] | None = None,
        altitude_m: float | None = None,
        sun_disc: str = "on",
        method: str | None = None,
        accuracy: str = "default",
        spp: int | None = None,
        max_order: int | None = None,
        seed: int = 0,
        threads: int | None = None,
    ) -> Film:
        """Render a picture; Ctrl-C stops it within a tenth of a second.

        Parameters
        ----------
        projection : str
            ``"fisheye"``: zenith in the middle, north up, east left. ``"latlong"``: the whole sphere, zenith on row 0,
            north at the left edge. ``"perspective"``: a flat picture around `look`.
        size : int, (int, int) or str
            Pixels: N for N×N (2N×N for latlong), (width, height), or ``"512x256"``.
        fov : float, optional
            Fisheye: the full cone, 180 by default. Perspective: the full horizontal angle, 90 by default. [deg]
        look : (float, float), optional
            Azimuth and elevation of the middle of a perspective picture, (180, 30) by default. [deg]
        altitude_m : float, optional
            Observer above sea level; on the ground by default. [m]
        sun_disc : str
            ``"on"``, ``"off"`` or ``"only"``.
        method : str, optional
            ``"shells"`` (default, without noise), ``"path"`` (default if `spp` is given), ``"tracker"`` or
            ``"classic"``.
        accuracy : str
            How finely ``"shells"`` cuts: ``"preview"``, ``"default"`` or ``"high"``.
        spp : int, optional
            Paths per pixel, 64 by default; noise falls with their square root.
        max_order : int, optional
            Count this many scatterings and reflections only.
        seed : int
            The same seed gives the same bits, on any number of threads.
        threads : int, optional
            1 to 1024; all cores by default.

        Returns
        -------
        Film

        Raises
        ------
        UnknownNameError, OutOfRangeError, InvalidInputError
            Bad arguments.
        TooLargeError
            More pixels than memory; the message says how much they would take.

        Examples
        --------
        >>> import celaje
        >>> sky = celaje.sky(sun_elevation=5, aerosol="desert", aod_550=0.4, wavelengths="450,550,650")
        >>> img = sky.render("perspective", size=(16, 9), fov=60, look=(180, 10), spp=2, seed=1)
        >>> img.radiance.shape
        (9, 16, 3)
        """
        sensor = _sensor(projection, size, fov, look)
        if method is None:
            method = "shells" if spp is None else "path"
        spp = _count("spp", DEFAULT_SPP if spp is None else spp, MAX_SPP)
        seed = _count("seed", seed, 2**64 - 1, least=0)
        radiance, variance, samples = self._raw.render(
            sensor,
            method,
            accuracy,
            spp,
            seed,
            _order(max_order),
            sun_disc,
            altitude_m,
            _threads(threads),
        )
        metadata = dict(self._origin)
        if self._conditions is not None:
            metadata.update(self._conditions.metadata())
        observer_m = self._raw.ground_altitude_m if altitude_m is None else altitude_m
        metadata["observer_altitude_m"] = f"{observer_m:g}"
        metadata["sun_disc"] = sun_disc
        metadata["method"] = method
        if method == "shells":
            metadata["accuracy"] = accuracy
        else:
            metadata["spp"] = str(spp)
            metadata["seed"] = str(seed)
        metadata["max_order"] = "all" if max_order is None else str(max_order)
        metadata["version"] = _core.__version__
        metadata.update(sensor.description())
        return Film(radiance, variance, samples, self.wavelength_nm, metadata, sensor)

    def radiance(
        self,
        azimuth_deg: ArrayLike,
        elevation_deg: ArrayLike,
        altitude_m: float | None = None,
        method: str | None = None,
        noise: float | None = None,
        spp: int | None = None,
        seed: int = 0,
        threads: int | None = None,
        polarised: bool = False,
        max_order: int | None = None,
        sun_disc: str = "on",
        accuracy: str = "default",
    ) -> Radiance:
        """Spectral radiance in single, infinitely narrow directions.

        Parameters
        ----------
        azimuth_deg, elevation_deg : float or array_like, shape (n,)
            Where to look: clockwise from north, up. A number goes with every value of the other. [deg]
        altitude_m : float, optional
            Observer above sea level; on the ground by default. [m]
        method : str, optional
            ``"path"`` (default), ``"shells"`` (no noise; the standard error is 0), ``"tracker"`` or ``"classic"``.
        noise : float, optional
            The largest relative standard error over directions and wavelengths to reach, such as 0.01; instead of
            `spp`.
        spp : int, optional
            Paths per direction, 64 by default.
        seed : int
            The same seed gives the same bits, on any number of threads.
        threads : int, optional
            1 to 1024; all cores by default.
        polarised : bool
            Stokes vectors are not built as yet: True is an error.
        max_order : int, optional
            Count this many scatterings and reflections only; 1 is single scattering.
        sun_disc : str
            ``"on"``, ``"off"`` or ``"only"``; a collimated sun is never seen.
        accuracy : str
            How finely ``"shells"`` cuts: ``"preview"``, ``"default"`` or ``"high"``.

        Returns
        -------
        Radiance
            ``.radiance`` and ``.standard_error``, shape (direction, wavelength).

        Notes
        -----
        For `noise` a pilot run estimates the variance, and a run of its own, with fresh random numbers and the number
        of paths that the pilot asks for, gives the result: its length does not depend on its own values, so it stays
        unbiased. Only if its standard error still misses the target does it become the pilot of a longer one; runs
        with a chance low error are then preferred a little, by far less than the error reported.

        Examples
        --------
        >>> import celaje
        >>> sky = celaje.sky(sun_elevation=30, wavelengths="450,650")
        >>> L = sky.radiance([0.0, 90.0], 45.0, noise=0.05)
        >>> bool((L.standard_error <= 0.05 * L.radiance).all())
        True
        """
        if polarised:
            raise NotBuiltError(
                "polarised radiance is not built as yet",
                "leave polarised=True out: I is what you get",
            )
        azimuth, elevation = _directions(azimuth_deg, elevation_deg)
        sensor = _core.Sensor.directions(azimuth, elevation)
        max_order, threads = _order(max_order), _threads(threads)

        def run(spp: int, seed: int) -> Radiance:
            values, variance, _ = self._raw.render(
                sensor, method, accuracy, spp, seed, max_order, sun_disc, altitude_m, threads
            )
            error = np.sqrt(variance[0])
            return Radiance(values[0], error, azimuth, elevation, self.wavelength_nm, spp, seed)

        seed = _count("seed", seed, 2**64 - 1, least=0)
        if noise is None:
            return run(_count("spp", DEFAULT_SPP if spp is None else spp, MAX_SPP), seed)
        if spp is not None:
            raise InvalidInputError("noise and spp are both given", "give one of the two")
        if not 0.0 < noise < np.inf:
            raise OutOfRangeError(
                f"noise = {noise} is outside (0, inf)",
                "give 0.01 for 1 %",
                "noise",
                noise,
                "",
                "(0, inf)",
            )
        result = run(PILOT_SPP, seed)
        while True:
            reached = _relative_error(result)
            if reached <= noise and result.seed != seed:
                return result
            paths = max(result.spp * NOISE_MARGIN * (reached / noise) ** 2, PILOT_SPP)
            if paths > MAX_SPP:
                raise TooLargeError(
                    f"noise = {noise:g} would take {paths:.3g} paths per direction; the limit is {MAX_SPP}",
                    "ask for a larger noise",
                )
            result = run(int(np.ceil(paths)), (result.seed + 1) % 2**64)

    def irradiance(
        self,
        altitude_m: float | None = None,
        method: str | None = None,
        spp: int | None = None,
        seed: int = 0,
        threads: int | None = None,
        max_order: int | None = None,
        accuracy: str = "default",
    ) -> Irradiance:
        """Spectral irradiance on planes at the observer, direct and diffuse.

        Parameters
        ----------
        altitude_m : float, optional
            Observer above sea level; on the ground by default. [m]
        method : str, optional
            ``"path"`` (default), ``"tracker"`` or ``"classic"``.
        spp : int, optional
            Paths for each of the 256 cells of the sky, and of the disc, 64 by default.
        seed : int
            The same seed gives the same bits, on any number of threads.
        threads : int, optional
            1 to 1024; all cores by default.
        max_order : int, optional
            Count this many scatterings and reflections only; 1 is single scattering.
        accuracy : str
            How finely ``"shells"`` cuts: ``"preview"``, ``"default"`` or ``"high"``.

        Returns
        -------
        Irradiance
            ``.direct_normal``, ``.direct``, ``.diffuse``, ``.global_``, shape (wavelength,), and their standard errors;
            ``.lux`` and ``.cct_k``.

        Raises
        ------
        UnknownNameError, OutOfRangeError, InvalidInputError
            Bad arguments.

        Examples
        --------
        >>> import celaje
        >>> sky = celaje.sky(sun_elevation=40)
        >>> E = sky.irradiance(spp=8)
        >>> E.global_.shape
        (81,)
        >>> 60e3 < E.lux < 90e3
        True
        """
        fields = self._raw.irradiance(
            method,
            accuracy,
            _count("spp", DEFAULT_SPP if spp is None else spp, MAX_SPP),
            _count("seed", seed, 2**64 - 1, least=0),
            _order(max_order),
            altitude_m,
            _threads(threads),
        )
        return Irradiance(**fields)

    def __repr__(self) -> str:
        azimuth, elevation = self._raw.sun_position
        w = self.wavelength_nm
        return (
            f"<Sky, sun at azimuth {azimuth:.1f}, elevation {elevation:.1f} deg, "
            f"{w.size} wavelengths {w[0]:g} to {w[-1]:g} nm>"
        )


def sky(
    *,
    at: Place | None = None,
    time: When | None = None,
    local: bool = False,
    altitude: float | None = None,
    sun_elevation: float | None = None,
    sun_azimuth: float | None = None,
    sun_distance_au: float | None = None,
    aerosol: str | Aerosol | None = None,
    aod_550: float | None = None,
    aod: float | None = None,
    turbidity: float | None = None,
    visibility: float | None = None,
    stratosphere: str | None = None,
    mesosphere: str | None = None,
    humidity: float | None = None,
    ozone: float | None = None,
    ozone_climate: str | None = None,
    no_ozone: bool = False,
    no2: float | None = None,
    water: float | None = None,
    co2: float | None = None,
    albedo: float | str | None = None,
    atmosphere: str | None = None,
    sun_spectrum: str = "tsis1",
    wavelengths: str | ArrayLike | None = None,
) -> Sky:
    """The sky of a place and a time, or under a sun put anywhere by hand.

    The words are those of the command line. What is not given, the climate tells; ``sky.conditions`` says what and why.

    Parameters
    ----------
    at : (float, float) or str, optional
        Latitude (-90 to 90, north positive) and longitude (-360 to 360, east positive) [deg], or the name of a city:
        ``"Zaragoza"``, ``"Córdoba, Argentina"``. Needs `time`.
    time : str, datetime or datetime64, optional
        Instant, 1900 to 2100: ``"2026-06-21T18:30Z"``, a datetime with a time zone, a datetime64 (which is UTC); or
        ``"now"``, ``"sunset"``, ``"2026-06-21 civil dusk-10min"``, by the calendar of the place. Needs `at`.
    local : bool
        A time without an offset is that of the place's clocks.
    altitude : float, optional
        Ground above sea level, -500 to 9000. [m]
    sun_elevation, sun_azimuth : float, optional
        True direction of the sun, azimuth clockwise from north (180 by default): instead of `at` and `time`, or in
        spite of them. [deg]
    sun_distance_au : float, optional
        Distance of the sun, 0.9 to 1.1. [au]
    aerosol : str or Aerosol, optional
        Aerosol type: bare names are AIAA, ``opac:NAME`` OPAC; ``"climate"`` is what is found for the place. Or an
        :class:`Aerosol`, such as one of your own.
    aod_550, aod : float, optional
        Vertical aerosol optical depth at 550 nm, 0 to 10; two names for one thing. [1]
    turbidity : float, optional
        Factor on that optical depth, 0 to 100. [1]
    visibility : float, optional
        Visibility at the ground, 0.1 to 400, instead of an optical depth. [km]
    stratosphere, mesosphere : str, optional
        Upper aerosols: ``"background"`` (default), ``"volcanic-fresh"``, ``"volcanic-aged"``, ``"none"``; ``"dust"``
        (default), ``"dust-and-ice"``, ``"none"``.
    humidity : float, optional
        Relative humidity of the aerosol, 0 to 99. [%]
    ozone : float, optional
        Ozone column, 0 to 1000. [DU]
    ozone_climate : str, optional
        Where the ozone column comes from if not given: ``"sbuv"``, ``"van-heuklon"``, ``"arosa"``.
    no_ozone : bool
        Leave ozone out.
    no2 : float, optional
        Nitrogen dioxide column, 0 to 20, 0 by default. [DU]
    water : float, optional
        Precipitable water, 0 to 200. [mm]
    co2 : float, optional
        Carbon dioxide, 0 to 10 000. [ppm]
    albedo : float or str, optional
        Lambertian reflectance of the ground, 0 to 1, or a preset such as ``"fresh-snow"``. [1]
    atmosphere : str, optional
        Reference atmosphere: ``"us76"``, ``"tropical"``, ``"midlatitude-summer"``, …
    sun_spectrum : str
        Sunlight above the air: ``"tsis1"``, ``"gueymard2004"`` or ``"classic"``.
    wavelengths : str or array_like, optional
        Vacuum, 280 to 2500, increasing; ``"380:780:5"`` by default. [nm]

    Returns
    -------
    Sky

    Raises
    ------
    OutOfRangeError
        Message gives name, value, unit, range.
    UnknownNameError
        Message gives the known names and the nearest one.
    InvalidInputError
        A time without a time zone, a place without a time, a city that is not known or is ambiguous, a sunset that does
        not happen, …

    Examples
    --------
    >>> import celaje
    >>> sky = celaje.sky(at=(41.65, -0.88), time="2026-06-21T18:30Z", wavelengths="400:700:50")
    >>> sky.conditions.albedo.reason
    'broadband mean of the surroundings: grass 50 %, crop 42 %, water 7 %; spectral in use'
    >>> sky.medium
    Medium(245 altitudes 417.676 to 100000 m, 7 wavelengths 400 to 700 nm)
    """
    own = None
    if isinstance(aerosol, Aerosol):
        own, aerosol, humidity = aerosol._for_a_sky(humidity)
    words = Words(
        altitude=altitude,
        sun_elevation=sun_elevation,
        sun_azimuth=sun_azimuth,
        sun_distance_au=sun_distance_au,
        aerosol=aerosol,
        aod_550=aod_550,
        aod=aod,
        turbidity=turbidity,
        visibility=visibility,
        stratosphere=stratosphere,
        mesosphere=mesosphere,
        humidity=humidity,
        ozone=ozone,
        ozone_climate=ozone_climate,
        no_ozone=no_ozone,
        no2=no2,
        water=water,
        co2=co2,
        albedo=albedo,
        atmosphere=atmosphere,
    )
    conditions = read_conditions(at, time, local, words)
    raw = _core.Sky.from_conditions(conditions, wavelength_grid(wavelengths), sun_spectrum, own)
    in_force = raw.conditions()
    made = Sky(raw, None if in_force is None else Conditions._of(in_force))
    made._origin["sun_spectrum"] = sun_spectrum
    return made


def _sensor(
    projection: str,
    size: int | str | tuple[int, int],
    fov: float | None,
    look: tuple[float, float] | None,
) -> _core.Sensor:
    if projection not in PROJECTIONS:
        known = ", ".join(PROJECTIONS)
        raise UnknownNameError(
            f"unknown projection '{projection}'", f"known: {known}", projection, PROJECTIONS
        )
    if projection == "latlong" and fov is not None:
        raise InvalidInputError(
            "fov has no meaning for latlong, which shows the whole sphere", "leave it out"
        )
    if projection != "perspective" and look is not None:
        raise InvalidInputError(
            f"look has no meaning for {projection}", 'leave it out, or render("perspective")'
        )
    width, height = _size(size, projection == "latlong")
    if projection == "latlong":
        return _core.Sensor.latlong(width, height)
    if projection == "fisheye":
        return _core.Sensor.fisheye(width, height, 180.0 if fov is None else float(fov))
    azimuth, elevation = (180.0, 30.0) if look is None else look
    fov = 90.0 if fov is None else float(fov)
    return _core.Sensor.perspective(width, height, fov, float(azimuth), float(elevation))


def _size(size: int | str | tuple[int, int], latlong: bool) -> tuple[int, int]:
    try:
        if isinstance(size, str):
            parts = [int(part) for part in size.lower().split("x")]
        else:
            parts = [int(part) for part in np.atleast_1d(size)]
            if parts != list(np.atleast_1d(size)):
                raise ValueError
        width, height = parts if len(parts) == 2 else (parts[0] * (2 if latlong else 1), *parts)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInputError(
            f"size {size!r} is not understood", 'give pixels such as 512, (512, 256) or "512x256"'
        ) from None
    if not (0 < width < 2**40 and 0 < height < 2**40):
        raise InvalidInputError(
            f"size {width}x{height} is no size of a picture", "give a size of at least 1x1"
        )
    return width, height


def _directions(azimuth_deg: ArrayLike, elevation_deg: ArrayLike) -> tuple[Floats, Floats]:
    azimuth, elevation = vector("azimuth_deg", azimuth_deg), vector("elevation_deg", elevation_deg)
    if azimuth.size != elevation.size and 1 not in (azimuth.size, elevation.size):
        raise ShapeMismatchError(
            f"elevation_deg has shape {elevation.shape}, expected {azimuth.shape}, that of azimuth_deg",
            "give as many elevations as azimuths",
        )
    azimuth, elevation = np.broadcast_arrays(azimuth, elevation)
    return np.ascontiguousarray(azimuth), np.ascontiguousarray(elevation)


def _relative_error(result: Radiance) -> float:
    """The largest standard error over radiance, where there is any light."""
    lit = result.radiance > 0.0
    if not lit.any():
        return 0.0
    return float((result.standard_error[lit] / result.radiance[lit]).max())


def _count(name: str, value: int, most: int, least: int = 1) -> int:
    """A whole number in a range that the extension can take."""
    number = float(value)
    if not least <= number <= most:
        allowed = f"[{least}, {most}]"
        raise OutOfRangeError(
            f"{name} = {value} is outside {allowed}",
            f"give a value in {allowed}",
            name,
            number,
            "",
            allowed,
        )
    if number != int(value):
        raise InvalidInputError(f"{name} = {value} is not a whole number", "round it")
    return int(value)


def _order(max_order: int | None) -> int | None:
    return None if max_order is None else _count("max_order", max_order, MAX_SPP, least=0)


def _threads(threads: int | None) -> int | None:
    return None if threads is None else _count("threads", threads, 1024)

"""Where skies come from: a place and a time, a sun put by hand, a file of tables."""

from __future__ import annotations

import os

from numpy.typing import ArrayLike

from . import _core
from ._arrays import wavelength_grid
from ._climate import Place, When, Words, read_conditions
from ._conditions import Conditions
from ._optics import Aerosol
from ._sky import Sky


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
        Upper aerosols: ``"background"`` (default), ``"volcanic-fresh"``, ``"volcanic-aged"``, ``"none"``; ``"dust"``,
        ``"ice"``, ``"dust-and-ice"``, ``"none"`` (default).
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
    Medium(240 altitudes 417.676 to 100000 m, 7 wavelengths 400 to 700 nm)
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


def tables(path: str | os.PathLike[str]) -> Sky:
    """A sky from a file of tables, made by :meth:`Sky.save_tables` or the command ``celaje bake``.

    Parameters
    ----------
    path : str or path
        Such as ``"air.celaje"``.

    Returns
    -------
    Sky
        Under the sun that it was baked with; :meth:`Sky.under` moves it. ``conditions`` and ``atmosphere`` are None.

    Raises
    ------
    FileError
        Missing, none of ours, of another version, cut short or damaged; the message says which.
    """
    raw, origin = _core.Sky.load_tables(os.fspath(path))
    made = Sky(raw)
    made._origin = dict(origin)
    return made

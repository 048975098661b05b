"""Place and time to conditions, each with its reason."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Generic, TypeVar

from . import _core
from ._errors import InvalidInputError

T = TypeVar("T")


@dataclass(frozen=True)
class Condition(Generic[T]):
    """One value in force: what it is, where it comes from and why.

    Attributes
    ----------
    value : float, str or datetime
        The value, in `unit`.
    unit : str
        Empty for a pure number or a name.
    source : str
        Data or method that it comes from; ``"user"`` if it was given.
    reason : str
        Why this value, in words.
    """

    value: T
    unit: str
    source: str
    reason: str


@dataclass(frozen=True, repr=False)
class Conditions:
    """Everything that a sky needs to know about its place and time.

    Made by :func:`climate`; also ``sky.conditions``. Printing one shows all of it, as ``celaje explain`` does.

    Attributes
    ----------
    latitude_deg, longitude_deg : Condition or None
        North and east positive [deg]; None when only the sun was given.
    time : Condition or None
        Instant in UTC; None when only the sun was given.
    altitude_m : Condition
        Ground above sea level. [m]
    sun_elevation_deg, sun_azimuth_deg : Condition
        True direction of the middle of the disc, azimuth clockwise from north. [deg]
    sun_distance_au : Condition
        Distance of the sun. [au]
    atmosphere : Condition
        Name of the reference atmosphere.
    ozone_du : Condition
        Ozone column above the ground. [DU]
    aerosol : Condition
        Name of the aerosol type.
    aod_550 : Condition
        Vertical aerosol optical depth at 550 nm. [1]
    humidity_percent : Condition
        Relative humidity of the aerosol. [%]
    albedo : Condition
        Lambertian reflectance of the ground. [1]
    """

    latitude_deg: Condition[float] | None
    longitude_deg: Condition[float] | None
    time: Condition[datetime] | None
    altitude_m: Condition[float]
    sun_elevation_deg: Condition[float]
    sun_azimuth_deg: Condition[float]
    sun_distance_au: Condition[float]
    atmosphere: Condition[str]
    ozone_du: Condition[float]
    aerosol: Condition[str]
    aod_550: Condition[float]
    humidity_percent: Condition[float]
    albedo: Condition[float]
    _rows: tuple[tuple[str, str, str, str, str], ...] = ()

    def __iter__(
        self,
    ) -> Iterator[tuple[str, Condition[float] | Condition[str] | Condition[datetime]]]:
        """Name and condition of every field that has a value."""
        for field in fields(self):
            condition = getattr(self, field.name)
            if isinstance(condition, Condition):
                yield field.name, condition

    def __repr__(self) -> str:
        lines = []
        for key, value, unit, source, reason in self._rows:
            lines.append(f"{key:18} {value + ' ' + unit:26} {reason} [{source}]")
        return "\n".join(lines)

    def metadata(self) -> list[tuple[str, str]]:
        """Name and text of each condition and of its reason, as files of pictures keep them."""
        entries = []
        for key, value, _, source, reason in self._rows:
            entries += [(key, value), (f"{key}.reason", f"{reason} [{source}]")]
        return entries


def conditions_of(raw: _core.Conditions) -> Conditions:
    """The dataclass of what the extension found."""
    found: dict[str, Condition[object] | None] = dict.fromkeys(
        ("latitude_deg", "longitude_deg", "time")
    )
    for name, (value, unit, source, reason) in raw.fields().items():
        if name == "time":
            # Python 3.10 does not read "Z".
            value = datetime.fromisoformat(str(value).replace("Z", "+00:00"))
        found[name] = Condition(value, unit, source, reason)
    return Conditions(**found, _rows=tuple(raw.rows()))  # type: ignore[arg-type]


def read_conditions(
    *,
    at: tuple[float, float] | str | None = None,
    time: datetime | str | None = None,
    altitude: float | None = None,
    sun_elevation: float | None = None,
    sun_azimuth: float | None = None,
    sun_distance_au: float | None = None,
    atmosphere: str | None = None,
    ozone: float | None = None,
    ozone_climate: str | None = None,
    no_ozone: bool = False,
    aerosol: str | None = None,
    aod_550: float | None = None,
    aod: float | None = None,
    turbidity: float | None = None,
    humidity: float | None = None,
    albedo: float | str | None = None,
) -> _core.Conditions:
    """The extension's conditions from the words of :func:`celaje.sky`."""
    if aod is not None and aod_550 is not None:
        raise InvalidInputError(
            "aod and aod_550 are the same thing, given twice", "give aod_550 only"
        )
    return _core.Conditions(
        at=_place(at),
        time=_instant(time),
        sun_elevation=sun_elevation,
        sun_azimuth=sun_azimuth,
        sun_distance_au=sun_distance_au,
        altitude_m=altitude,
        atmosphere=atmosphere,
        ozone_du=ozone,
        ozone_climate=ozone_climate,
        no_ozone=no_ozone,
        aerosol=aerosol,
        aod_550=aod if aod_550 is None else aod_550,
        turbidity=turbidity,
        humidity_percent=humidity,
        albedo=albedo,
    )


def climate(
    at: tuple[float, float] | str,
    time: datetime | str,
    *,
    altitude: float | None = None,
    ozone_climate: str | None = None,
) -> Conditions:
    """Conditions of a place at a time, as the climate tells them.

    Parameters
    ----------
    at : (float, float) or str
        Latitude (north positive) and longitude (east positive), or ``"41.65,-0.88"``. [deg]
    time : datetime or str
        Instant with its time zone, 1900 to 2100, such as ``"2026-06-21T18:30Z"``.
    altitude : float, optional
        Ground above sea level, -500 to 9000. [m]
    ozone_climate : str, optional
        ``"sbuv"`` (default), ``"van-heuklon"`` or ``"arosa"``.

    Returns
    -------
    Conditions
        Each field with its value, unit, source and reason.

    Raises
    ------
    OutOfRangeError
        Message gives name, value, unit, range.
    InvalidInputError
        A time without a time zone, or one that is not understood.

    Examples
    --------
    >>> import celaje
    >>> c = celaje.climate(at=(41.65, -0.88), time="2026-06-21T18:30Z")
    >>> round(c.sun_elevation_deg.value, 2)
    11.0
    >>> c.atmosphere.value, c.atmosphere.reason[:30]
    ('climate', 'blended for 41.6° N and the se')
    """
    return conditions_of(
        read_conditions(at=at, time=time, altitude=altitude, ozone_climate=ozone_climate)
    )


def _place(at: tuple[float, float] | str | None) -> tuple[float, float] | None:
    if at is None:
        return None
    parts = at.split(",") if isinstance(at, str) else at
    try:
        latitude, longitude = parts
        return float(latitude), float(longitude)
    except (TypeError, ValueError):
        raise InvalidInputError(
            f"the place {at!r} is not understood",
            "give latitude and longitude in degrees, such as at=(41.65, -0.88)",
        ) from None


def _instant(time: datetime | str | None) -> str | None:
    if time is None or isinstance(time, str):
        return time
    if isinstance(time, datetime):
        return time.isoformat()
    raise InvalidInputError(
        f"the time {time!r} is neither text nor a datetime",
        'give time="2026-06-21T18:30Z", or a datetime with a time zone',
    )

"""What holds at a place and a time, each value with its reason; and the same of many places and times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from datetime import datetime
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import Floats
from ._errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


@dataclass(frozen=True)
class Condition(Generic[T_co]):
    """One value in force: what it is, where it comes from and why.

    Attributes
    ----------
    value : float, str, datetime or None
        The value, in `unit`; None for an event that does not happen.
    unit : str
        Empty for a pure number or a name.
    uncertainty : float or None
        Standard deviation about the value, in `unit`, where known.
    source : str
        Data or method that it comes from; ``"user"`` if it was given.
    reason : str
        Why this value, in words.
    """

    value: T_co
    unit: str
    uncertainty: float | None
    source: str
    reason: str


@dataclass(frozen=True, repr=False)
class Conditions:
    """Everything that a sky needs to know about its place and time, and what else is known of them.

    Made by :func:`celaje.climate`; also ``sky.conditions``. Printing one shows all of it, as ``celaje explain`` does.
    Iterating gives name and condition of all that there are.

    Attributes
    ----------
    altitude_m : Condition
        Ground above sea level. [m]
    sun_elevation_deg, sun_azimuth_deg : Condition
        True direction of the middle of the disc, azimuth clockwise from north. [deg]
    sun_distance_au : Condition
        Distance of the sun. [au]
    atmosphere : Condition
        Name of the reference atmosphere; ``"climate"``: blended for the place and the season.
    ozone_du, no2_du : Condition
        Columns above the ground. [DU]
    water_mm : Condition
        Precipitable water above the ground. [mm]
    co2_ppm : Condition
        Carbon dioxide. [ppm]
    aerosol : Condition
        Name of the aerosol; ``"climate"``: the mixture that was found.
    aod_550 : Condition
        Vertical optical depth of the tropospheric aerosol at 550 nm; NaN where one of the next two sets it. [1]
    visibility_km, tabulated_factor : Condition or None
        What sets the amount of aerosol if it was given so, once the sky is composed.
    stratosphere, mesosphere : Condition
        Names of the upper aerosols.
    humidity_percent : Condition
        Relative humidity of the aerosol. [%]
    albedo : Condition
        Lambertian reflectance of the ground, broadband. [1]
    latitude_deg, longitude_deg : Condition or None
        North and east positive [deg]; these and all below are None when only the sun was given.
    time, local_time : Condition or None
        Instant in UTC, and by the clock of the place; the latter is None far from any city.
    aerosol_type : Condition or None
        The AIAA type nearest to the mixture; None if the aerosol was given.
    moon_elevation_deg, moon_azimuth_deg, moon_distance_km : Condition or None
        Where the Moon stands, seen from the place. [deg], [km]
    moon_phase_deg, moon_illuminated : Condition or None
        Angle sun-Moon-Earth, 0 at full Moon [deg]; lit part of the disc. [1]
    astronomical_dawn, nautical_dawn, civil_dawn, sunrise, noon : Condition or None
        Instants of the day around the time; their value is None if they do not happen, and the reason says why.
    sunset, civil_dusk, nautical_dusk, astronomical_dusk : Condition or None
        The same.
    """

    altitude_m: Condition[float]
    sun_elevation_deg: Condition[float]
    sun_azimuth_deg: Condition[float]
    sun_distance_au: Condition[float]
    atmosphere: Condition[str]
    ozone_du: Condition[float]
    no2_du: Condition[float]
    water_mm: Condition[float]
    co2_ppm: Condition[float]
    aerosol: Condition[str]
    aod_550: Condition[float]
    stratosphere: Condition[str]
    mesosphere: Condition[str]
    humidity_percent: Condition[float]
    albedo: Condition[float]
    latitude_deg: Condition[float] | None = None
    longitude_deg: Condition[float] | None = None
    time: Condition[datetime] | None = None
    local_time: Condition[datetime] | None = None
    aerosol_type: Condition[str] | None = None
    visibility_km: Condition[float] | None = None
    tabulated_factor: Condition[float] | None = None
    moon_elevation_deg: Condition[float] | None = None
    moon_azimuth_deg: Condition[float] | None = None
    moon_distance_km: Condition[float] | None = None
    moon_phase_deg: Condition[float] | None = None
    moon_illuminated: Condition[float] | None = None
    astronomical_dawn: Condition[datetime | None] | None = None
    nautical_dawn: Condition[datetime | None] | None = None
    civil_dawn: Condition[datetime | None] | None = None
    sunrise: Condition[datetime | None] | None = None
    noon: Condition[datetime | None] | None = None
    sunset: Condition[datetime | None] | None = None
    civil_dusk: Condition[datetime | None] | None = None
    nautical_dusk: Condition[datetime | None] | None = None
    astronomical_dusk: Condition[datetime | None] | None = None
    # Name, text for people, reason and so on, in the order of `celaje explain`.
    _rows: tuple[tuple[str, str, Condition[Any]], ...] = ()

    @staticmethod
    def _of(raw: _core.Conditions) -> Conditions:
        rows = []
        for key, text, value, is_time, unit, uncertainty, source, reason in raw.rows():
            known: object = value
            if is_time or key == "local_time":
                # Python 3.10 does not read "Z".
                known = datetime.fromisoformat(str(value).replace("Z", "+00:00"))
            rows.append((key, text, Condition(known, unit, uncertainty, source, reason)))
        names = {field.name for field in fields(Conditions)}
        unset = Condition(
            float("nan"), "", None, "user", "set by another word when the sky is composed"
        )
        found: dict[str, Any] = {"aod_550": unset}
        found |= {key: condition for key, _, condition in rows if key in names}
        return Conditions(**found, _rows=tuple(rows))

    def __iter__(self) -> Iterator[tuple[str, Condition[Any]]]:
        """Name and condition, in the order of ``celaje explain``."""
        return ((key, condition) for key, _, condition in self._rows)

    def __repr__(self) -> str:
        lines = [("CONDITION", "VALUE", "±", "UNIT", "REASON [SOURCE]")]
        for key, text, c in self._rows:
            spread = "" if c.uncertainty is None else _two_digits(c.uncertainty)
            lines.append((key, text, spread, c.unit, f"{c.reason} [{c.source}]"))
        return _aligned(lines)

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Value, unit, uncertainty, source and reason of every condition by its name.

        Returns
        -------
        dict of str to dict
            Times are :class:`datetime.datetime`; all else is plain text, numbers and None.
        """
        return {name: dict(vars(condition)) for name, condition in self}

    def xarray(self) -> xarray.Dataset:
        """Every condition as a scalar of a dataset, with its unit, source and reason; needs ``celaje[xarray]``."""
        dataset = _dataset()
        data = {}
        for name, c in self:
            value = c.value
            if value is None:
                value = np.datetime64("NaT", "ms")
            elif name == "local_time":
                value = value.isoformat()
            elif isinstance(value, datetime):
                value = _datetime64(value)
            attributes: dict[str, object] = {"source": c.source, "reason": c.reason}
            if not isinstance(value, (str, np.datetime64)):
                attributes["units"] = _cf_unit(c.unit)
            if c.uncertainty is not None:
                attributes["uncertainty"] = c.uncertainty
            data[name] = ((), value, attributes)
        return dataset(data, attrs=_attributes())

    def metadata(self) -> list[tuple[str, str]]:
        """Name and text of each condition and of its reason, as files of pictures keep them."""
        entries = []
        for key, text, c in self._rows:
            entries += [(key, text), (f"{key}.reason", f"{c.reason} [{c.source}]")]
        return entries


@dataclass(frozen=True, repr=False)
class Climate(Mapping[str, NDArray[Any]]):
    """Conditions of many places, many times, or both; made by :func:`celaje.climate` from lists.

    A mapping of names to arrays over `dims`: ``table["ozone_du"]``. Uncertainties, where known, are under
    ``<name>_uncertainty``. The events of the day are those of single :class:`Conditions` only.

    Attributes
    ----------
    dims : tuple of str
        ``("place",)``, ``("time",)`` or ``("place", "time")``: what was given as a list.
    place : tuple of str
        The places as they were given.
    latitude_deg, longitude_deg : ndarray, shape (place,)
        North and east positive. [deg]
    time : ndarray of datetime64, shape (time,), or (place, time) where the same words are other instants elsewhere
        Instants in UTC.
    unit, source : mapping of str to str
        Of each name.
    """

    dims: tuple[str, ...]
    place: tuple[str, ...]
    latitude_deg: Floats
    longitude_deg: Floats
    time: NDArray[np.datetime64]
    unit: Mapping[str, str]
    source: Mapping[str, str]
    _values: Mapping[str, NDArray[Any]]

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self._values[name]
        except KeyError:
            known = ", ".join(self._values)
            message = f"unknown condition '{name}'"
            # A mapping's own kind of error as well, for `get` and `in`.
            raise _MissingError(message, f"known: {known}", name, tuple(self._values)) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        times = np.sort(self.time, axis=None)
        where = ", ".join(self.place[:4]) + (", …" if len(self.place) > 4 else "")
        head = (
            f"Climate of {len(self.place)} place{'s' * (len(self.place) > 1)} ({where}), "
            f"{self.time.shape[-1]} time{'s' * (self.time.shape[-1] > 1)} ({times[0]} to {times[-1]} UTC)"
        )
        lines = [("CONDITION", "LEAST", "MEAN", "MOST", "UNIT [SOURCE]")]
        for name, values in self._values.items():
            if name.endswith("_uncertainty"):
                continue
            if values.dtype.kind == "f":
                least, mean, most = (f"{f(values):.5g}" for f in (np.min, np.mean, np.max))
            else:
                names, counts = np.unique(values, return_counts=True)
                least, mean, most = (
                    "",
                    str(names[np.argmax(counts)]),
                    f"{names.size} kind{'s' * (names.size > 1)}",
                )
            lines.append((name, least, mean, most, f"{self.unit[name]} [{self.source[name]}]"))
        return f"{head}\n{_aligned(lines)}"

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """The arrays by their names, with place, latitude_deg, longitude_deg and time."""
        where = {
            "place": np.array(self.place),
            "latitude_deg": self.latitude_deg,
            "longitude_deg": self.longitude_deg,
            "time": self.time,
        }
        return {**where, **self._values}

    def xarray(self) -> xarray.Dataset:
        """A dataset over `dims`, with units and sources; needs ``celaje[xarray]``."""
        dataset = _dataset()
        data = {}
        for name, values in self._values.items():
            of = name.removesuffix("_uncertainty")
            attributes = {"source": self.source[of]}
            if values.dtype.kind == "f":
                attributes["units"] = _cf_unit(self.unit[of])
            if name != of:
                attributes["long_name"] = f"standard deviation of {of}"
            elif f"{name}_uncertainty" in self._values:
                attributes["ancillary_variables"] = f"{name}_uncertainty"
            data[name] = (self.dims, values, attributes)
        many = "place" in self.dims
        along = ("place",) if many else ()
        north = {"units": "degrees_north", "standard_name": "latitude"}
        east = {"units": "degrees_east", "standard_name": "longitude"}
        coordinates: dict[str, Any] = {
            "place": (along, np.array(self.place if many else self.place[0])),
            "latitude_deg": (along, self.latitude_deg if many else self.latitude_deg[0], north),
            "longitude_deg": (along, self.longitude_deg if many else self.longitude_deg[0], east),
        }
        shared = self.time.ndim == 1
        if "time" in self.dims:
            name, dims = ("time", ("time",)) if shared else ("instant", ("place", "time"))
            coordinates[name] = (dims, self.time)
        else:
            times = self.time[0] if shared else self.time[:, 0]
            coordinates["time" if shared else "instant"] = (() if shared else along, times)
        return dataset(data, coordinates, attrs=_attributes())


class _MissingError(UnknownNameError, KeyError):
    """A name that a table does not have."""

    __module__ = "celaje"
    __str__ = UnknownNameError.__str__


def _aligned(lines: list[tuple[str, str, str, str, str]]) -> str:
    """Columns: the first and the last two to the left, numbers to the right."""
    a, b, c, d = (max(len(line[i]) for line in lines) for i in range(4))
    return "\n".join(f"{k:{a}}  {v:>{b}}  {s:>{c}}  {u:{d}}  {r}" for k, v, s, u, r in lines)


def _datetime64(value: datetime) -> np.datetime64:
    return np.datetime64(round(value.timestamp() * 1e3), "ms")


def _cf_unit(unit: str) -> str:
    """A unit as CF writes it."""
    return {"": "1", "deg": "degree", "%": "percent"}.get(unit, unit)


def _attributes() -> dict[str, str]:
    return {"Conventions": "CF-1.11", "source": f"celaje {_core.__version__}"}


def _two_digits(value: float) -> str:
    """A positive number to two digits, never with an exponent above."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _dataset() -> type[xarray.Dataset]:
    try:
        import xarray
    except ImportError:
        raise InvalidInputError(
            "xarray is not installed", 'install it: pip install "celaje[xarray]"'
        ) from None
    return xarray.Dataset

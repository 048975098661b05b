"""Place and time to conditions, each with its reason."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any, TypedDict, overload

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._conditions import Climate, Conditions
from ._errors import InvalidInputError

if TYPE_CHECKING:
    from typing_extensions import Unpack

Place = str | tuple[float, float]
When = str | datetime | np.datetime64


class Words(TypedDict, total=False):
    """What may be given in spite of the climate; :func:`celaje.sky` says what each means."""

    altitude: float | None
    sun_elevation: float | None
    sun_azimuth: float | None
    sun_distance_au: float | None
    aerosol: str | None
    aod_550: float | None
    aod: float | None
    turbidity: float | None
    visibility: float | None
    stratosphere: str | None
    mesosphere: str | None
    humidity: float | None
    ozone: float | None
    ozone_climate: str | None
    no_ozone: bool
    no2: float | None
    water: float | None
    co2: float | None
    albedo: float | str | None
    atmosphere: str | None


@overload
def climate(  # type: ignore[overload-overlap]
    at: Place, time: When, *, local: bool = False, **words: Unpack[Words]
) -> Conditions: ...
@overload
def climate(
    at: Place | Iterable[Place] | NDArray[Any],
    time: When | Iterable[When] | NDArray[Any],
    *,
    local: bool = False,
    **words: Unpack[Words],
) -> Climate: ...
def climate(
    at: Place | Iterable[Place] | NDArray[Any],
    time: When | Iterable[When] | NDArray[Any],
    *,
    local: bool = False,
    **words: Unpack[Words],
) -> Conditions | Climate:
    """Conditions of a place at a time, as the climate tells them; or of lists of places, of times, or both.

    Parameters
    ----------
    at : (float, float) or str, or a list of them
        Latitude (-90 to 90, north positive) and longitude (-360 to 360, east positive) [deg], also as text
        ``"41.65,-0.88"``, or the name of a city: ``"Zaragoza"``, ``"Córdoba, Argentina"``. An array of shape (n, 2) is
        a list of coordinates.
    time : str, datetime or datetime64, or a list or an array of them
        Instant, 1900 to 2100: ``"2026-06-21T18:30Z"``, a datetime with a time zone, a datetime64 (which is UTC); or
        ``"now"``, ``"sunset"``, ``"2026-06-21 civil dusk-10min"``, by the calendar of the place.
    local : bool
        Times without an offset are those of the place's clocks.
    **words
        What is known better than the climate does: ``aerosol="desert"``, ``aod_550=0.4``, ``albedo=0.8``, …; all words
        of :func:`celaje.sky` on air, ground and sun.

    Returns
    -------
    Conditions
        Of one place and one time: each field with its value, unit, uncertainty, source and reason.
    Climate
        Of lists: a mapping of names to arrays over place and time.

    Raises
    ------
    OutOfRangeError
        Message gives name, value, unit, range.
    InvalidInputError
        A time without a time zone, a city that is not known or is ambiguous, a sunset that does not happen.

    Examples
    --------
    >>> import celaje
    >>> c = celaje.climate(at="Zaragoza", time="2026-06-21T20:30", local=True)
    >>> round(c.sun_elevation_deg.value, 2), c.aerosol_type.value
    (11.0, 'rural')
    >>> c.sunset.value.isoformat()
    '2026-06-21T19:41:25+00:00'

    A year of hours:

    >>> import numpy as np
    >>> year = np.arange("2026-01-01", "2027-01-01", dtype="datetime64[h]")
    >>> table = celaje.climate(at="Zaragoza", time=year)
    >>> table["ozone_du"].shape, table.dims
    ((8760,), ('time',))
    >>> celaje.climate(at=["Oslo, Norway", (0, -150)], time="2026-06-21 noon")["aerosol_type"].tolist()
    ['maritime-polluted', 'maritime-clean']
    """
    one_place, one_time = _is_place(at), isinstance(time, (str, datetime, np.datetime64))
    given = _words(words)
    if one_place and one_time:
        return Conditions._of(_core.Conditions(_place(at), _instant(time, local), local, given))
    places = [_place(at)] if one_place else [_place(place) for place in _listed("at", at)]
    times = [time] if one_time else _listed("time", time)
    return _table(places, times, (one_place, one_time), local, given)


def read_conditions(
    at: Place | None, time: When | None, local: bool, words: Words
) -> _core.Conditions:
    """The extension's conditions from the words of :func:`celaje.sky`."""
    return _core.Conditions(
        None if at is None else _place(at),
        None if time is None else _instant(time, local),
        local,
        _words(words),
    )


def _words(given: Mapping[str, object]) -> dict[str, object]:
    """Every word that the extension asks for, None where it was not given."""
    unknown = [word for word in given if word not in Words.__annotations__]
    if unknown:
        raise TypeError(f"climate() got an unexpected keyword argument '{unknown[0]}'")
    words = {word: given.get(word) for word in Words.__annotations__}
    aod = words.pop("aod")
    if aod is not None and words["aod_550"] is not None:
        raise InvalidInputError(
            "aod and aod_550 are the same thing, given twice", "give aod_550 only"
        )
    if aod is not None:
        words["aod_550"] = aod
    return words


def _is_place(at: object) -> bool:
    """Whether it is one place: text, or two numbers."""
    if isinstance(at, str):
        return True
    number = (int, float, np.integer, np.floating)
    return (
        isinstance(at, (tuple, list, np.ndarray))
        and len(at) == 2
        and all(isinstance(x, number) for x in at)
    )


def _place(at: object) -> Place:
    if isinstance(at, str):
        return at
    if not _is_place(at):
        raise InvalidInputError(
            f"the place {at!r} is not understood",
            'give latitude and longitude in degrees, such as at=(41.65, -0.88), or a city: at="Zaragoza"',
        )
    latitude, longitude = np.asarray(at, dtype=np.float64)
    return float(latitude), float(longitude)


def _instant(time: object, local: bool) -> str:
    """A time as text."""
    if isinstance(time, str):
        return time
    if isinstance(time, datetime):
        return time.isoformat()
    if isinstance(time, np.datetime64) and not np.isnat(time):
        text = str(np.datetime_as_string(time, unit="ms"))
        return text if local else f"{text}Z"
    raise InvalidInputError(
        f"the time {time!r} is neither text nor a datetime",
        'give time="2026-06-21T18:30Z", or a datetime with a time zone',
    )


def _listed(name: str, values: object) -> list[Any]:
    try:
        listed: list[Any] = list(values)  # type: ignore[call-overload]
    except TypeError:
        example = (
            'at=(41.65, -0.88) or at="Zaragoza"' if name == "at" else 'time="2026-06-21T18:30Z"'
        )
        raise InvalidInputError(
            f"{name} = {values!r} is not understood", f"give {example}, or a list of such"
        ) from None
    if not listed:
        raise InvalidInputError(f"{name} is empty", "give one at least")
    return listed


def _table(
    places: list[Place],
    times: list[Any],
    single: tuple[bool, bool],
    local: bool,
    words: dict[str, object],
) -> Climate:
    """Conditions of all places at all times; `single` tells which of the two was no list."""
    instants: list[str] | list[float]
    if not local and all(isinstance(time, np.datetime64) for time in times):
        stamps = np.array(times, dtype="datetime64[ms]")
        if np.isnat(stamps).any():
            raise InvalidInputError("a time is NaT, not a time", "leave it out")
        instants = (stamps.astype(np.int64) * 1e-3).tolist()
    else:
        instants = [_instant(time, local) for time in times]
    raw = _core.climate_table(places, instants, local, words)
    shape = raw["unix_s"].shape
    dims = tuple(name for name, one in zip(("place", "time"), single, strict=True) if not one)
    keep = tuple(0 if one else slice(None) for one in single)
    stamps = np.round(raw.pop("unix_s") * 1e3).astype("datetime64[ms]")
    latitude_deg, longitude_deg = raw.pop("latitude_deg"), raw.pop("longitude_deg")
    units, sources = raw.pop("unit"), raw.pop("source")
    return Climate(
        dims=dims,
        place=tuple(p if isinstance(p, str) else f"{p[0]:g},{p[1]:g}" for p in places),
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        time=stamps[0] if (stamps == stamps[:1]).all() else stamps,
        unit=units,
        source=sources,
        _values={name: np.asarray(v).reshape(shape)[keep] for name, v in raw.items()},
    )

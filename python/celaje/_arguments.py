"""What users write, made into what the extension takes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._arrays import Floats, vector
from ._errors import InvalidInputError, OutOfRangeError, ShapeMismatchError, UnknownNameError

PROJECTIONS = ("fisheye", "latlong", "perspective")
MAX_SPP = 2**32 - 1


def read_sensor(
    projection: str,
    size: int | str | tuple[int, int],
    fov: float | None,
    look: tuple[float, float] | None,
) -> _core.Sensor:
    """What looks, from the words of :meth:`celaje.Sky.render`."""
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
    width, height = read_size(size, projection == "latlong")
    if projection == "latlong":
        return _core.Sensor.latlong(width, height)
    if projection == "fisheye":
        return _core.Sensor.fisheye(width, height, 180.0 if fov is None else float(fov))
    azimuth, elevation = (180.0, 30.0) if look is None else look
    fov = 90.0 if fov is None else float(fov)
    return _core.Sensor.perspective(width, height, fov, float(azimuth), float(elevation))


def read_size(size: int | str | tuple[int, int], latlong: bool) -> tuple[int, int]:
    """Width and height from what a user may write. [pixels]."""
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


def read_directions(azimuth_deg: ArrayLike, elevation_deg: ArrayLike) -> tuple[Floats, Floats]:
    """Two vectors of the same length; a number goes with every value of the other. [deg]."""
    azimuth, elevation = vector("azimuth_deg", azimuth_deg), vector("elevation_deg", elevation_deg)
    if azimuth.size != elevation.size and 1 not in (azimuth.size, elevation.size):
        raise ShapeMismatchError(
            f"elevation_deg has shape {elevation.shape}, expected {azimuth.shape}, that of azimuth_deg",
            "give as many elevations as azimuths",
        )
    azimuth, elevation = np.broadcast_arrays(azimuth, elevation)
    return np.ascontiguousarray(azimuth), np.ascontiguousarray(elevation)


def read_count(name: str, value: int, most: int, least: int = 1) -> int:
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


def read_order(max_order: int | None) -> int | None:
    """A largest order that the extension can take."""
    return None if max_order is None else read_count("max_order", max_order, MAX_SPP, least=0)


def read_threads(threads: int | None) -> int | None:
    """A number of threads that the extension can take."""
    return None if threads is None else read_count("threads", threads, 1024)

"""Arrays of users to the contiguous ones that the extension takes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import InvalidInputError, ShapeMismatchError

Floats = NDArray[np.float64]


def as_float(name: str, values: ArrayLike) -> Floats:
    """Values as a contiguous float64 array of any shape; text and complex numbers are refused."""
    try:
        array = np.asarray(values)
        if np.iscomplexobj(array):
            raise TypeError("complex numbers")
        return np.ascontiguousarray(array, dtype=np.float64).reshape(array.shape)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(
            f"{name} is not a number or an array of numbers: {error}",
            f"give {name} as a number, a list or an array",
        ) from None


def vector(name: str, values: ArrayLike) -> Floats:
    """One-dimensional array; a number becomes one of length 1."""
    array = np.atleast_1d(as_float(name, values))
    if array.ndim != 1:
        raise ShapeMismatchError(
            f"{name} has shape {array.shape}, expected (n,)", "give a number or a flat list"
        )
    return array


def per_wavelength(name: str, values: ArrayLike, count: int) -> Floats:
    """One value for each of `count` wavelengths, from such an array or one number for all."""
    array = vector(name, values)
    if array.size not in (1, count):
        raise ShapeMismatchError(
            f"{name} has shape {array.shape}, expected ({count},), one value per wavelength",
            "give one number, or one per wavelength",
        )
    return np.ascontiguousarray(np.broadcast_to(array, (count,)))


def wavelength_grid(wavelengths: str | ArrayLike | None) -> Floats | None:
    """Wavelengths [nm] from ``"380:780:5"``, ``"450,550"`` or an array; None stays None."""
    if wavelengths is None:
        return None
    if not isinstance(wavelengths, str):
        return vector("wavelengths", wavelengths)
    try:
        if ":" not in wavelengths:
            return np.array([float(part) for part in wavelengths.split(",")])
        start, stop, step = (float(part) for part in wavelengths.split(":"))
    except ValueError:
        raise InvalidInputError(
            f"wavelengths '{wavelengths}' are not understood",
            "write START:STOP:STEP in nm such as 380:780:5, or a list such as 450,550,650",
        ) from None
    return _core.wavelength_range(start, stop, step)

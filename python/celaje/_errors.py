"""The exceptions of celaje: each says what was wrong, and what to do about it."""

from __future__ import annotations


class CelajeError(Exception):
    """What all errors of celaje are.

    Attributes
    ----------
    message : str
        What is wrong, with the argument, its value, unit and range.
    hint : str
        What to do about it; may be empty.

    Examples
    --------
    >>> import celaje
    >>> try:
    ...     celaje.sky(sun_elevation=30, aod_550=-1)
    ... except celaje.CelajeError as error:
    ...     print(error)
    aod = -1 is outside [0, 10]
    hint: give a value in [0, 10]
    """

    __module__ = "celaje"

    def __init__(self, message: str, hint: str = "", *rest: object) -> None:
        super().__init__(message, hint, *rest)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\nhint: {self.hint}" if self.hint else self.message


class OutOfRangeError(CelajeError, ValueError):
    """A number outside its range, or not a number at all.

    Attributes
    ----------
    name, unit, range : str
        Argument, its unit (empty for a pure number) and what is allowed.
    value : float
        The value given.
    """

    __module__ = "celaje"

    def __init__(
        self,
        message: str,
        hint: str = "",
        name: str = "",
        value: float = float("nan"),
        unit: str = "",
        range: str = "",
    ) -> None:
        super().__init__(message, hint, name, value, unit, range)
        self.name = name
        self.value = value
        self.unit = unit
        self.range = range


class ShapeMismatchError(CelajeError, ValueError):
    """An array whose shape does not fit the others."""

    __module__ = "celaje"


class UnknownNameError(CelajeError, ValueError):
    """A name that is in none of our lists.

    Attributes
    ----------
    name : str
        The name given.
    known : tuple of str
        All names known.
    """

    __module__ = "celaje"

    def __init__(
        self, message: str, hint: str = "", name: str = "", known: list[str] | tuple[str, ...] = ()
    ) -> None:
        super().__init__(message, hint, name, tuple(known))
        self.name = name
        self.known = tuple(known)


class InvalidInputError(CelajeError, ValueError):
    """Any other input that makes no sense."""

    __module__ = "celaje"


class TooLargeError(CelajeError, ValueError):
    """A job too large for the machine; the message gives the memory it would take."""

    __module__ = "celaje"


class FileError(CelajeError, OSError):
    """A file that cannot be read or written."""

    __module__ = "celaje"

"""What was seen: spectral radiance per pixel or direction, with its variance."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import Floats
from ._errors import InvalidInputError

if TYPE_CHECKING:
    import xarray

    from ._core import _Parts

Singles = NDArray[np.float32]


@dataclass
class Film:
    """A picture of spectral radiance; made by :meth:`Sky.render`.

    The arrays are the renderer's own memory, not copies, and may be changed: colours and files follow them.

    Attributes
    ----------
    radiance : ndarray of float32, shape (height, width, wavelength)
        Mean spectral radiance; row 0 is the top of the picture. [W m⁻² sr⁻¹ nm⁻¹]
    variance : ndarray of float32, shape (height, width, wavelength)
        Variance of that mean; 0 for a deterministic method. [(W m⁻² sr⁻¹ nm⁻¹)²]
    samples : ndarray of uint32, shape (height, width)
        Paths behind each pixel; 0 where the sensor sees nothing.
    wavelength_nm : ndarray of float64, shape (wavelength,)
        Vacuum wavelengths. [nm]
    metadata : dict of str to str
        How it came about: conditions with their reasons, method, seed, sensor. Kept in files.
    polarisation : list of (mean, variance) or None
        Stokes components Q, U and V, each a pair of arrays like `radiance` and `variance`; None in a film of scalar
        light. :attr:`stokes` has all four in one array.

    Examples
    --------
    >>> import celaje
    >>> sky = celaje.sky(sun_elevation=30, wavelengths="400:700:50")
    >>> img = sky.render("fisheye", size=8, spp=4)
    >>> img.radiance.shape, img.rgb().shape
    ((8, 8, 7), (8, 8, 3))
    """

    radiance: Singles
    variance: Singles
    samples: NDArray[np.uint32]
    wavelength_nm: Floats
    metadata: dict[str, str] = field(default_factory=dict)
    _sensor: _core.Sensor | None = field(default=None, repr=False)
    polarisation: list[tuple[Singles, Singles]] | None = field(default=None, repr=False)

    @property
    def standard_error(self) -> Singles:
        """Standard error of the mean radiance, absolute, shape (height, width, wavelength)."""
        return np.sqrt(self.variance)

    @property
    def stokes(self) -> Singles:
        """Stokes vectors (I, Q, U, V), a copy, shape (height, width, wavelength, 4). [W m⁻² sr⁻¹ nm⁻¹].

        They refer to the meridian plane of the view, the vertical plane through the direction looked at: Q > 0 where
        the electric field lies in it, Q < 0 where it is level; U > 0 where it is turned out of it by 45° anticlockwise
        as the observer sees it; V > 0 where it turns clockwise. ``docs/conventions.md`` draws the axes. A pixel's
        values are means over its points, each in its own plane.
        """
        others = [mean for mean, _ in self._polarised()]
        return np.stack([self.radiance, *others], axis=-1)

    @property
    def stokes_standard_error(self) -> Singles:
        """Standard errors of the Stokes vectors, absolute, shape (height, width, wavelength, 4)."""
        others = [variance for _, variance in self._polarised()]
        return np.sqrt(np.stack([self.variance, *others], axis=-1))

    @property
    def degree_of_polarisation(self) -> Singles:
        """Degree of linear polarisation √(Q² + U²) / I, shape (height, width, wavelength), 0 where it is black. [1].

        Noise makes it too large where there is little of it.
        """
        (q, _), (u, _), _ = self._polarised()
        degree = np.zeros_like(self.radiance)
        np.divide(np.hypot(q, u), self.radiance, out=degree, where=self.radiance > 0)
        return degree

    @property
    def angle_of_polarisation_deg(self) -> Singles:
        """Angle of the electric field ½ atan2(U, Q) in (-90, 90], shape (height, width, wavelength). [deg].

        0 where it lies in the vertical plane of the view, ±90 where it is level; it grows anticlockwise as the observer
        sees it.
        """
        (q, _), (u, _), _ = self._polarised()
        angle: Singles = np.degrees(0.5 * np.arctan2(u, q)).astype(np.float32)
        return angle

    def _polarised(self) -> list[tuple[Singles, Singles]]:
        if self.polarisation is None:
            raise InvalidInputError(
                "this film holds the radiance alone", "render it with polarised=True"
            )
        return self.polarisation

    def directions(self) -> tuple[Floats, Floats]:
        """Where the middle of each pixel looks.

        Returns
        -------
        azimuth_deg, elevation_deg : ndarray, shape (height, width)
            Azimuth clockwise from north; NaN where the sensor sees nothing. [deg]
        """
        if self._sensor is None:
            raise InvalidInputError(
                "this film does not know its sensor", "directions belong to films from Sky.render"
            )
        return self._sensor.pixel_centres()

    def rgb(
        self,
        tone: str = "gamma",
        exposure: float | None = None,
        observer: int | str = 1964,
    ) -> Singles:
        """What a display shows.

        Parameters
        ----------
        tone : str
            ``"gamma"``, ``"srgb"``, ``"filmic"`` or ``"none"``.
        exposure : float, optional
            Stops: 0 shows 10 000 cd m⁻² as white, 1 half of that. Chosen from the picture by default.
        observer : int or str
            CIE observer, 1964 (10°) or 1931 (2°).

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            Red, green and blue in [0, 1]; black where the sensor sees nothing.
        """
        rgba = _core.develop(*self._seen(), observer=str(observer), tone=tone, exposure=exposure)
        return rgba[..., :3]

    def linear_srgb(self, observer: int | str = 1964) -> Singles:
        """Absolute linear sRGB, for further work.

        Parameters
        ----------
        observer : int or str
            CIE observer, 1964 (10°) or 1931 (2°).

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            (1, 1, 1) is a D65 white of 1 cd m⁻²; negative where a colour is out of gamut. [cd m⁻²]
        """
        return _core.linear_srgb(*self._seen(), observer=str(observer))

    def save(
        self,
        path: str | os.PathLike[str],
        tone: str = "gamma",
        exposure: float | None = None,
        observer: int | str = 1964,
    ) -> None:
        """Write a file, whole or not at all, in the format that its extension names.

        ``.png`` is for display (tone and exposure applied), ``.exr`` holds linear sRGB and the radiance at every
        wavelength with its variance (and Q, U, V with theirs), ``.hdr`` linear sRGB, ``.nc`` what :meth:`xarray` gives,
        as NetCDF.

        Parameters
        ----------
        path : str or path
            An older file is overwritten.
        tone, exposure, observer
            As in :meth:`rgb`.

        Raises
        ------
        FileError
            Unknown extension, missing folder, no permission, full disk.
        """
        radiance, samples, wavelength_nm = self._seen()
        _core.save(
            os.fspath(path),
            radiance,
            np.ascontiguousarray(self.variance, dtype=np.float32),
            samples,
            wavelength_nm,
            observer=str(observer),
            tone=tone,
            exposure=exposure,
            view=self._sensor,
            metadata=list(self.metadata.items()),
            stokes=self._contiguous(),
        )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Film:
        """Read an ``.exr`` that celaje has written, bit for bit.

        Parameters
        ----------
        path : str or path

        Returns
        -------
        Film
            With its metadata; where its pixels look is not known to it.

        Raises
        ------
        FileError
            A file that cannot be read or was not written by celaje.
        """
        return cls._of(_core.read_exr(os.fspath(path)))

    def merge(self, *others: Film) -> Film:
        """Put films of the same picture, rendered with other seeds, together.

        Each pixel is the mean of all, weighted by the paths behind it, and its variance falls accordingly.

        Parameters
        ----------
        *others : Film
            At least one.

        Returns
        -------
        Film

        Raises
        ------
        InvalidInputError
            Films of the same seed, of different skies, sizes or wavelengths, or without noise.

        Examples
        --------
        >>> import celaje
        >>> sky = celaje.sky(sun_elevation=30, wavelengths="450,650")
        >>> a, b = (sky.render(size=4, spp=8, seed=seed) for seed in (1, 2))
        >>> a.merge(b).metadata["seed"], int(a.merge(b).samples.max())
        ('1,2', 16)
        """
        films = [
            (
                film._seen()[0],
                np.ascontiguousarray(film.variance, dtype=np.float32),
                *film._seen()[1:],
                list(film.metadata.items()),
                film._contiguous(),
            )
            for film in (self, *others)
        ]
        return self._of(_core.merged(films), self._sensor)

    @classmethod
    def _of(
        cls,
        parts: _Parts,
        sensor: _core.Sensor | None = None,
    ) -> Film:
        radiance, variance, samples, wavelength_nm, metadata, stokes = parts
        return cls(radiance, variance, samples, wavelength_nm, dict(metadata), sensor, stokes)

    def xarray(self) -> xarray.Dataset:
        """The film as a dataset with CF metadata; needs ``celaje[xarray]``.

        Returns
        -------
        xarray.Dataset
            ``radiance`` and ``radiance_variance`` over (y, x, wavelength), sharing memory with the film; `samples`,
            ``vza_deg`` and ``vaa_deg`` (where the observer looks) over (y, x). With polarisation also ``stokes_q``,
            ``stokes_u``, ``stokes_v``, their variances, ``degree_of_linear_polarisation`` and
            ``angle_of_polarisation_deg``.
        """
        try:
            import xarray
        except ImportError:
            raise InvalidInputError(
                "xarray is not installed", 'install it: pip install "celaje[xarray]"'
            ) from None
        unit = "W m-2 sr-1 nm-1"
        pixels, cube = ("y", "x"), ("y", "x", "wavelength")
        # CF has a name for what comes from above only; a picture may look down as well.
        radiance = {
            "units": unit,
            "long_name": "spectral radiance",
            "ancillary_variables": "radiance_variance",
        }
        variance = {"units": f"({unit})2", "long_name": "variance of the mean spectral radiance"}
        wavelength = {
            "units": "nm",
            "standard_name": "radiation_wavelength",
            "long_name": "vacuum wavelength",
        }
        data = {
            "radiance": (cube, self.radiance, radiance),
            "radiance_variance": (cube, self.variance, variance),
            "samples": (pixels, self.samples, {"units": "1", "long_name": "paths per pixel"}),
        }
        for name, (mean, of_mean) in zip("quv", self.polarisation or [], strict=False):
            meaning = f"Stokes component {name.upper()} beside the radiance I"
            data[f"stokes_{name}"] = (cube, mean, {"units": unit, "long_name": meaning})
            data[f"stokes_{name}_variance"] = (
                cube,
                of_mean,
                {"units": f"({unit})2", "long_name": "variance of its mean"},
            )
        if self.polarisation is not None:
            data["degree_of_linear_polarisation"] = (
                cube,
                self.degree_of_polarisation,
                {"units": "1", "long_name": "sqrt(Q2 + U2) / I"},
            )
            data["angle_of_polarisation_deg"] = (
                cube,
                self.angle_of_polarisation_deg,
                {"units": "degree", "long_name": "angle of the electric field from theta to phi"},
            )
        coordinates: dict[str, object] = {
            "wavelength": ("wavelength", self.wavelength_nm, wavelength)
        }
        if self._sensor is not None:
            azimuth_deg, elevation_deg = self.directions()
            zenith = {"units": "degree", "long_name": "zenith angle looked at"}
            azimuth = {"units": "degree", "long_name": "azimuth looked at, clockwise from north"}
            coordinates["vza_deg"] = (pixels, 90.0 - elevation_deg, zenith)
            coordinates["vaa_deg"] = (pixels, azimuth_deg, azimuth)
        for key, name, value in (
            ("sza_deg", "solar_zenith_angle", "sun_elevation_deg"),
            ("saa_deg", "solar_azimuth_angle", "sun_azimuth_deg"),
        ):
            if value in self.metadata:
                angle = float(self.metadata[value])
                angle = 90.0 - angle if key == "sza_deg" else angle
                coordinates[key] = ((), angle, {"units": "degree", "standard_name": name})
        attributes = {"Conventions": "CF-1.11", "source": f"celaje {_core.__version__}"}
        return xarray.Dataset(data, coordinates, {**attributes, **self.metadata})

    def _contiguous(self) -> list[tuple[Singles, Singles]] | None:
        if self.polarisation is None:
            return None
        return [
            (
                np.ascontiguousarray(mean, dtype=np.float32),
                np.ascontiguousarray(variance, dtype=np.float32),
            )
            for mean, variance in self.polarisation
        ]

    def _seen(self) -> tuple[Singles, NDArray[np.uint32], Floats]:
        return (
            np.ascontiguousarray(self.radiance, dtype=np.float32),
            np.ascontiguousarray(self.samples, dtype=np.uint32),
            np.ascontiguousarray(self.wavelength_nm, dtype=np.float64),
        )


@dataclass(frozen=True)
class Radiance:
    """Spectral radiance in single directions; made by :meth:`Sky.radiance`.

    Attributes
    ----------
    radiance : ndarray of float32, shape (direction, wavelength) or (direction, wavelength, 4)
        Mean spectral radiance, or the mean Stokes vector (I, Q, U, V). [W m⁻² sr⁻¹ nm⁻¹]
    standard_error : ndarray of float32, same shape
        Standard error of that mean, absolute; 0 for a deterministic method. [W m⁻² sr⁻¹ nm⁻¹]
    azimuth_deg, elevation_deg : ndarray of float64, shape (direction,)
        Where it was looked. [deg]
    wavelength_nm : ndarray of float64, shape (wavelength,)
        Vacuum wavelengths. [nm]
    spp : int
        Paths per direction; on average, where `noise` decided.
    seed : int
        With it the same values come out again.
    """

    radiance: Singles
    standard_error: Singles
    azimuth_deg: Floats
    elevation_deg: Floats
    wavelength_nm: Floats
    spp: int
    seed: int


@dataclass(frozen=True)
class Irradiance:
    """What falls on a plane at the observer; made by :meth:`Sky.irradiance`.

    Attributes
    ----------
    direct_normal : ndarray, shape (wavelength,)
        From the sun's disc on a plane that faces it. [W m⁻² nm⁻¹]
    direct : ndarray, shape (wavelength,)
        From the sun's disc on the plane. [W m⁻² nm⁻¹]
    diffuse : ndarray, shape (wavelength,)
        From all else on the plane: the sky without the disc and, if it is tilted, the ground. [W m⁻² nm⁻¹]
    global_ : ndarray, shape (wavelength,)
        Direct and diffuse together. [W m⁻² nm⁻¹]
    direct_normal_standard_error, direct_standard_error, diffuse_standard_error, global_standard_error : ndarray
        Standard errors of the four, absolute, same shape and unit; 0 for a deterministic method.
    lux : float
        Illuminance of the plane by direct and diffuse light within the range of the wavelengths, by the CIE 1931
        observer; NaN for a single wavelength and for wavelengths outside 360 to 830 nm, which say nothing of it. [lx]
    cct_k : float or None
        Correlated colour temperature of the same light; infinite where it is bluer than the hottest black body, None
        where it has none (darkness, or colours far from any black body's). [K]
    wavelength_nm : ndarray, shape (wavelength,)
        Vacuum wavelengths. [nm]
    """

    direct_normal: Floats
    direct: Floats
    diffuse: Floats
    global_: Floats
    direct_normal_standard_error: Floats
    direct_standard_error: Floats
    diffuse_standard_error: Floats
    global_standard_error: Floats
    lux: float
    cct_k: float | None
    wavelength_nm: Floats

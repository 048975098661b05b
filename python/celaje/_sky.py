"""A sky, and looking at it."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arguments import (
    MAX_SPP,
    read_count,
    read_directions,
    read_order,
    read_sensor,
    read_threads,
)
from ._arrays import Floats, as_float, per_wavelength, vector
from ._atmosphere import Atmosphere
from ._conditions import Conditions
from ._errors import InvalidInputError, ShapeMismatchError
from ._film import Film, Irradiance, Radiance
from ._medium import Medium, Phase

DEFAULT_SPP = 64
# The most that a pixel is given where noise or time decides.
MOST_PATHS = 2**22


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
        noise: float | None = None,
        spp: int | None = None,
        time_limit: float | None = None,
        max_order: int | None = None,
        seed: int = 0,
        threads: int | None = None,
        polarised: bool | None = None,
        check: bool = False,
        correct: bool = False,
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
            ``"shells"`` (default, without noise), ``"path"`` (default if `spp`, `noise` or `time_limit` is given),
            ``"tracker"`` or ``"classic"``.
        accuracy : str
            How finely ``"shells"`` cuts: ``"preview"``, ``"default"`` or ``"high"``.
        noise : float, optional
            Relative noise to reach, such as 0.01: in every block of 8×8 pixels, at every wavelength, the root mean
            square of the standard errors over the mean radiance.
        spp : int, optional
            Paths per pixel, 64 by default; noise falls with their square root. With `noise` or `time_limit`: at most.
        time_limit : float, optional
            Follow paths for this long; the batch under way is finished. [s]
        max_order : int, optional
            Count this many scatterings and reflections only.
        seed : int
            The same seed gives the same bits, on any number of threads.
        threads : int, optional
            1 to 1024; all cores by default.
        polarised : bool, optional
            True: :attr:`Film.stokes` holds I, Q, U and V of every pixel, by ``"shells"`` (whose V is 0) or ``"path"``
            (whose aim of noise is that of I). False: scalar light. None (default): the radiance of light that is
            polarised on its way, where the method knows how.
        check : bool
            Compare ``"shells"`` with ``"path"`` at 50 directions of the picture: ``check_mean``, ``check_rms`` and
            ``check_worst`` of :attr:`Film.metadata`.
        correct : bool
            Correct ``"shells"`` by what of that difference is smooth; ``corrected_by`` says whether anything was, and
            ``corrected_rms`` what is left. Takes some ten seconds.

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
        sensor = read_sensor(projection, size, fov, look)
        if method is None:
            by_shells = spp is None and noise is None and time_limit is None
            method = "shells" if by_shells else "path"
        open_ended = noise is not None or time_limit is not None
        default_spp = MOST_PATHS if open_ended else DEFAULT_SPP
        spp = read_count("spp", default_spp if spp is None else spp, MAX_SPP)
        seed = read_count("seed", seed, 2**64 - 1, least=0)
        orders, threads = read_order(max_order), read_threads(threads)
        entries: list[tuple[str, str]] = []
        if check or correct:
            if method != "shells":
                name = "correct" if correct else "check"
                raise InvalidInputError(
                    f"{name}=True is for the method shells, and {method} was asked for",
                    f"leave {name} out, or method, spp, noise and time_limit",
                )
            arrays, entries = self._raw.render_checked(
                sensor,
                accuracy,
                seed,
                orders,
                sun_disc,
                altitude_m,
                threads,
                polarised,
                correct,
            )
        else:
            arrays = self._raw.render(
                sensor,
                method,
                accuracy,
                spp,
                seed,
                orders,
                sun_disc,
                altitude_m,
                threads,
                noise,
                time_limit,
                polarised,
            )
        radiance, variance, samples, stokes = arrays
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
            metadata["spp"] = str(_mean_paths(samples) if open_ended else spp)
            metadata["seed"] = str(seed)
        if noise is not None:
            metadata["noise"] = f"{noise:g}"
        if time_limit is not None:
            metadata["time_limit"] = f"{time_limit:g} s"
        if method == "path":
            metadata["polarised"] = {True: "on", False: "off", None: "radiance"}[polarised]
        metadata["max_order"] = "all" if max_order is None else str(max_order)
        metadata["version"] = _core.__version__
        metadata.update(sensor.description())
        metadata.update(entries)
        return Film(radiance, variance, samples, self.wavelength_nm, metadata, sensor, stokes)

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
        polarised: bool | None = None,
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
            ``"path"`` (default), ``"shells"`` (no noise; the standard error is 0; the default of a sky with tables),
            ``"tracker"`` or ``"classic"``.
        noise : float, optional
            The largest relative standard error over directions and wavelengths to reach, such as 0.01; instead of
            `spp`.
        spp : int, optional
            Paths per direction, 64 by default.
        seed : int
            The same seed gives the same bits, on any number of threads.
        threads : int, optional
            1 to 1024; all cores by default.
        polarised : bool, optional
            True: Stokes vectors (I, Q, U, V), with the methods ``"path"`` and ``"shells"`` (V is 0; a sky with tables
            needs polarised ones); see ``docs/conventions.md`` for their basis. False: scalar light. None (default): the
            radiance of light that is polarised on its way, where the method knows how.
        max_order : int, optional
            Count this many scatterings and reflections only; 1 is single scattering.
        sun_disc : str
            ``"on"``, ``"off"`` or ``"only"``; a collimated sun is never seen.
        accuracy : str
            How finely ``"shells"`` cuts: ``"preview"``, ``"default"`` or ``"high"``.

        Returns
        -------
        Radiance
            ``.radiance`` and ``.standard_error``, shape (direction, wavelength); with ``polarised=True``
            (direction, wavelength, 4).

        Notes
        -----
        For `noise` each direction is followed by two halves of paths that share no random number; how long one goes on
        is decided by the noise of the other, so that no value has a say in how much it counts. What is aimed at is 0.8
        of the noise asked for.

        Examples
        --------
        >>> import celaje
        >>> sky = celaje.sky(sun_elevation=30, wavelengths="450,650")
        >>> L = sky.radiance([0.0, 90.0], 45.0, noise=0.05)
        >>> bool((L.standard_error <= 0.05 * L.radiance).all())
        True
        """
        azimuth, elevation = read_directions(azimuth_deg, elevation_deg)
        sensor = _core.Sensor.directions(azimuth, elevation)
        max_order, threads = read_order(max_order), read_threads(threads)
        by_paths = spp is not None or noise is not None
        if method is None and self.is_baked and not by_paths:
            method = "shells"

        seed = read_count("seed", seed, 2**64 - 1, least=0)
        default_spp = DEFAULT_SPP if noise is None else MOST_PATHS
        spp = read_count("spp", default_spp if spp is None else spp, MAX_SPP)
        values, variance, samples, others = self._raw.render(
            sensor,
            method,
            accuracy,
            spp,
            seed,
            max_order,
            sun_disc,
            altitude_m,
            threads,
            noise,
            None,
            polarised,
        )
        spp = spp if noise is None else _mean_paths(samples)
        if others is not None:
            values = np.stack([values, *(mean for mean, _ in others)], axis=-1)
            variance = np.stack([variance, *(v for _, v in others)], axis=-1)
        error = np.sqrt(variance[0])
        return Radiance(values[0], error, azimuth, elevation, self.wavelength_nm, spp, seed)

    def with_cloud(
        self,
        east_m: ArrayLike,
        north_m: ArrayLike,
        altitude_m: ArrayLike,
        density: ArrayLike,
        sigma_s: ArrayLike,
        sigma_a: ArrayLike,
        phase: Phase,
    ) -> Sky:
        """The same sky with a box of cells in it, such as a cloud; only ``"tracker"`` and ``"classic"`` take it.

        Parameters
        ----------
        east_m, north_m : array_like, shape (x + 1,) and (y + 1,)
            Edges of the cells on the plane that touches the sphere of altitude 0 under the observer, increasing. Cells
            stand upright: their sides are planes through the planet's centre. [m]
        altitude_m : array_like, shape (z + 1,)
            Edges above sea level, increasing. [m]
        density : array_like, shape (z, y, x)
            Factor on the coefficients, constant in each cell, >= 0. [1]
        sigma_s, sigma_a : float or array_like, shape (wavelength,)
            Scattering and absorption at density 1. [m⁻¹]
        phase : Phase
            How it scatters.

        Returns
        -------
        Sky

        Examples
        --------
        >>> import celaje
        >>> sky = celaje.sky(sun_elevation=40, wavelengths="450,650")
        >>> cloud = sky.with_cloud(
        ...     [-500.0, 500.0], [-500.0, 500.0], [1000.0, 1500.0], [[[1.0]]], 0.01, 0.0,
        ...     celaje.Phase.henyey_greenstein(0.85),
        ... )
        >>> zenith = dict(azimuth_deg=0.0, elevation_deg=90.0, method="tracker", spp=1024)
        >>> bool((cloud.radiance(**zenith).radiance > 2 * sky.radiance(**zenith).radiance).all())
        True
        """
        edges = (
            vector("east_m", east_m),
            vector("north_m", north_m),
            vector("altitude_m", altitude_m),
        )
        cells = as_float("density", density)
        expected = tuple(len(e) - 1 for e in reversed(edges))
        if cells.shape != expected:
            raise ShapeMismatchError(
                f"density has shape {cells.shape}, expected (altitude, north, east) = {expected}",
                "give one value per cell: one less than edges along each axis",
            )
        count = self.wavelength_nm.size
        scattering = per_wavelength("sigma_s", sigma_s, count)
        absorption = per_wavelength("sigma_a", sigma_a, count)
        raw = self._raw.with_cloud(edges, cells.ravel(), scattering, absorption, phase._raw)
        made = Sky(raw, self._conditions)
        made._origin = dict(self._origin)
        return made

    def bake(
        self,
        sun_elevation: tuple[float, float] = (-18.0, 90.0),
        highest_observer_m: float = 20_000.0,
        accuracy: str = "default",
        threads: int | None = None,
        polarised: bool = True,
    ) -> Sky:
        """Solve this air and ground for many suns at once: the same sky, with tables.

        Every later view by ``method="shells"`` comes from the tables, under any sun that :meth:`under` puts above it.

        Parameters
        ----------
        sun_elevation : (float, float)
            Lowest and highest true elevation of the sun. [deg]
        highest_observer_m : float
            The highest observer above sea level. [m]
        accuracy : str
            ``"preview"``, ``"default"`` or ``"high"``.
        threads : int, optional
            1 to 1024; all cores by default.
        polarised : bool
            Whether light is polarised on its way, which ``polarised=True`` of :meth:`radiance` needs; scalar light
            takes half the time.

        Returns
        -------
        Sky
            To be kept by :meth:`save_tables`.

        Examples
        --------
        >>> import celaje
        >>> sky = celaje.sky(sun_elevation=5, wavelengths="450,550,650").bake((-2, 6), accuracy="preview")
        >>> dusk = sky.under(sun_elevation=-1.5)
        >>> dusk.radiance([0.0, 180.0], 45.0, method="shells").radiance.shape
        (2, 3)
        """
        lowest, highest = sun_elevation
        raw = self._raw.bake(
            (float(lowest), float(highest)),
            float(highest_observer_m),
            accuracy,
            read_threads(threads),
            polarised,
        )
        return self._with(raw, self._conditions)

    @property
    def is_baked(self) -> bool:
        """Whether it carries tables, made by :meth:`bake` or read by :func:`celaje.tables`."""
        return self._raw.is_baked

    def under(
        self,
        sun_elevation: float,
        sun_azimuth: float = 180.0,
        sun_distance_au: float | None = None,
    ) -> Sky:
        """The same air and ground under another sun; tables, if there are any, stay.

        Parameters
        ----------
        sun_elevation, sun_azimuth : float
            True direction of the sun, azimuth clockwise from north. [deg]
        sun_distance_au : float, optional
            0.9 to 1.1; unchanged by default. Irradiance and size of the disc follow it. [au]

        Returns
        -------
        Sky
            Its conditions are those of before apart from the sun's, and belong to no instant.
        """
        distance_au = self._raw.sun_distance_au if sun_distance_au is None else sun_distance_au
        raw = self._raw.under(float(sun_azimuth), float(sun_elevation), float(distance_au))
        conditions = raw.conditions()
        return self._with(raw, None if conditions is None else Conditions._of(conditions))

    def radiance_under(
        self,
        sun_elevation: ArrayLike,
        sun_azimuth: ArrayLike,
        azimuth_deg: ArrayLike,
        elevation_deg: ArrayLike,
        altitude_m: float | None = None,
        threads: int | None = None,
    ) -> NDArray[np.float32]:
        """Spectral radiance in many directions under many suns, from the tables; without the sun's disc.

        Parameters
        ----------
        sun_elevation, sun_azimuth : float or array_like, shape (s,)
            True directions of the sun. A number goes with every value of the other. [deg]
        azimuth_deg, elevation_deg : float or array_like, shape (n,)
            Where to look, likewise. [deg]
        altitude_m : float, optional
            Observer above sea level; on the ground by default. [m]
        threads : int, optional
            1 to 1024; all cores by default.

        Returns
        -------
        ndarray of float32, shape (sun, direction, wavelength)
            [W m⁻² sr⁻¹ nm⁻¹].

        Raises
        ------
        InvalidInputError
            The sky has no tables: :meth:`bake` it.
        OutOfRangeError
            A sun or an altitude that the tables are not for.
        """
        suns = read_directions(sun_azimuth, sun_elevation)
        looks = read_directions(azimuth_deg, elevation_deg)
        return self._raw.radiance_under(*suns, *looks, altitude_m, read_threads(threads))

    def save_tables(self, path: str | os.PathLike[str]) -> None:
        """Write the tables to a file, whole or not at all; :func:`celaje.tables` reads it.

        Parameters
        ----------
        path : str or path
            Such as ``"air.celaje"``; an older file is overwritten.

        Raises
        ------
        InvalidInputError
            The sky has no tables: :meth:`bake` it.
        FileError
            Missing folder, no permission, full disk.
        """
        metadata = dict(self._origin)
        if self._conditions is not None:
            metadata.update(self._conditions.metadata())
        metadata["version"] = _core.__version__
        self._raw.save_tables(os.fspath(path), list(metadata.items()))

    def _with(self, raw: _core.Sky, conditions: Conditions | None) -> Sky:
        made = Sky(raw, conditions)
        made._origin = dict(self._origin)
        return made

    def irradiance(
        self,
        altitude_m: float | None = None,
        method: str | None = None,
        spp: int | None = None,
        seed: int = 0,
        threads: int | None = None,
        max_order: int | None = None,
        accuracy: str = "default",
        tilt_deg: float = 0.0,
        azimuth_deg: float = 180.0,
    ) -> Irradiance:
        """Spectral irradiance on a plane at the observer, direct and diffuse.

        Parameters
        ----------
        altitude_m : float, optional
            Observer above sea level; on the ground by default. [m]
        method : str, optional
            ``"path"`` (default), ``"shells"`` (no noise; the default of a sky with tables), ``"tracker"`` or
            ``"classic"``.
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
        tilt_deg : float
            Of the plane, from level (0) over upright (90) to facing down (180). [deg]
        azimuth_deg : float
            Where a tilted plane faces, clockwise from north. [deg]

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
        if method is None and spp is None and self.is_baked:
            method = "shells"
        fields = self._raw.irradiance(
            (float(tilt_deg), float(azimuth_deg)),
            method,
            accuracy,
            read_count("spp", DEFAULT_SPP if spp is None else spp, MAX_SPP),
            read_count("seed", seed, 2**64 - 1, least=0),
            read_order(max_order),
            altitude_m,
            read_threads(threads),
        )
        return Irradiance(**fields)

    def __repr__(self) -> str:
        azimuth, elevation = self._raw.sun_position
        w = self.wavelength_nm
        return (
            f"<Sky, sun at azimuth {azimuth:.1f}, elevation {elevation:.1f} deg, "
            f"{w.size} wavelengths {w[0]:g} to {w[-1]:g} nm>"
        )


def _mean_paths(samples: NDArray[np.uint32]) -> int:
    """Paths per pixel that sees something, on average."""
    lit = samples[samples > 0]
    return round(float(lit.mean())) if lit.size else 0

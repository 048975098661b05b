from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str
default_method: str

_F64 = NDArray[np.float64]
_F32 = NDArray[np.float32]
_U32 = NDArray[np.uint32]
_C128 = NDArray[np.complex128]
# Means and variances of Q, U, V; then the parts of a film.
_Stokes = list[tuple[_F32, _F32]] | None
_Parts = tuple[_F32, _F32, _U32, _F64, list[tuple[str, str]], _Stokes]

class Conditions:
    def __new__(
        cls,
        at: str | tuple[float, float] | None,
        time: str | None,
        local: bool,
        words: Mapping[str, object],
    ) -> Conditions: ...
    def rows(
        self,
    ) -> list[tuple[str, str, float | str | None, bool, str, float | None, str, str]]: ...

def climate_table(
    at: list[str | tuple[float, float]],
    times: list[str] | list[float],
    local: bool,
    words: Mapping[str, object],
) -> dict[str, Any]: ...

class Sensor:
    @staticmethod
    def fisheye(width: int, height: int, fov_deg: float) -> Sensor: ...
    @staticmethod
    def latlong(width: int, height: int) -> Sensor: ...
    @staticmethod
    def perspective(
        width: int, height: int, fov_deg: float, azimuth_deg: float, elevation_deg: float
    ) -> Sensor: ...
    @staticmethod
    def directions(azimuth_deg: _F64, elevation_deg: _F64) -> Sensor: ...
    def description(self) -> list[tuple[str, str]]: ...
    def pixel_centres(self) -> tuple[_F64, _F64]: ...

class Phase:
    @staticmethod
    def rayleigh(depolarisation: _F64) -> Phase: ...
    @staticmethod
    def henyey_greenstein(g: _F64) -> Phase: ...
    @staticmethod
    def table(theta_deg: _F64, p: _F64) -> Phase: ...
    @staticmethod
    def spheres(theta_deg: _F64, p: _F64, p12: _F64, p33: _F64, p34: _F64) -> Phase: ...
    @staticmethod
    def legendre(c: _F64) -> Phase: ...
    def values(self, theta_deg: _F64) -> _F64: ...

class Medium:
    def __new__(cls, altitude_m: _F64, wavelength_nm: _F64, planet_radius_m: float) -> Medium: ...
    def add(self, sigma_s: _F64, sigma_a: _F64, phase: Phase) -> None: ...
    @property
    def altitude_m(self) -> _F64: ...
    @property
    def wavelength_nm(self) -> _F64: ...
    @property
    def planet_radius_m(self) -> float: ...
    def sigma_t(self) -> _F64: ...
    def sigma_s(self) -> _F64: ...
    def species(self) -> list[tuple[_F64, Phase]]: ...
    def vertical_optical_depth(self) -> _F64: ...

class Sky:
    @staticmethod
    def from_conditions(
        conditions: Conditions,
        wavelength_nm: _F64 | None,
        sun: str,
        own_aerosol: OwnAerosol | None,
    ) -> Sky: ...
    def conditions(self) -> Conditions | None: ...
    @staticmethod
    def from_medium(
        medium: Medium,
        sun_elevation_deg: float,
        sun_azimuth_deg: float,
        albedo: _F64,
        irradiance: _F64,
        sun_angular_radius_deg: float,
    ) -> Sky: ...
    def medium(self) -> Medium: ...
    @property
    def wavelength_nm(self) -> _F64: ...
    @property
    def albedo(self) -> _F64: ...
    @property
    def sun_irradiance(self) -> _F64: ...
    @property
    def ground_altitude_m(self) -> float: ...
    @property
    def sun_position(self) -> tuple[float, float]: ...
    def inventory(self) -> Inventory | None: ...
    def render(
        self,
        sensor: Sensor,
        method: str | None,
        accuracy: str,
        spp: int,
        seed: int,
        max_order: int | None,
        sun_disc: str,
        altitude_m: float | None,
        threads: int | None,
        noise: float | None,
        time_limit_s: float | None,
        polarised: bool | None = None,
    ) -> tuple[_F32, _F32, _U32, _Stokes]: ...
    def render_checked(
        self,
        sensor: Sensor,
        accuracy: str,
        seed: int,
        max_order: int | None,
        sun_disc: str,
        altitude_m: float | None,
        threads: int | None,
        polarised: bool | None,
        correct: bool,
    ) -> tuple[tuple[_F32, _F32, _U32, _Stokes], list[tuple[str, str]]]: ...
    def with_cloud(
        self,
        edges_m: tuple[_F64, _F64, _F64],
        density: _F64,
        sigma_s: _F64,
        sigma_a: _F64,
        phase: Phase,
    ) -> Sky: ...
    def bake(
        self,
        sun_elevation_deg: tuple[float, float],
        highest_observer_m: float,
        accuracy: str,
        threads: int | None,
        polarised: bool = True,
    ) -> Sky: ...
    def under(self, azimuth_deg: float, elevation_deg: float, distance_au: float) -> Sky: ...
    @property
    def sun_distance_au(self) -> float: ...
    @property
    def is_baked(self) -> bool: ...
    def radiance_under(
        self,
        sun_azimuth_deg: _F64,
        sun_elevation_deg: _F64,
        azimuth_deg: _F64,
        elevation_deg: _F64,
        altitude_m: float | None,
        threads: int | None,
    ) -> _F32: ...
    def save_tables(self, path: str, origin: list[tuple[str, str]]) -> None: ...
    @staticmethod
    def load_tables(path: str) -> tuple[Sky, list[tuple[str, str]]]: ...
    def irradiance(
        self,
        tilt: tuple[float, float],
        method: str | None,
        accuracy: str,
        spp: int,
        seed: int,
        max_order: int | None,
        altitude_m: float | None,
        threads: int | None,
    ) -> dict[str, Any]: ...

class Inventory:
    @property
    def altitude_m(self) -> _F64: ...
    @property
    def temperature_k(self) -> _F64: ...
    @property
    def pressure_pa(self) -> _F64: ...
    @property
    def wavelength_nm(self) -> _F64: ...
    @property
    def theta_deg(self) -> _F64: ...
    @property
    def extrapolated(self) -> bool: ...
    def species(self) -> list[dict[str, Any]]: ...
    def aerosol(self) -> dict[str, Any]: ...
    def save(self, path: str, metadata: list[tuple[str, str]]) -> None: ...
    def svg(self, metadata: list[tuple[str, str]]) -> str: ...

class OwnAerosol:
    def __new__(
        cls,
        name: str,
        index: tuple[list[float], list[float], list[float]],
        modes: list[tuple[float, float, float]],
        bounds_um: tuple[float, float],
        profile: tuple[list[float], list[float]] | None,
        scale_height_m: float,
    ) -> OwnAerosol: ...

class MieSphere:
    @property
    def q_ext(self) -> float: ...
    @property
    def q_sca(self) -> float: ...
    @property
    def asymmetry(self) -> float: ...
    def amplitudes(self, theta_deg: _F64) -> tuple[_C128, _C128]: ...

def wavelength_range(start_nm: float, stop_nm: float, step_nm: float) -> _F64: ...
def develop(
    radiance: _F32,
    samples: _U32,
    wavelength_nm: _F64,
    observer: str,
    tone: str,
    exposure: float | None,
) -> _F32: ...
def linear_srgb(radiance: _F32, samples: _U32, wavelength_nm: _F64, observer: str) -> _F32: ...
def save(
    path: str,
    radiance: _F32,
    variance: _F32,
    samples: _U32,
    wavelength_nm: _F64,
    observer: str,
    tone: str,
    exposure: float | None,
    view: Sensor | None,
    metadata: list[tuple[str, str]],
    stokes: _Stokes,
) -> None: ...
def read_exr(path: str) -> _Parts: ...
def merged(films: list[_Parts]) -> _Parts: ...
def mie(n: float, k: float, size_parameter: float) -> MieSphere: ...
def rayleigh_cross_section(wavelength_nm: _F64) -> _F64: ...
def aerosol(
    name: str, humidity_percent: float, wavelength_nm: _F64
) -> tuple[_F64, _F64, _F64, _F64, _F64]: ...
def own_aerosol(own: OwnAerosol, wavelength_nm: _F64) -> tuple[_F64, _F64, _F64, _F64, _F64]: ...
def component(
    name: str, humidity_percent: float, wavelength_nm: _F64
) -> tuple[_F64, _F64, _F64, _F64, _F64]: ...

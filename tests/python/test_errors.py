"""Bad input: every message names the argument, its value, unit and range, and says what to do."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import celaje

from .conftest import PLACE, TIME

NAN = float("nan")


@pytest.mark.parametrize(
    ("words", "kind", "message"),
    [
        ({"at": (91, 0), "time": TIME}, celaje.OutOfRangeError, "latitude = 91 deg"),
        ({"at": (NAN, 0), "time": TIME}, celaje.OutOfRangeError, "latitude = NaN deg"),
        ({"at": (0, 361), "time": TIME}, celaje.OutOfRangeError, "longitude = 361 deg"),
        ({"at": PLACE, "time": "2026-06-21T18:30"}, celaje.InvalidInputError, "time zone"),
        ({"at": PLACE, "time": "-0001-06-21T18:30Z"}, celaje.OutOfRangeError, "year = -1"),
        ({"at": PLACE, "time": "3000-06-21T18:30Z"}, celaje.OutOfRangeError, "year = 3000"),
        ({"at": PLACE, "time": 2026}, celaje.InvalidInputError, "the time 2026"),
        ({"at": "nowhere", "time": TIME}, celaje.InvalidInputError, "no city 'nowhere'"),
        ({"at": PLACE}, celaje.InvalidInputError, "no time"),
        ({"time": TIME}, celaje.InvalidInputError, "no place"),
        ({}, celaje.InvalidInputError, "neither place nor sun"),
        ({"sun_elevation": 91}, celaje.OutOfRangeError, "sun elevation = 91 deg"),
        ({"sun_elevation": 5, "sun_azimuth": NAN}, celaje.OutOfRangeError, "sun azimuth = NaN"),
        ({"sun_elevation": 5, "aod_550": -1}, celaje.OutOfRangeError, "aod = -1"),
        ({"sun_elevation": 5, "aod_550": 1, "aod": 1}, celaje.InvalidInputError, "twice"),
        ({"sun_elevation": 5, "albedo": 1.2}, celaje.OutOfRangeError, "albedo = 1.2"),
        ({"sun_elevation": 5, "albedo": NAN}, celaje.OutOfRangeError, "albedo = NaN"),
        ({"sun_elevation": 5, "ozone": -1}, celaje.OutOfRangeError, "ozone = -1 DU"),
        ({"sun_elevation": 5, "humidity": 101}, celaje.OutOfRangeError, "humidity = 101 %"),
        ({"sun_elevation": 5, "altitude": 1e5}, celaje.OutOfRangeError, "altitude = 100000 m"),
        ({"sun_elevation": 5, "aerosol": "dessert"}, celaje.UnknownNameError, "'desert'"),
        ({"sun_elevation": 5, "albedo": "sanb"}, celaje.UnknownNameError, "'sand'"),
        ({"sun_elevation": 5, "atmosphere": "us67"}, celaje.UnknownNameError, "'us76'"),
        ({"sun_elevation": 5, "sun_spectrum": "tsis"}, celaje.UnknownNameError, "tsis1"),
        ({"sun_elevation": 5, "wavelengths": [500, 400]}, celaje.InvalidInputError, "increase"),
        ({"sun_elevation": 5, "wavelengths": [100.0]}, celaje.OutOfRangeError, "100 nm"),
        ({"sun_elevation": 5, "wavelengths": [NAN]}, celaje.OutOfRangeError, "NaN nm"),
        ({"sun_elevation": 5, "wavelengths": []}, celaje.InvalidInputError, "no wavelength"),
        ({"sun_elevation": 5, "wavelengths": "red"}, celaje.InvalidInputError, "'red'"),
        ({"sun_elevation": 5, "wavelengths": "700:400:5"}, celaje.InvalidInputError, "backwards"),
    ],
)
def test_bad_skies(words: dict[str, object], kind: type[celaje.CelajeError], message: str) -> None:
    with pytest.raises(kind) as caught:
        celaje.sky(**words)  # type: ignore[arg-type]
    error = caught.value
    assert isinstance(error, ValueError)
    assert message in str(error)
    assert error.hint
    assert str(error).endswith(f"hint: {error.hint}")


@pytest.mark.parametrize(
    ("words", "kind", "message"),
    [
        ({"size": 0}, celaje.InvalidInputError, "0x0"),
        ({"size": "0x7"}, celaje.InvalidInputError, "0x7"),
        ({"size": -3}, celaje.InvalidInputError, "-3x-3"),
        ({"size": "big"}, celaje.InvalidInputError, "'big'"),
        ({"size": 3.5}, celaje.InvalidInputError, "3.5"),
        ({"size": (3, 4, 5)}, celaje.InvalidInputError, "(3, 4, 5)"),
        ({"size": "1000000x1000"}, celaje.TooLargeError, "GiB"),
        ({"size": 10**9}, celaje.TooLargeError, "GiB"),
        ({"projection": "fish"}, celaje.UnknownNameError, "fisheye"),
        ({"projection": "latlong", "size": (8, 8)}, celaje.InvalidInputError, "8x8"),
        ({"projection": "latlong", "fov": 90}, celaje.InvalidInputError, "fov"),
        ({"look": (0, 0)}, celaje.InvalidInputError, "look"),
        ({"fov": NAN}, celaje.OutOfRangeError, "fov = NaN deg"),
        ({"spp": 0}, celaje.OutOfRangeError, "spp = 0"),
        ({"spp": 2**40}, celaje.OutOfRangeError, "spp = 1099511627776"),
        ({"spp": 1.5}, celaje.InvalidInputError, "1.5"),
        ({"seed": -1}, celaje.OutOfRangeError, "seed = -1"),
        ({"threads": 0}, celaje.OutOfRangeError, "threads = 0"),
        ({"max_order": -1}, celaje.OutOfRangeError, "max_order = -1"),
        ({"method": "magic"}, celaje.UnknownNameError, "path"),
        ({"sun_disc": "maybe"}, celaje.UnknownNameError, "only"),
        ({"altitude_m": -5.0}, celaje.OutOfRangeError, "observer altitude = -5 m"),
        ({"altitude_m": NAN}, celaje.OutOfRangeError, "observer altitude = NaN m"),
    ],
)
def test_bad_renders(
    evening: celaje.Sky, words: dict[str, object], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind) as caught:
        evening.render(**{"spp": 1, "size": 2, **words})  # type: ignore[arg-type]
    assert message in str(caught.value)
    assert "hint: " in str(caught.value)


def test_bad_directions(evening: celaje.Sky) -> None:
    look = evening.radiance
    with pytest.raises(celaje.InvalidInputError, match="tracker does not know"):
        look(0, 90, polarised=True, method="tracker")
    cases: list[tuple[type[Exception], Callable[[], object]]] = [
        (celaje.OutOfRangeError, lambda: look(0, 91)),
        (celaje.OutOfRangeError, lambda: look([0, NAN], 45)),
        (celaje.ShapeMismatchError, lambda: look([0, 1, 2], [3, 4])),
        (celaje.ShapeMismatchError, lambda: look([[0, 1]], 3)),
        (celaje.InvalidInputError, lambda: look("north", 3)),
        (celaje.InvalidInputError, lambda: look([], [])),
        (celaje.OutOfRangeError, lambda: look(0, 90, noise=0.0)),
        (celaje.OutOfRangeError, lambda: look(0, 90, noise=NAN)),
        (celaje.OutOfRangeError, lambda: look(0, 90, noise=1e-9)),
    ]
    for kind, act in cases:
        with pytest.raises(kind):
            act()


def test_bad_media() -> None:
    medium = celaje.Medium([0.0, 1e5], [450.0, 550.0, 650.0])
    phase = celaje.Phase.rayleigh()
    cases: list[tuple[type[Exception], Callable[[], object]]] = [
        (celaje.InvalidInputError, lambda: celaje.Medium([0.0], [550.0])),
        (celaje.InvalidInputError, lambda: celaje.Medium([0.0, 0.0], [550.0])),
        (celaje.CelajeError, lambda: celaje.Medium([0.0, NAN], [550.0])),
        (celaje.OutOfRangeError, lambda: celaje.Medium([0.0, 1.0], [550.0], -1.0)),
        (celaje.ShapeMismatchError, lambda: medium.add(np.ones(3), 0.0, phase)),
        (celaje.ShapeMismatchError, lambda: medium.add(np.ones((3, 2)), 0.0, phase)),
        (celaje.OutOfRangeError, lambda: medium.add(-1e-6, 0.0, phase)),
        (celaje.OutOfRangeError, lambda: medium.add(0.0, NAN, phase)),
        (celaje.InvalidInputError, lambda: medium.add(1j, 0.0, phase)),
        (celaje.OutOfRangeError, lambda: celaje.Phase.henyey_greenstein(1.0)),
        (celaje.OutOfRangeError, lambda: celaje.Phase.rayleigh(NAN)),
        (celaje.InvalidInputError, lambda: celaje.Phase.table([0, 90], [0.08, 0.08])),
        (celaje.InvalidInputError, lambda: celaje.Phase.table([0, 90, 180], [1.0, 1.0, 1.0])),
        (celaje.ShapeMismatchError, lambda: celaje.Phase.table([0, 90, 180], [0.08, 0.08])),
        (celaje.InvalidInputError, lambda: celaje.Phase.legendre([2.0])),
        (celaje.InvalidInputError, lambda: celaje.Phase.legendre([])),
        (celaje.CelajeError, lambda: celaje.Phase.henyey_greenstein([])),
        (celaje.OutOfRangeError, lambda: medium.sky(95)),
        (celaje.OutOfRangeError, lambda: medium.sky(30, albedo=1.2)),
        (celaje.OutOfRangeError, lambda: medium.sky(30, irradiance=-1.0)),
        (celaje.ShapeMismatchError, lambda: medium.sky(30, albedo=[0.1, 0.2])),
    ]
    for kind, act in cases:
        with pytest.raises(kind):
            act()
    assert (medium.sigma_t == 0).all()


def test_bad_optics() -> None:
    cases: list[tuple[type[Exception], Callable[[], object]]] = [
        (celaje.OutOfRangeError, lambda: celaje.mie(1.5 - 0.1j, 1.0)),
        (celaje.OutOfRangeError, lambda: celaje.mie(1.5, -1.0)),
        (celaje.OutOfRangeError, lambda: celaje.mie(1.5, NAN)),
        (celaje.OutOfRangeError, lambda: celaje.mie(1.5, 1.0).s1(181.0)),
        (celaje.OutOfRangeError, lambda: celaje.rayleigh_cross_section(100.0)),
        (celaje.OutOfRangeError, lambda: celaje.aerosol("desert", humidity=100)),
        (celaje.UnknownNameError, lambda: celaje.aerosol("opac:desart")),
        (celaje.UnknownNameError, lambda: celaje.component("wasp")),
        (celaje.OutOfRangeError, lambda: celaje.component("waso").ssa(100.0)),
        (celaje.OutOfRangeError, lambda: celaje.component("waso").ssa([550.0, NAN])),
        (celaje.InvalidInputError, lambda: celaje.component("waso").phase(550.0, 181.0)),
    ]
    for kind, act in cases:
        with pytest.raises(kind):
            act()


@pytest.mark.parametrize("name", ["sky.jpg", "sky", "missing/sky.png"])
def test_bad_files(evening: celaje.Sky, tmp_path: Path, name: str) -> None:
    film = evening.render(size=2, spp=1)
    with pytest.raises(celaje.FileError, match="hint: ") as caught:
        film.save(tmp_path / name)
    assert isinstance(caught.value, OSError)
    assert list(tmp_path.iterdir()) == []


def test_bad_colours(evening: celaje.Sky) -> None:
    film = evening.render(size=2, spp=1)
    with pytest.raises(celaje.UnknownNameError, match="filmic"):
        film.rgb(tone="film")
    with pytest.raises(celaje.UnknownNameError, match="1931"):
        film.rgb(observer=2015)
    with pytest.raises(celaje.OutOfRangeError):
        film.rgb(exposure=NAN)
    film.samples = film.samples[:1]
    with pytest.raises(celaje.ShapeMismatchError):
        film.rgb()


def test_an_error_tells_its_parts_and_travels() -> None:
    with pytest.raises(celaje.OutOfRangeError) as caught:
        celaje.climate(at=(91, 0), time=TIME)
    error = caught.value
    assert (error.name, error.value, error.unit, error.range) == (
        "latitude",
        91.0,
        "deg",
        "[-90, 90]",
    )
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.value, type(again)) == (str(error), 91.0, type(error))
    with pytest.raises(celaje.UnknownNameError) as unknown:
        celaje.aerosol("dessert")
    assert "desert" in unknown.value.known
    assert str(pickle.loads(pickle.dumps(unknown.value))) == str(unknown.value)

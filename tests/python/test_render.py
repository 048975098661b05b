"""Looking at a sky: pictures, directions, files."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray

import celaje


def test_film_has_the_shapes_of_the_contract(evening: celaje.Sky) -> None:
    film = evening.render("fisheye", size=12, spp=4, seed=3)
    assert film.radiance.shape == film.variance.shape == (12, 12, 3)
    assert film.samples.shape == (12, 12)
    assert film.radiance.dtype == np.float32
    assert film.wavelength_nm.tolist() == [450.0, 550.0, 650.0]
    # The array is the renderer's memory, not a copy.
    assert not film.radiance.flags.owndata
    assert film.radiance.flags.writeable
    assert film.samples[6, 6] == 4
    assert film.samples[0, 0] == 0
    assert (film.radiance[0, 0] == 0).all()
    assert film.standard_error**2 == pytest.approx(film.variance, rel=1e-5)


def test_same_seed_same_bits_on_any_number_of_threads(evening: celaje.Sky) -> None:
    one = evening.render(size=8, spp=4, seed=7, threads=1)
    three = evening.render(size=8, spp=4, seed=7, threads=3)
    other = evening.render(size=8, spp=4, seed=8)
    assert np.array_equal(one.radiance, three.radiance)
    assert np.array_equal(one.variance, three.variance)
    assert not np.array_equal(one.radiance, other.radiance)


def test_projections_and_sizes(evening: celaje.Sky) -> None:
    def shape(*args: object, **more: object) -> tuple[int, ...]:
        return evening.render(*args, spp=1, **more).radiance.shape[:2]  # type: ignore[arg-type]

    assert shape("fisheye", 6) == (6, 6)
    assert shape("fisheye", (8, 4)) == (4, 8)
    assert shape("latlong", 4) == (4, 8)
    assert shape("latlong", "8x4") == (4, 8)
    assert shape("perspective", "6x3", fov=40, look=(290, 10)) == (3, 6)


def test_directions_of_pixels(evening: celaje.Sky) -> None:
    """Fisheye: north up, east left. Lat-long: zenith on row 0, north at the left edge."""
    azimuth, elevation = evening.render("fisheye", size=5, spp=1).directions()
    assert elevation[2, 2] == pytest.approx(90)
    assert azimuth[0, 2] == pytest.approx(0)
    assert azimuth[2, 0] == pytest.approx(90)
    assert elevation[0, 2] == pytest.approx(18)
    assert np.isnan(azimuth[0, 0])
    azimuth, elevation = evening.render("latlong", size=2, spp=1).directions()
    assert azimuth[0].tolist() == pytest.approx([45, 135, 225, 315])
    assert elevation[:, 0].tolist() == pytest.approx([45, -45])


def test_a_sky_is_blue_above_and_bright_around_the_sun() -> None:
    """Expected: at noon the zenith is bluer than the horizon; near the sun it is brighter than away from it."""
    sky = celaje.sky(sun_elevation=50, sun_azimuth=180, wavelengths=[450.0, 550.0, 650.0])
    zenith, horizon, near_sun, away = sky.radiance(
        [0, 0, 180, 0], [90, 5, 45, 45], spp=2000, sun_disc="off"
    ).radiance
    assert zenith[0] > zenith[1] > zenith[2]
    assert zenith[0] / zenith[2] > 1.1 * horizon[0] / horizon[2]
    assert (near_sun > 2 * away).all()


def test_single_scattering_in_a_slab(slab: celaje.Sky) -> None:
    """Rationale: an exact formula for the whole way from arrays to radiance.

    Expected: a flat isotropic slab of optical depth τ under a collimated sun gives, to first order of scattering,
    L = E/(4π) · μ0/(μ0 − μ) · (exp(−τ/μ0) − exp(−τ/μ)), within five standard errors of below 0.5 %.
    """
    elevation = np.array([90.0, 45.0, 20.0, 10.0])
    seen = slab.radiance(0.0, elevation, spp=200_000, max_order=1)
    mu, mu0 = np.sin(np.radians(elevation)), np.sin(np.radians(60.0))
    depth = 0.3
    exact = mu0 / (mu0 - mu) * (np.exp(-depth / mu0) - np.exp(-depth / mu)) / (4 * np.pi)
    error = seen.standard_error[:, 0]
    assert (error < 5e-3 * exact).all()
    assert (np.abs(seen.radiance[:, 0] - exact) < 5 * error + 1e-5 * exact).all()


def test_radiance_takes_numbers_and_lists(evening: celaje.Sky) -> None:
    one = evening.radiance(90.0, 30.0, spp=8)
    assert one.radiance.shape == one.standard_error.shape == (1, 3)
    assert one.azimuth_deg.tolist() == [90.0]
    many = evening.radiance([0, 90, 180], 30.0, spp=8)
    assert many.radiance.shape == (3, 3)
    assert many.elevation_deg.tolist() == [30.0] * 3
    assert (many.standard_error > 0).all()
    again = evening.radiance([0, 90, 180], 30.0, spp=8, threads=1)
    assert np.array_equal(many.radiance, again.radiance)


@pytest.mark.parametrize("method", ["path", "tracker", "classic"])
def test_every_method_sees_the_same_sky(slab: celaje.Sky, method: str) -> None:
    reference = slab.radiance(0.0, 30.0, spp=40_000, seed=1)
    seen = slab.radiance(0.0, 30.0, spp=40_000, seed=2, method=method)
    spread = np.hypot(reference.standard_error, seen.standard_error)
    assert (np.abs(seen.radiance - reference.radiance) < 5 * spread).all()


def test_noise_is_reached(evening: celaje.Sky) -> None:
    seen = evening.radiance([0.0, 180.0], [60.0, 20.0], noise=0.02, sun_disc="off")
    # It aims a fifth lower; what it then measures is itself known to some per cent.
    assert float((seen.standard_error / seen.radiance).max()) <= 0.022
    again = evening.radiance([0.0, 180.0], [60.0, 20.0], noise=0.02, sun_disc="off")
    assert np.array_equal(seen.radiance, again.radiance)


def test_a_higher_observer_sees_a_darker_zenith(evening: celaje.Sky) -> None:
    ground = evening.radiance(0.0, 90.0, spp=2000)
    high = evening.radiance(0.0, 90.0, altitude_m=20e3, spp=2000)
    assert (high.radiance < 0.3 * ground.radiance).all()


def test_sun_disc(evening: celaje.Sky) -> None:
    """The disc alone, through the air: E exp(−τ) over its solid angle; nothing beside it."""
    c = evening.conditions
    assert c is not None
    azimuth, elevation = c.sun_azimuth_deg.value, c.sun_elevation_deg.value
    look = [azimuth, azimuth + 1.0], [elevation, elevation]
    only = evening.radiance(*look, spp=4, sun_disc="only").radiance
    assert (only[0] > 1e3).all()
    assert (only[1] == 0).all()
    off = evening.radiance(*look, spp=4, sun_disc="off").radiance
    assert (off[0] < 1e-3 * only[0]).all()


def test_files(evening: celaje.Sky, tmp_path: Path) -> None:
    film = evening.render(size=8, spp=2)
    for name, magic in [("a.png", b"\x89PNG"), ("b.exr", b"\x76\x2f\x31\x01"), ("c.hdr", b"#?")]:
        film.save(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(magic)
    text = (tmp_path / "b.exr").read_bytes()
    assert b"S0.550,000000nm" in text
    assert b"celaje.ozone_du.reason" in text
    film.save(str(tmp_path / "d.png"), tone="srgb", exposure=-1.5, observer=1931)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "b.exr", "c.hdr", "d.png"]


def test_colours_follow_the_arrays(evening: celaje.Sky) -> None:
    film = evening.render(size=8, spp=4)
    rgb = film.rgb()
    assert rgb.shape == (8, 8, 3)
    assert 0 <= rgb.min() <= rgb.max() <= 1
    absolute = film.linear_srgb()
    film.radiance *= 2
    np.testing.assert_allclose(film.linear_srgb(), 2 * absolute, rtol=1e-5)
    brighter = film.rgb(tone="none", exposure=1) - film.rgb(tone="none", exposure=0)
    assert (brighter >= 0).all()
    assert brighter.max() > 0


def test_xarray_carries_units_and_reasons(evening: celaje.Sky) -> None:
    film = evening.render("latlong", size=4, spp=2, seed=5)
    data = film.xarray()
    assert data.radiance.dims == ("y", "x", "wavelength")
    assert data.radiance.attrs["units"] == "W m-2 sr-1 nm-1"
    assert data.wavelength.attrs["standard_name"] == "radiation_wavelength"
    assert data.attrs["seed"] == "5"
    assert "satellite" in data.attrs["ozone_du.reason"]
    assert np.shares_memory(data.radiance.values, film.radiance)
    assert float(data.sza_deg) == pytest.approx(79.0, abs=0.01)
    assert float(data.vza_deg[0, 0]) == pytest.approx(22.5)
    blue = data.radiance.sel(wavelength=450.0)
    assert isinstance(blue, xarray.DataArray)


@pytest.mark.skipif(sys.platform == "win32", reason="signals differ there")
def test_ctrl_c_interrupts_a_render_within_a_fifth_of_a_second() -> None:
    """Rationale: hours of work must be stoppable. Expected: KeyboardInterrupt, no crash, at once."""
    program = (
        "import celaje, signal, sys\n"
        # A shell's background jobs ignore Ctrl-C, and so do their children.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "sky = celaje.sky(sun_elevation=10, wavelengths='400:700:10')\n"
        "print('go', flush=True)\n"
        "try:\n"
        "    sky.render(size=512, spp=10**6)\n"
        "except KeyboardInterrupt:\n"
        "    print('stopped', flush=True)\n"
        "    sky.render(size=2, spp=1)\n"
        "    print('alive', flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "go\n"
        time.sleep(0.5)
        start = time.monotonic()
        os.kill(child.pid, signal.SIGINT)
        assert child.stdout.readline() == "stopped\n"
        waited = time.monotonic() - start
        assert child.stdout.readline() == "alive\n"
        assert child.wait(timeout=30) == 0
    assert waited < 0.2


def test_irradiance_is_the_sum_of_its_parts(evening: celaje.Sky) -> None:
    """The level plane sees the sun under the sine of its elevation, 11 degrees."""
    e = evening.irradiance(spp=32, seed=2)
    assert e.wavelength_nm.tolist() == [450.0, 550.0, 650.0]
    assert e.global_ == pytest.approx(e.direct + e.diffuse, rel=1e-12)
    assert evening.conditions is not None
    sine = np.sin(np.radians(evening.conditions.sun_elevation_deg.value))
    assert e.direct == pytest.approx(e.direct_normal * sine, rel=2e-3)
    assert (e.direct_normal < evening.sun_irradiance).all()
    assert (e.diffuse_standard_error > 0.0).all()
    assert (e.diffuse_standard_error < 0.02 * e.diffuse).all()
    other = evening.irradiance(spp=32, seed=2, threads=1)
    assert np.array_equal(e.global_, other.global_)


def test_irradiance_through_an_absorbing_air() -> None:
    """E = E0 exp(-tau / sin h), nothing diffuse."""
    medium = celaje.Medium([0.0, 10e3], [450.0, 550.0], planet_radius_m=1e12)
    medium.add(0.0, 3e-5, celaje.Phase.rayleigh())
    e = medium.sky(sun_elevation=30, albedo=0.0, irradiance=2.0).irradiance()
    expected = 2.0 * np.exp(-0.6)
    assert e.direct_normal == pytest.approx(expected, rel=2e-3)
    assert e.direct == pytest.approx(0.5 * expected, rel=2e-3)
    assert (e.diffuse == 0.0).all()


def test_daylight_has_the_brightness_and_the_colour_of_daylight() -> None:
    """The published range of full daylight is about 100 klx, its colour 5000 to 6500 K; the darkest night has neither.

    At the point opposite the sun, what comes round the planet is less than single precision holds.
    """
    sky = celaje.sky(sun_elevation=60)
    e = sky.irradiance(spp=16)
    assert 80e3 < e.lux < 120e3
    assert e.cct_k is not None
    assert 5000 < e.cct_k < 6500
    night = celaje.sky(sun_elevation=-90).irradiance(spp=1)
    assert night.lux == 0.0
    assert night.cct_k is None


def test_films_of_two_seeds_are_merged(tmp_path: Path) -> None:
    """Rationale: many machines may share one picture. Expected: means by paths, variances by their weights squared."""
    sky = celaje.sky(sun_elevation=20, wavelengths="450,650")
    a, b = (sky.render(size=6, spp=spp, seed=spp) for spp in (32, 96))
    a.save(tmp_path / "a.exr")
    back = celaje.Film.load(tmp_path / "a.exr")
    assert np.array_equal(back.radiance, a.radiance)
    assert np.array_equal(back.samples, a.samples)
    both = back.merge(b)
    seen = both.samples > 0
    weight = (a.samples / np.maximum(both.samples, 1))[..., None]
    mean = weight * a.radiance + (1 - weight) * b.radiance
    variance = weight**2 * a.variance + (1 - weight) ** 2 * b.variance
    np.testing.assert_allclose(both.radiance[seen], mean[seen], rtol=1e-5)
    np.testing.assert_allclose(both.variance[seen], variance[seen], rtol=1e-4)
    with pytest.raises(celaje.InvalidInputError, match="seed 32"):
        both.merge(a)


def test_a_picture_ends_by_noise_or_time() -> None:
    """Rationale: whoever asks for 5 % gets it, and is told the paths; whoever has a second gets what fits into it."""
    sky = celaje.sky(sun_elevation=20, wavelengths="450,650")
    by_noise = sky.render(size=8, noise=0.05, sun_disc="off")
    assert by_noise.metadata["method"] == "path"
    assert int(by_noise.metadata["spp"]) >= 64
    error = np.sqrt(by_noise.variance.mean(axis=(0, 1))) / by_noise.radiance.mean(axis=(0, 1))
    assert error.max() < 0.055
    by_time = sky.render(size=8, time_limit=0.5)
    assert by_time.metadata["time_limit"] == "0.5 s"
    assert by_time.samples.max() >= 4


def test_a_cloud_must_fit_its_edges() -> None:
    sky = celaje.sky(sun_elevation=20, wavelengths="450,650")
    phase = celaje.Phase.henyey_greenstein(0.85)
    side, altitude = [-1e3, 1e3], [1e3, 2e3]
    with pytest.raises(celaje.ShapeMismatchError, match="density"):
        sky.with_cloud(side, side, altitude, np.ones((1, 1, 2)), 0.01, 0.0, phase)
    cloudy = sky.with_cloud(side, side, altitude, np.ones((1, 1, 1)), 0.01, 0.0, phase)
    with pytest.raises(celaje.InvalidInputError, match="cloud"):
        cloudy.radiance(0.0, 90.0, method="path", spp=4)


def test_a_picture_is_checked_and_corrected(evening: celaje.Sky) -> None:
    plain = evening.render(size=8, accuracy="preview", sun_disc="off")
    checked = evening.render(size=8, accuracy="preview", sun_disc="off", check=True)
    assert np.array_equal(plain.radiance, checked.radiance)
    assert checked.metadata["check_directions"] == "50"
    assert "±" in checked.metadata["check_mean"]
    assert "corrected_by" not in checked.metadata
    corrected = evening.render(size=8, accuracy="preview", sun_disc="off", correct=True)
    lit = plain.radiance > 0
    ratio = corrected.radiance[lit] / plain.radiance[lit]
    assert np.abs(ratio - 1).max() < 0.1
    changed = not corrected.metadata["corrected_by"].startswith("nothing")
    assert changed == bool((ratio != 1).any())
    assert changed == ("corrected_rms" in corrected.metadata)
    for wrong in ({"method": "path"}, {"spp": 4}, {"sun_disc": "only"}):
        with pytest.raises(celaje.InvalidInputError, match="method shells"):
            evening.render(size=8, correct=True, **wrong)

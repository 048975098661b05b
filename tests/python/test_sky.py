"""Conditions, atmosphere and medium of a sky: every stage is open."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pvlib
import pytest
import xarray

import celaje

from .conftest import PLACE, TIME


def test_conditions_have_value_unit_source_and_reason() -> None:
    c = celaje.climate(at=PLACE, time=TIME)
    for name, condition in c:
        assert condition.source, name
        assert condition.reason, name
    assert c.ozone_du.unit == "DU"
    assert 300 < c.ozone_du.value < 350
    assert c.aerosol.value == "climate"
    assert "nearest AIAA type: rural" in c.aerosol.reason
    assert c.albedo.unit == ""
    assert c.time is not None
    assert c.time.value == datetime(2026, 6, 21, 18, 30, tzinfo=timezone.utc)
    assert c.latitude_deg is not None
    assert c.latitude_deg.reason == "given by the user"
    assert "ozone_du" in repr(c)
    assert "refraction" in repr(c)


def test_a_time_may_be_text_or_a_datetime_with_any_zone() -> None:
    east = timezone(timedelta(hours=5, minutes=45))
    same = [
        celaje.climate(PLACE, time)
        for time in (
            TIME,
            "2026-06-22T00:15+05:45",
            datetime(2026, 6, 21, 18, 30, tzinfo=timezone.utc),
            datetime(2026, 6, 22, 0, 15, tzinfo=east),
        )
    ]
    assert len({c.sun_azimuth_deg.value for c in same}) == 1
    assert celaje.climate("41.65, -0.88", TIME) == same[0]
    fraction = celaje.climate(PLACE, "2026-06-21T18:30:01.25Z")
    assert fraction.time is not None
    assert fraction.time.value.microsecond == 250_000


@pytest.mark.parametrize("place", [(41.65, -0.88), (-33.45, -70.66), (69.65, 18.96), (0.0, 179.9)])
@pytest.mark.parametrize("time", ["1955-03-01T06:00Z", "2026-06-21T18:30Z", "2049-12-31T23:00Z"])
def test_the_sun_stands_where_pvlib_sees_it(place: tuple[float, float], time: str) -> None:
    """Another implementation of NREL's algorithm, with its own estimate of TT - UT1: 0.001 degrees."""
    import pandas as pd

    c = celaje.climate(place, time)
    sun = pvlib.solarposition.spa_python(
        pd.DatetimeIndex([time]), *place, altitude=0.0, delta_t=None
    ).iloc[0]
    assert c.sun_elevation_deg.value == pytest.approx(sun["elevation"], abs=1e-3)
    turn = (c.sun_azimuth_deg.value - sun["azimuth"] + 180.0) % 360.0 - 180.0
    assert abs(turn * np.cos(np.radians(sun["elevation"]))) < 1e-3


def test_given_words_are_in_force() -> None:
    sky = celaje.sky(
        sun_elevation=5,
        sun_azimuth=-90,
        altitude=500,
        aerosol="desert",
        aod_550=0.2,
        turbidity=2,
        humidity=50,
        ozone=250,
        albedo="fresh-snow",
        atmosphere="tropical",
        sun_spectrum="gueymard2004",
        wavelengths="400:700:100",
    )
    c = sky.conditions
    assert c is not None
    given = [c.sun_elevation_deg, c.sun_azimuth_deg, c.altitude_m, c.ozone_du, c.aod_550]
    assert [x.value for x in given] == pytest.approx([5, 270, 500, 250, 0.4])
    assert (c.aerosol.value, c.atmosphere.value, c.albedo.value) == ("desert", "tropical", 0.95)
    assert c.humidity_percent.value == 50
    assert c.latitude_deg is None
    assert c.time is None
    assert sky.wavelength_nm.tolist() == [400, 500, 600, 700]
    assert sky.albedo.tolist() == [0.95] * 4
    assert sky.medium.altitude_m[0] == 500
    same = celaje.climate(PLACE, TIME, ozone_climate="arosa")
    assert "Arosa" in same.ozone_du.reason
    aod = celaje.sky(sun_elevation=5, aod=0.3, wavelengths=[550.0]).conditions
    assert aod is not None
    assert aod.aod_550.value == 0.3


def test_atmosphere_holds_what_the_conditions_say(evening: celaje.Sky) -> None:
    """The ozone of the profile adds up to the column in force; the air to a surface pressure."""
    air, c = evening.atmosphere, evening.conditions
    assert air is not None
    assert c is not None
    step = np.diff(air.altitude_m)
    ozone = air.species["ozone"].number_density
    column_du = float(np.sum(0.5 * (ozone[1:] + ozone[:-1]) * step)) / 2.68678e20
    assert column_du == pytest.approx(c.ozone_du.value, rel=1e-6)
    # Ideal gas, k = 1.380649e-23 J/K.
    density = air.pressure_pa / (1.380649e-23 * air.temperature_k)
    assert density[0] == pytest.approx(air.species["air"].number_density[0], rel=5e-3)
    assert 250 < air.temperature_k[0] < 310
    assert {"continental", "stratosphere"} <= set(air.species)


def test_medium_of_a_sky_has_the_optical_depths_of_its_parts(evening: celaje.Sky) -> None:
    """At 550 nm, 414 m up: the aerosol in force, Rayleigh 0.093, ozone 0.030 (329 DU), the upper aerosol 0.005."""
    depth = evening.medium.vertical_optical_depth()
    assert depth.shape == (3,)
    conditions = evening.conditions
    assert conditions is not None
    assert 0.123 < depth[1] - conditions.aod_550.value < 0.135
    medium = evening.medium
    assert medium.sigma_t.shape == (medium.altitude_m.size, 3)
    total = np.sum([sigma_s for sigma_s, _ in medium.species], axis=0)
    np.testing.assert_allclose(total, medium.sigma_s, rtol=1e-5, atol=1e-15)
    assert (medium.sigma_a >= 0).all()
    # A copy: what is done to it does not reach the sky.
    medium.add(1e-3, 0.0, celaje.Phase.rayleigh())
    assert evening.medium.vertical_optical_depth()[1] == depth[1]


def test_the_sun_above_the_air_is_the_solar_constant() -> None:
    """TSIS-1, 280 to 2500 nm: 1309.41 W/m2 at 1 au."""
    sky = celaje.sky(sun_elevation=30, aod_550=0, wavelengths="280:2500:20")
    assert float(sky.sun_irradiance.sum() * 20) == pytest.approx(1309.4, rel=0.01)


def test_spelling_of_wavelengths() -> None:
    def nm(wavelengths: object) -> list[float]:
        sky = celaje.sky(sun_elevation=30, aod_550=0, wavelengths=wavelengths)  # type: ignore[arg-type]
        return list(sky.wavelength_nm)

    assert nm("450,550") == nm([450, 550]) == nm(np.array([450.0, 550.0])) == [450.0, 550.0]
    assert nm(550) == [550.0]


def test_stokes_vectors() -> None:
    """A quarter circle from the sun in its meridian the sky is polarised across it: Q < 0, U = 0."""
    sky = celaje.sky(sun_elevation=30, wavelengths="450,650")
    full = sky.radiance([0.0, 0.0], [60.0, 20.0], spp=256, polarised=True)
    assert full.radiance.shape == full.standard_error.shape == (2, 2, 4)
    i, q, u, v = np.moveaxis(full.radiance, -1, 0)
    assert (q[0] < -0.4 * i[0]).all()
    assert (np.abs(u) < 0.05 * i).all()
    assert (np.abs(v) < 0.01 * i).all()
    plain = sky.radiance([0.0, 0.0], [60.0, 20.0], spp=256)
    assert np.array_equal(plain.radiance, full.radiance[..., 0])
    scalar = sky.radiance([0.0, 0.0], [60.0, 20.0], spp=256, polarised=False)
    assert not np.array_equal(scalar.radiance, plain.radiance)
    shells = sky.radiance([0.0, 0.0], [60.0, 20.0], method="shells", polarised=True).radiance
    allowed = 5 * full.standard_error + 0.01 * full.radiance[..., :1]
    assert (np.abs(shells - full.radiance) < allowed).all()
    assert (np.abs(shells[..., 2]) < 1e-4 * shells[..., 0]).all()


def test_pictures_of_stokes_vectors(tmp_path: Path) -> None:
    """Rationale: a picture's axes are those of single directions, and files and merging keep all four components.

    Expected: I of a polarised picture is that of a plain one, to the bit; in the sun's meridian, a quarter circle from
    the sun, the field is level; EXR comes back to the bit; NetCDF and xarray hold the same; twice the paths have half
    the variance.
    """
    sky = celaje.sky(sun_elevation=30, sun_azimuth=180, wavelengths="450,650")
    view = {"projection": "perspective", "fov": 6.0, "look": (0.0, 60.0), "size": (3, 3)}
    film = sky.render(**view, spp=1024, seed=1, polarised=True)  # type: ignore[arg-type]
    plain = sky.render(**view, spp=1024, seed=1)  # type: ignore[arg-type]
    assert film.stokes.shape == film.stokes_standard_error.shape == (3, 3, 2, 4)
    assert film.metadata["method"] == "path"
    assert np.array_equal(film.stokes[..., 0], plain.radiance)
    assert np.array_equal(film.stokes_standard_error[..., 0], plain.standard_error)
    i, q, u, v = np.moveaxis(film.stokes[1, 1], -1, 0)
    assert (q < -0.4 * i).all()
    assert (np.abs(u) < 0.05 * i).all()
    assert (np.abs(v) < 0.01 * i).all()
    assert (np.abs(film.angle_of_polarisation_deg[1, 1]) > 85).all()
    single = sky.radiance(0.0, 60.0, spp=1024, polarised=True, seed=2)
    error = np.hypot(single.standard_error[0], film.stokes_standard_error[1, 1])
    off = np.abs(film.stokes[1, 1] - single.radiance[0])
    assert (off < 6 * error + 0.01 * single.radiance[0, :, :1]).all()
    degree = np.hypot(film.stokes[..., 1], film.stokes[..., 2]) / film.stokes[..., 0]
    np.testing.assert_allclose(film.degree_of_polarisation, degree, rtol=1e-5)

    path = tmp_path / "stokes.exr"
    film.save(path)
    back = celaje.Film.load(path)
    assert np.array_equal(back.stokes, film.stokes)
    assert np.array_equal(back.stokes_standard_error, film.stokes_standard_error)
    other = sky.render(**view, spp=1024, seed=2, polarised=True)  # type: ignore[arg-type]
    both = film.merge(other)
    np.testing.assert_allclose(
        both.stokes, 0.5 * (film.stokes + other.stokes), rtol=1e-5, atol=1e-9
    )

    data = film.xarray()
    assert np.array_equal(data.stokes_u.values, film.stokes[..., 2])
    film.save(tmp_path / "stokes.nc")
    kept = xarray.open_dataset(tmp_path / "stokes.nc", engine="scipy")
    assert set(data.data_vars) == set(kept.data_vars)
    for name in ("degree_of_linear_polarisation", "angle_of_polarisation_deg", "stokes_v_variance"):
        np.testing.assert_allclose(kept[name].values, data[name].values, rtol=1e-5, atol=1e-12)

    with pytest.raises(celaje.InvalidInputError, match="radiance alone"):
        _ = plain.stokes
    with pytest.raises(celaje.InvalidInputError, match="tracker"):
        sky.render(size=4, method="tracker", polarised=True)
    solved = sky.render(**view, polarised=True)  # type: ignore[arg-type]
    assert solved.metadata["method"] == "shells"
    off = np.abs(solved.stokes - film.stokes)[..., :3]
    assert (off < 6 * film.stokes_standard_error[..., :3] + 0.01 * film.stokes[..., :1]).all()


def test_a_matrix_of_ones_own() -> None:
    """Rayleigh scattering as a table polarises as Rayleigh scattering does."""
    theta = np.linspace(0.0, 180.0, 721)
    c = np.cos(np.radians(theta))
    norm = 3.0 / (16.0 * np.pi)
    p, p12, p33 = norm * (1 + c**2), norm * (c**2 - 1), norm * 2 * c
    seen = []
    for phase in (celaje.Phase.table(theta, p, p12, p33), celaje.Phase.rayleigh(0.0)):
        medium = celaje.Medium([0.0, 1e4], [500.0])
        medium.add(np.full((2, 1), 2e-5), np.zeros((2, 1)), phase)
        sky = medium.sky(sun_elevation=40, albedo=0.0)
        look = sky.radiance([30.0, 100.0], [40.0, 15.0], spp=256, polarised=True, max_order=1)
        seen.append(look.radiance)
    assert np.abs(seen[0] - seen[1]).max() < 2e-3 * seen[1][..., 0].max()
    with pytest.raises(celaje.InvalidInputError, match="exceeds"):
        celaje.Phase.table(theta, p, 2 * p12, p33)

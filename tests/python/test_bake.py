"""Tables: baked, put under other suns, kept in files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import celaje

LOOKS = ([180.0, 200.0, 20.0], [5.0, 30.0, 80.0])


@pytest.fixture(scope="module")
def baked() -> celaje.Sky:
    """Three wavelengths, suns from -4 to 12 degrees."""
    sky = celaje.sky(sun_elevation=10, sun_azimuth=170, wavelengths=[450.0, 550.0, 650.0])
    return sky.bake((-4, 12), highest_observer_m=5000, accuracy="preview")


def test_a_file_gives_the_same_sky(baked: celaje.Sky, tmp_path: Path) -> None:
    """Bit for bit, under the sun it was saved with and under others."""
    path = tmp_path / "air.celaje"
    baked.save_tables(path)
    again = celaje.tables(path)
    assert again.is_baked
    assert again.conditions is None
    assert baked.conditions is not None
    for first, second in (
        (baked, again),
        (baked.under(-3, 90, 1.01), again.under(-3, 90, 1.01)),
    ):
        a, b = first.radiance(*LOOKS), second.radiance(*LOOKS)
        np.testing.assert_array_equal(a.radiance, b.radiance)
        assert (a.radiance > 0).all()
        assert (a.standard_error == 0).all()
        np.testing.assert_array_equal(first.sun_irradiance, second.sun_irradiance)
    film = again.under(4.0).render(size=8)
    assert film.metadata["aerosol"] == "opac:continental-average"


def test_suns_and_directions_in_one_call(baked: celaje.Sky) -> None:
    """The batch is the single views, one after the other."""
    suns = ([-3.0, 5.0], [90.0, 250.0])
    batch = baked.radiance_under(*suns, *LOOKS)
    assert batch.shape == (2, 3, 3)
    for seen, elevation, azimuth in zip(batch, *suns, strict=True):
        single = baked.under(elevation, azimuth).radiance(*LOOKS, sun_disc="off")
        np.testing.assert_array_equal(seen, single.radiance)


def test_tables_are_polarised_or_say_so(baked: celaje.Sky) -> None:
    """Q and U come from the same tables as the radiance; tables of scalar light tell none."""
    plain, full = baked.radiance(*LOOKS), baked.radiance(*LOOKS, polarised=True)
    assert full.radiance.shape == (3, 3, 4)
    np.testing.assert_allclose(full.radiance[..., 0], plain.radiance, rtol=1e-6)
    i, q, u, v = np.moveaxis(full.radiance, -1, 0)
    assert (np.hypot(q, u)[2] > 0.3 * i[2]).all()
    assert (v == 0).all()
    scalar = baked.bake((9, 11), accuracy="preview", polarised=False)
    assert (scalar.radiance(*LOOKS).radiance != plain.radiance).all()
    with pytest.raises(celaje.InvalidInputError, match="scalar light"):
        scalar.radiance(*LOOKS, polarised=True)


def test_a_tilted_plane(baked: celaje.Sky) -> None:
    """Direct light follows the cosine; shells agrees with path on the diffuse light, ground included."""
    level = baked.irradiance()
    facing = baked.irradiance(tilt_deg=80, azimuth_deg=170)
    np.testing.assert_allclose(level.direct_normal, facing.direct_normal)
    # The plane faces the middle of the disc.
    np.testing.assert_allclose(facing.direct, facing.direct_normal, rtol=1e-4)
    sine = np.sin(np.radians(10.0))
    np.testing.assert_allclose(level.direct, level.direct_normal * sine, rtol=2e-3)
    for tilt_deg in (0.0, 80.0):
        e = baked.irradiance(tilt_deg=tilt_deg, azimuth_deg=170)
        path = baked.irradiance(method="path", spp=128, seed=2, tilt_deg=tilt_deg, azimuth_deg=170)
        assert (path.diffuse_standard_error < 0.01 * path.diffuse).all()
        # Preview's own error, 3 %, and the noise.
        np.testing.assert_allclose(e.diffuse, path.diffuse, rtol=0.03 + 0.04)
    away = baked.irradiance(tilt_deg=90, azimuth_deg=350)
    assert (away.direct == 0).all()
    assert (away.diffuse > 0).all()


def test_what_tables_do_not_hold_is_refused(baked: celaje.Sky, tmp_path: Path) -> None:
    """Suns and altitudes beyond, skies without tables, files that are none."""
    with pytest.raises(celaje.OutOfRangeError, match="sun zenith angle"):
        baked.under(-12).radiance(*LOOKS)
    with pytest.raises(celaje.OutOfRangeError):
        baked.under(-4).radiance(*LOOKS, altitude_m=400_000)
    with pytest.raises(celaje.OutOfRangeError, match="tilt"):
        baked.irradiance(tilt_deg=200)
    plain = celaje.sky(sun_elevation=10, wavelengths=[550.0])
    assert not plain.is_baked
    with pytest.raises(celaje.InvalidInputError, match="no tables"):
        plain.save_tables(tmp_path / "a.celaje")
    with pytest.raises(celaje.InvalidInputError, match="no tables"):
        plain.radiance_under(5.0, 180.0, *LOOKS)
    with pytest.raises(celaje.UnknownNameError, match="accuracy"):
        plain.bake(accuracy="best")
    bad = tmp_path / "bad.celaje"
    with pytest.raises(celaje.FileError, match="bad"):
        celaje.tables(bad)
    bad.write_bytes(b"\x89PNG\r\n")
    with pytest.raises(celaje.FileError, match="holds no tables"):
        celaje.tables(bad)

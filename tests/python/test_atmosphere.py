"""What the air is made of, and aerosols of one's own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import celaje

NAN = float("nan")


def smoke(**words: object) -> celaje.Aerosol:
    """An aerosol of one's own, one word of it replaced."""
    given: dict[str, object] = {
        "refractive_index": 1.52 + 0.02j,
        "size_distribution": celaje.SizeDistribution(0.08, 1.6),
        "profile": ([0.0, 2000.0, 3000.0, 5000.0], [0.1, 0.2, 1.0, 0.0]),
        "name": "smoke",
    }
    return celaje.Aerosol(**{**given, **words})  # type: ignore[arg-type]


def test_parts_are_the_whole(evening: celaje.Sky) -> None:
    """Rationale: what is shown must be what light meets. Expected: parts add up to the medium, node by node."""
    air = evening.atmosphere
    assert air is not None
    sigma = np.sum([s.sigma_s + s.sigma_a for s in air.species.values()], axis=0)
    np.testing.assert_allclose(sigma, evening.medium.sigma_t, rtol=2e-5, atol=1e-12)
    layers = [s for s in air.species.values() if s.is_aerosol]
    np.testing.assert_allclose(air.aerosol.tau, np.sum([s.tau for s in layers], axis=0))
    assert air.species["ozone"].phase is None
    ozone = air.species["ozone"].number_density
    column = float(np.sum(0.5 * (ozone[1:] + ozone[:-1]) * np.diff(air.altitude_m))) / 2.68678e20
    assert evening.conditions is not None
    assert column == pytest.approx(evening.conditions.ozone_du.value, rel=1e-9)
    assert "air, ozone" in repr(air)
    assert air._repr_svg_().startswith("<svg")


def test_files_of_the_air(evening: celaje.Sky, tmp_path: Path) -> None:
    air = evening.atmosphere
    assert air is not None
    for name, start in [
        ("a.svg", b"<svg"),
        ("b.nc", b"CDF\x02"),
        ("c.csv", b"# latitude_deg: 41.65"),
    ]:
        air.save(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(start)
    with pytest.raises(celaje.FileError, match=r"\.csv, \.nc or \.svg"):
        air.save(tmp_path / "air.png")
    with pytest.raises(celaje.FileError, match="does not exist"):
        air.save(tmp_path / "missing" / "air.nc")


def test_no_air_of_a_medium_of_ones_own(slab: celaje.Sky) -> None:
    assert slab.atmosphere is None


def test_an_aerosol_of_ones_own_is_mie_theory() -> None:
    """A distribution so narrow that it is one sphere: the efficiencies of :func:`celaje.mie`, to the width left."""
    radius_um, nm = 0.3, 550.0
    narrow = celaje.SizeDistribution(radius_um, 1.001, r_min_um=0.29, r_max_um=0.31)
    own = smoke(size_distribution=narrow, refractive_index=1.4 + 0.05j)
    sphere = celaje.mie(1.4 + 0.05j, 2 * np.pi * radius_um / (nm * 1e-3))
    # 1 cm⁻³ of spheres: km⁻¹ = 1e9 m² µm⁻² ...
    area_m2 = np.pi * (radius_um * 1e-6) ** 2
    assert own.extinction(nm) == pytest.approx(1e9 * area_m2 * sphere.q_ext, rel=1e-3)
    assert own.ssa(nm) == pytest.approx(sphere.q_sca / sphere.q_ext, abs=1e-3)
    assert own.asymmetry(nm) == pytest.approx(sphere.asymmetry, abs=1e-3)


def test_a_sky_with_an_aerosol_of_ones_own() -> None:
    """It lies where it was put, in the amount that was asked for, under its own name."""
    words: dict[str, object] = {"sun_elevation": 30, "wavelengths": [450.0, 550.0]}
    own = smoke(name="my smoke")
    sky = celaje.sky(aerosol=own, aod_550=0.4, **words)  # type: ignore[arg-type]
    assert sky.conditions is not None
    assert sky.conditions.aerosol.value == "my smoke"
    air = sky.atmosphere
    assert air is not None
    layer = air.species["my smoke"]
    assert layer.tau[1] == pytest.approx(0.4, rel=1e-3)
    density = np.interp([1000.0, 3000.0, 6000.0], air.altitude_m, layer.number_density)
    assert density[1] > 5 * density[0] > 0
    assert density[2] == 0
    assert layer.tau_s[1] / layer.tau[1] == pytest.approx(own.ssa(550.0), abs=1e-9)
    radiance = sky.radiance(180.0, 45.0, method="shells").radiance
    assert np.isfinite(radiance).all()
    assert (radiance > 0).all()


def test_a_table_of_indices_is_extrapolated_downwards_with_a_flag_and_not_upwards() -> None:
    index = ([400.0, 500.0, 600.0, 700.0], [1.5 + 0.03j, 1.5 + 0.02j, 1.5 + 0.01j, 1.5 + 0.01j])
    own = smoke(refractive_index=index)
    for nm, flagged in [([350.0, 550.0], True), ([450.0, 550.0], False)]:
        air = celaje.sky(sun_elevation=30, aerosol=own, wavelengths=nm).atmosphere
        assert air is not None
        assert air.extrapolated is flagged
    with pytest.raises(celaje.OutOfRangeError, match="wavelength = 750 nm"):
        celaje.sky(sun_elevation=30, aerosol=own, wavelengths=[550.0, 750.0])


def test_bounds_that_miss_the_mode_are_refused() -> None:
    far = celaje.SizeDistribution(0.1, 1.05, r_min_um=1.0, r_max_um=2.0)
    with pytest.raises(celaje.InvalidInputError, match="no particles between"):
        smoke(size_distribution=far).ssa(550.0)


def test_matter_that_is_air_is_refused() -> None:
    with pytest.raises(celaje.InvalidInputError, match="scatter nothing"):
        smoke(refractive_index=1.0).ssa(550.0)


def test_bad_aerosols_of_ones_own() -> None:
    size = celaje.SizeDistribution
    cases: list[tuple[type[Exception], str, Callable[[], object]]] = [
        (celaje.OutOfRangeError, "k = -0.02", lambda: smoke(refractive_index=1.5 - 0.02j)),
        (celaje.OutOfRangeError, "n = NaN", lambda: smoke(refractive_index=NAN)),
        (celaje.InvalidInputError, "not understood", lambda: smoke(refractive_index="glass")),
        (
            celaje.InvalidInputError,
            "increase",
            lambda: smoke(refractive_index=([500, 400], [1.5, 1.5])),
        ),
        (
            celaje.ShapeMismatchError,
            "n",
            lambda: smoke(refractive_index=([400, 500], [1.5, 1.5, 1.5])),
        ),
        (celaje.OutOfRangeError, "deviation = 1 ", lambda: smoke(size_distribution=size(0.1, 1.0))),
        (
            celaje.OutOfRangeError,
            "deviation = 0.5",
            lambda: smoke(size_distribution=size(0.1, 0.5)),
        ),
        (celaje.OutOfRangeError, "radius = -0.1", lambda: smoke(size_distribution=size(-0.1, 1.5))),
        (
            celaje.InvalidInputError,
            "not below",
            lambda: smoke(size_distribution=size(0.1, 1.5, 1.0, 2.0, 1.0)),
        ),
        (
            celaje.OutOfRangeError,
            "fraction = -1",
            lambda: smoke(size_distribution=size([0.1, 0.2], 1.5, [1.0, -1.0])),
        ),
        (
            celaje.InvalidInputError,
            "without particles",
            lambda: smoke(size_distribution=size(0.1, 1.5, 0.0)),
        ),
        (
            celaje.ShapeMismatchError,
            "per mode",
            lambda: smoke(size_distribution=size([0.1, 0.2], [1.5, 1.6, 1.7])),
        ),
        (celaje.InvalidInputError, "SizeDistribution", lambda: smoke(size_distribution=(0.1, 1.5))),
        (celaje.InvalidInputError, "increase", lambda: smoke(profile=([0.0, 0.0], [1.0, 1.0]))),
        (celaje.InvalidInputError, "increase", lambda: smoke(profile=([1000.0, 0.0], [1.0, 1.0]))),
        (
            celaje.OutOfRangeError,
            "profile = -1",
            lambda: smoke(profile=([0.0, 1000.0], [1.0, -1.0])),
        ),
        (
            celaje.InvalidInputError,
            "without particles",
            lambda: smoke(profile=([0.0, 1000.0], [0.0, 0.0])),
        ),
        (celaje.OutOfRangeError, "altitude = NaN", lambda: smoke(profile=([0.0, NAN], [1.0, 1.0]))),
        (celaje.OutOfRangeError, "scale height = 0", lambda: smoke(profile=0.0)),
        (celaje.OutOfRangeError, "scale height = NaN", lambda: smoke(profile=NAN)),
        (celaje.InvalidInputError, "not understood", lambda: smoke(profile="high")),
        (
            celaje.InvalidInputError,
            "component",
            lambda: celaje.sky(sun_elevation=9, aerosol=celaje.component("waso")),
        ),
    ]
    for kind, message, act in cases:
        with pytest.raises(kind, match=message) as caught:
            act()
        assert "hint: " in str(caught.value), message

"""A medium of one's own, and phase functions."""

from __future__ import annotations

import numpy as np
import pytest

import celaje


def exponential() -> celaje.Medium:
    z = np.linspace(0.0, 100e3, 401)
    m = celaje.Medium(z, [450.0, 650.0], planet_radius_m=6_371_000.0)
    m.add(np.exp(-z / 8e3)[:, None] * [2e-5, 1e-5], 0.0, celaje.Phase.rayleigh(0.0279))
    return m


def test_medium_gives_back_what_it_was_given() -> None:
    m = exponential()
    assert m.planet_radius_m == 6_371_000.0
    assert m.wavelength_nm.tolist() == [450.0, 650.0]
    np.testing.assert_allclose(m.sigma_s[0], [2e-5, 1e-5], rtol=1e-6)
    assert (m.sigma_a == 0).all()
    # The integral of an exponential, whose linear pieces of 250 m add (h/H)²/12 = 8e-5.
    np.testing.assert_allclose(m.vertical_optical_depth(), [0.16, 0.08], rtol=2e-4)


def test_arguments_per_wavelength_or_for_all() -> None:
    m = exponential()
    m.add(0.0, 1e-6, celaje.Phase.henyey_greenstein([0.7, 0.6]))
    m.add(np.full((401, 1), 1e-7), np.zeros((1, 2)), celaje.Phase.legendre([1.0, 0.9]))
    assert len(m.species) == 3
    sky = m.sky(
        sun_elevation=30,
        sun_azimuth=180,
        albedo=[0.1, 0.3],
        irradiance=[1.0, 2.0],
        sun_angular_radius_deg=0.0,
    )
    assert sky.albedo.tolist() == [0.1, 0.3]
    np.testing.assert_allclose(sky.sun_irradiance, [1.0, 2.0])
    assert sky.conditions is None
    assert sky.atmosphere is None


def test_radiance_is_linear_in_irradiance() -> None:
    m = exponential()
    one = m.sky(30, irradiance=1.0).radiance(0.0, 45.0, spp=16)
    two = m.sky(30, irradiance=2.0).radiance(0.0, 45.0, spp=16)
    np.testing.assert_allclose(two.radiance, 2 * one.radiance, rtol=1e-5)


def test_a_sky_keeps_the_medium_that_it_was_made_of() -> None:
    m = exponential()
    sky = m.sky(30)
    before = sky.radiance(0.0, 45.0, spp=8).radiance
    m.add(1e-4, 0.0, celaje.Phase.rayleigh())
    assert np.array_equal(sky.radiance(0.0, 45.0, spp=8).radiance, before)


@pytest.mark.parametrize(
    "phase",
    [
        celaje.Phase.rayleigh(),
        celaje.Phase.henyey_greenstein(0.8),
        celaje.Phase.table([0, 90, 180], [1 / (4 * np.pi)] * 3),
        celaje.Phase.legendre([1.0, 1.2, 0.5]),
    ],
)
def test_phase_functions_integrate_to_one(phase: celaje.Phase) -> None:
    """Gauss–Legendre in cos θ: exact but for the peak of the sharpest."""
    x, w = np.polynomial.legendre.leggauss(200)
    theta = np.degrees(np.arccos(x))
    assert float(2 * np.pi * (phase.at(theta) @ w)[0]) == pytest.approx(1.0, abs=1e-5)


def test_phase_functions_are_the_published_ones() -> None:
    theta = np.array([0.0, 60.0, 90.0, 180.0])
    cos = np.cos(np.radians(theta))
    hg = (1 - 0.49) / (4 * np.pi * (1.49 - 1.4 * cos) ** 1.5)
    np.testing.assert_allclose(celaje.Phase.henyey_greenstein(0.7).at(theta)[0], hg, rtol=1e-6)
    rayleigh = 3 / (16 * np.pi) * (1 + cos**2)
    np.testing.assert_allclose(celaje.Phase.rayleigh(0.0).at(theta)[0], rayleigh, rtol=1e-6)
    with pytest.raises(celaje.InvalidInputError, match="negative at"):
        celaje.Phase.legendre([1.0, 1.5])
    series = (1 + 0.9 * cos) / (4 * np.pi)
    np.testing.assert_allclose(celaje.Phase.legendre([1.0, 0.9]).at(theta)[0], series, rtol=1e-5)


def test_tables_per_wavelength() -> None:
    flat = np.full(3, 1 / (4 * np.pi))
    tilted = flat * [1.5, 1.0, 0.5]
    m = exponential()
    m.add(1e-6, 0.0, celaje.Phase.table([0, 90, 180], [flat, tilted]))
    assert celaje.Phase.table([0, 90, 180], [flat, tilted]).at([0.0, 180.0]).shape == (2, 2)
    with pytest.raises(celaje.ShapeMismatchError, match="3 wavelengths"):
        m.add(1e-6, 0.0, celaje.Phase.table([0, 90, 180], [flat] * 3))

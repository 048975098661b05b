"""Skies that several tests look at; made once, they take about a second each."""

from __future__ import annotations

import numpy as np
import pytest

import celaje

PLACE = (41.65, -0.88)
TIME = "2026-06-21T18:30Z"


@pytest.fixture(scope="session")
def evening() -> celaje.Sky:
    """Zaragoza at midsummer, the sun at 11 degrees, three wavelengths."""
    return celaje.sky(at=PLACE, time=TIME, wavelengths=[450.0, 550.0, 650.0])


@pytest.fixture(scope="session")
def slab() -> celaje.Sky:
    """A planet so large that it is flat, under isotropic air of optical depth 0.3 over a black ground."""
    medium = celaje.Medium([0.0, 10e3], [550.0], planet_radius_m=1e12)
    medium.add(3e-5, 0.0, celaje.Phase.henyey_greenstein(0.0))
    return medium.sky(sun_elevation=60, albedo=0.0, irradiance=1.0)


def relative_difference(
    a: np.typing.NDArray[np.floating], b: np.typing.NDArray[np.floating]
) -> float:
    """Largest relative difference of two arrays."""
    return float(np.max(np.abs(a / b - 1.0)))

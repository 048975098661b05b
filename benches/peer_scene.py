"""The peer scene, read from ``tests/reference``, for the codes that are timed beside ours by ``benches/peers.rs``."""

import csv
from pathlib import Path

import numpy as np

REFERENCE = Path(__file__).resolve().parent.parent / "tests" / "reference"
RADIUS_M, ALBEDO, DEPOLARISATION, SUN_ZENITH_DEG = 6_371_000.0, 0.1, 0.0279, 60.0
# Wavelengths of the published table.
NM = np.arange(380.0, 781.0, 50.0)


def rows(name: str) -> list[list[str]]:
    """Rows of a table, without its comments and header."""
    lines = (REFERENCE / name).read_text(encoding="utf-8").splitlines()
    return list(csv.reader(line for line in lines if not line.startswith("#")))[1:]


def views() -> np.ndarray:
    """View zenith angle and azimuth from the sun, in the table's order, shape (41, 2), in degrees."""
    first = f"{NM[0]:g}"
    chosen = [r for r in rows("peer_scene_rayleigh_sun60.csv") if r[:2] == ["SO", first]]
    return np.array([[float(r[2]), float(r[3])] for r in chosen])


def density() -> tuple[np.ndarray, np.ndarray]:
    """Altitudes [m] and number density [m-3], linear between them."""
    table = rows("peer_scene_air_density.csv")
    z, n = np.array([[1e3 * float(r[0]), float(r[3])] for r in table]).T
    return z, n


def cross_section_m2(wavelength_nm: np.ndarray) -> np.ndarray:
    """Cross section of Rayleigh scattering [m2], Bodhaine et al. 1999, eq. 29."""
    l2 = (wavelength_nm * 1e-3) ** 2
    return (
        1e-32
        * (1.0455996 - 341.29061 / l2 - 0.90230850 * l2)
        / (1 + 0.0027059889 / l2 - 85.968563 * l2)
    )

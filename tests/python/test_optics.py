"""Particles and molecules, against other codes and printed tables."""

from __future__ import annotations

import csv
from pathlib import Path

import miepython
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import celaje

REFERENCE = Path(__file__).parents[1] / "reference"


def rows(name: str) -> list[dict[str, str]]:
    text = (REFERENCE / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in text if not line.startswith("#")))


# Sizes from 1e-4 to 5000, evenly spread over their logarithm; weak, strong and no absorption.
SIZES = st.floats(-4.0, 3.69897).map(lambda e: 10.0**e)
REAL = st.floats(1.05, 3.0)
IMAGINARY = st.one_of(st.just(0.0), st.floats(-6.0, 0.3).map(lambda e: 10.0**e))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(n=REAL, k=IMAGINARY, x=SIZES)
def test_mie_agrees_with_miepython(n: float, k: float, x: float) -> None:
    """Rationale: an independent code over the whole range of spheres. Expected: efficiencies to 1e-6 of themselves.

    Its small-sphere series (below x = 0.1) is truncated at relative O(x⁴), which is allowed for; absorption of a
    weakly absorbing sphere is a difference of near equals in both codes.
    """
    ours = celaje.mie(refractive_index=complex(n, k), size_parameter=x)
    q_ext, q_sca, _, asymmetry = miepython.efficiencies_mx(complex(n, -k), x)
    tolerance = 1e-6 + (30 * x**4 if x < 0.1 else 0.0)
    assert ours.q_ext == pytest.approx(float(q_ext), rel=tolerance)
    assert ours.q_sca == pytest.approx(float(q_sca), rel=tolerance)
    assert ours.asymmetry == pytest.approx(float(asymmetry), abs=tolerance)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(n=REAL, k=IMAGINARY, x=st.floats(-0.9, 2.5).map(lambda e: 10.0**e))
def test_amplitudes_agree_with_miepython(n: float, k: float, x: float) -> None:
    """Its amplitudes, for n − ik, are the complex conjugates of ours; differences relative to the forward peak."""
    theta = np.array([0.0, 1.0, 30.0, 90.0, 137.0, 180.0])
    sphere = celaje.mie(complex(n, k), x)
    theirs = miepython.S1_S2(complex(n, -k), x, np.cos(np.radians(theta)), norm="wiscombe")
    for ours, other in zip((sphere.s1(theta), sphere.s2(theta)), theirs, strict=True):
        assert np.abs(ours - np.conj(other)).max() <= 1e-6 * np.abs(other[0])


def test_mie_conserves_energy_without_absorption() -> None:
    for x in (1e-3, 0.5, 7.0, 300.0, 1e4):
        sphere = celaje.mie(1.33, x)
        assert sphere.q_ext == pytest.approx(sphere.q_sca, rel=1e-12)


def test_bohren_and_huffman_appendix_a() -> None:
    """BHMIE's sample output: m = 1.55, x = 5.213; digits as printed."""
    sphere = celaje.mie(1.55, 5.213)
    assert sphere.q_ext == pytest.approx(3.10543, abs=5e-4)
    for row in rows("mie_bohren_huffman_appendixA_matrix.csv"):
        theta = float(row["theta_deg"])
        s1, s2 = complex(sphere.s1(theta)), complex(sphere.s2(theta))
        s11 = abs(s1) ** 2 + abs(s2) ** 2
        assert (abs(s1) ** 2 - abs(s2) ** 2) / s11 == pytest.approx(float(row["POL"]), abs=2e-3)


def test_opac_components_are_the_published_ones() -> None:
    """Extinction at 550 nm within 0.5 %, single-scattering albedo within 0.002."""
    seen = 0
    for row in rows("opac_component_optics.csv"):
        if row["wavelength_um"] != "0.55":
            continue
        seen += 1
        ours = celaje.component(row["component"], humidity=float(row["rh_percent"]))
        assert ours.extinction(550.0) == pytest.approx(float(row["ext_km-1_per_cm-3"]), rel=5e-3), (
            row
        )
        assert ours.ssa(550.0) == pytest.approx(float(row["ssa"]), abs=2e-3), row
    assert seen >= 10


def test_aerosol_types() -> None:
    """OPAC's own table (Hess et al. 1998, table 4): continental average at 80 %, 550 nm."""
    a = celaje.aerosol("opac:continental-average", humidity=80)
    assert a.extinction(550.0) == pytest.approx(0.075, rel=0.01)
    assert a.ssa(550.0) == pytest.approx(0.925, abs=0.002)
    assert a.asymmetry(550.0) == pytest.approx(0.703, abs=0.005)
    nm = np.array([650.0, 450.0, 550.0])
    extinction = a.extinction(nm)
    assert isinstance(extinction, np.ndarray)
    assert extinction.tolist() == [a.extinction(w) for w in nm]
    assert extinction[1] > extinction[2] > extinction[0]
    assert a.extinction(nm.reshape(3, 1)).shape == (3, 1)  # type: ignore[union-attr]


@pytest.mark.parametrize("name", ["desert", "aiaa:maritime-clean", "opac:urban"])
def test_aerosol_phase_functions(name: str) -> None:
    """Shape (n,) for one wavelength; over the sphere it integrates to 1 and gives the asymmetry stated."""
    a = celaje.aerosol(name)
    u = np.linspace(0.0, 1.0, 20_001)
    theta = 180.0 * u**3
    p = a.phase(550.0, theta)
    assert isinstance(p, np.ndarray)
    assert p.shape == theta.shape
    cos = np.cos(np.radians(theta))
    ring = np.pi * (p[1:] + p[:-1]) * -np.diff(cos)
    middle = 0.5 * (cos[1:] + cos[:-1])
    assert float(ring.sum()) == pytest.approx(1.0, abs=1e-3)
    assert float((ring * middle).sum()) == pytest.approx(float(a.asymmetry(550.0)), abs=3e-3)
    assert isinstance(a.phase(550.0, 90.0), float)
    assert a.phase([450.0, 550.0], [0.0, 90.0, 180.0]).shape == (2, 3)  # type: ignore[union-attr]


def test_rayleigh_cross_sections_are_bucholtz_table_2() -> None:
    """0.1 % from 350 to 800 nm, 0.4 % elsewhere."""
    table = rows("rayleigh_bucholtz1995_table2.csv")
    keys = list(table[0])
    nm = np.array([float(r[keys[0]]) for r in table]) * (1e3 if "um" in keys[0] else 1.0)
    published = np.array([float(r[keys[1]]) for r in table])
    ours = celaje.rayleigh_cross_section(nm) * (1e4 if "cm2" in keys[1] else 1.0)
    off = np.abs(ours / published - 1)
    inner = (nm >= 350) & (nm <= 800)
    assert off[inner].max() < 1e-3
    assert off.max() < 4e-3
    assert isinstance(celaje.rayleigh_cross_section(550.0), float)

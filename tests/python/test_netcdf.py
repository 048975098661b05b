"""NetCDF files as others read them: xarray by way of scipy, an independent reader of the classic format."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import xarray

import celaje

pytest.importorskip("scipy")

NAMES = Path(__file__).parent / "data" / "cf_standard_names.csv"
# Units that differ from the canonical ones by a factor only.
SAME_DIMENSION = {
    "m": {"m", "nm"},
    "W m-2 m-1 sr-1": {"W m-2 sr-1 nm-1"},
    "degree_north": {"degrees_north"},
    "degree_east": {"degrees_east"},
    "s": {"seconds since 1970-01-01T00:00:00Z"},
}


def opened(path: Path) -> xarray.Dataset:
    return xarray.open_dataset(path, engine="scipy")


def assert_cf(path: Path) -> None:
    """Every standard name is in the table, with a unit of its dimension."""
    lines = NAMES.read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    canonical = {row["standard_name"]: row["canonical_units"] for row in rows}
    data = xarray.open_dataset(path, engine="scipy", decode_times=False)
    assert data.attrs["Conventions"] == "CF-1.11"
    seen = 0
    for name, variable in data.variables.items():
        assert variable.attrs.get("long_name"), name
        standard = variable.attrs.get("standard_name")
        if standard is not None:
            unit = canonical[standard]
            assert variable.attrs["units"] in SAME_DIMENSION.get(unit, set()) | {unit}, name
            seen += 1
    assert seen >= 4


def test_a_film_comes_back(evening: celaje.Sky, tmp_path: Path) -> None:
    """Rationale: a file that only we can read is none. Expected: bit for bit what the film holds, with CF names."""
    film = evening.render(size=8, spp=2, seed=5)
    path = tmp_path / "sky.nc"
    film.save(path)
    data = opened(path)
    seen = film.samples > 0
    assert data.radiance.dims == ("y", "x", "wavelength")
    np.testing.assert_array_equal(data.radiance.values[seen], film.radiance[seen])
    assert np.isnan(data.radiance.values[~seen]).all()
    np.testing.assert_array_equal(data.radiance_variance.values[seen], film.variance[seen])
    np.testing.assert_array_equal(data.samples.values, film.samples)
    np.testing.assert_array_equal(data.wavelength.values, film.wavelength_nm)
    azimuth, elevation = film.directions()
    np.testing.assert_allclose(data.vza_deg.values, 90.0 - elevation, atol=1e-12)
    np.testing.assert_allclose(data.vaa_deg.values, azimuth, atol=1e-12)
    assert float(data.sza_deg) == pytest.approx(79.0, abs=0.01)
    assert data.time.values == np.datetime64("2026-06-21T18:30:00")
    assert float(data.latitude) == 41.65
    name = "downwelling_radiance_per_unit_wavelength_in_air"
    assert data.radiance.attrs["standard_name"] == name
    assert data.attrs["seed"] == "5"
    assert "satellite" in data.attrs["ozone_du_reason"]
    assert data.attrs["source"] == f"celaje {celaje.__version__}"
    assert_cf(path)


def test_a_picture_that_looks_down_has_no_wrong_name(evening: celaje.Sky, tmp_path: Path) -> None:
    film = evening.render("latlong", size=4, spp=1)
    film.save(tmp_path / "sky.nc")
    assert "standard_name" not in opened(tmp_path / "sky.nc").radiance.attrs


def test_the_air_comes_back(evening: celaje.Sky, tmp_path: Path) -> None:
    """The file of the air is what :meth:`Atmosphere.xarray` gives."""
    air = evening.atmosphere
    assert air is not None
    path = tmp_path / "air.nc"
    air.save(path)
    data, ours = opened(path), air.xarray()
    assert data.species.values.tolist() == list(air.species)
    for name, variable in ours.data_vars.items():
        assert data[name].dims == variable.dims, name
        np.testing.assert_array_equal(data[name].values, variable.values, err_msg=str(name))
        assert data[name].attrs["units"] == variable.attrs["units"], name
    assert_cf(path)

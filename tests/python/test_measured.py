"""Skies that people measured: spectra of a clear morning, luminance and illuminance down to deep twilight."""

import csv
import functools
import importlib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import celaje

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "tests" / "reference"
# The sum of these over the visible range is the luminance; finer steps change it by less than 1 %.
WAVELENGTHS = "400:700:15"


def rows(name: str) -> list[dict[str, str]]:
    with (REFERENCE / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def luminance(seen: celaje.Radiance) -> NDArray[np.float64]:
    """Luminance of directions [cd/m²]."""
    nothing = np.zeros_like(seen.radiance)[None]
    samples = np.ones(nothing.shape[:2], dtype=np.uint32)
    film = celaje.Film(seen.radiance[None], nothing, samples, seen.wavelength_nm)
    # The luminance of the sRGB primaries (IEC 61966-2-1).
    y = np.array([0.2126, 0.7152, 0.0722])
    return np.asarray(film.linear_srgb(1931)[0] @ y, dtype=np.float64)


def test_illuminance_of_sun_and_sky() -> None:
    """Within 25 % of the Explanatory Supplement's from 60° to -10°, over five powers of ten, by an average aerosol."""
    sky = celaje.sky(
        sun_elevation=30,
        sun_distance_au=1.0,
        aerosol="opac:continental_average",
        aod_550=0.15,
        albedo=0.2,
        wavelengths=WAVELENGTHS,
    ).bake((-10.5, 60.0), highest_observer_m=0.0)
    published = [
        (float(row["sun_elevation_deg"]), float(row["illuminance_lux"]))
        for row in rows("illuminance_sun.csv")
    ]
    asked = [(sun, lux) for sun, lux in published if -10 <= sun <= 60]
    assert len(asked) == 28
    for sun, lux in asked:
        ratio = sky.under(sun).irradiance(method="shells").lux / lux
        print(f"{sun:6.1f} {lux:10.4g} {ratio:.3f}")
        assert 0.75 < ratio < 1.25, f"sun {sun}: {ratio:.3f} of the published illuminance"


# Optical depths from the transmission that the authors give (75 to 85 %, 85 to 90 %), less air and ozone.
# Altitude [m], aerosol optical depth, ozone [DU], albedo.
AIR = {
    "Maryland": (30.0, 0.10, 330.0, 0.15),
    "Sacramento Peak": (2800.0, 0.035, 320.0, 0.2),
}


@functools.cache
def twilight(site: str) -> dict[tuple[float, float], tuple[float, float]]:
    """Measured and computed luminance by (sun, view elevation) [cd/m²]."""
    altitude, aod_550, ozone, albedo = AIR[site]
    sky = celaje.sky(
        sun_elevation=0,
        sun_azimuth=180,
        altitude=altitude,
        aerosol="rural",
        aod_550=aod_550,
        ozone=ozone,
        albedo=albedo,
        wavelengths=WAVELENGTHS,
    ).bake((-12.5, 5.5), highest_observer_m=altitude)
    found: dict[tuple[float, float], tuple[float, float]] = {}
    for row in rows("twilight_koomen1952.csv"):
        sun, view, turn, measured = (
            float(row[k])
            for k in (
                "sun_elevation_deg",
                "view_elevation_deg",
                "azimuth_from_sun_deg",
                "luminance_cd_m2",
            )
        )
        if row["site"] == site and sun >= -12:
            seen = sky.under(sun).radiance([180.0 + turn], [view], method="shells")
            found[sun, view] = measured, float(luminance(seen)[0])
    return found


def test_twilight_of_maryland() -> None:
    """Koomen et al. 1952: within 30 % from 5° to -12°, over nearly six powers of ten."""
    found = twilight("Maryland")
    assert len(found) == 14
    for (sun, view), (measured, computed) in found.items():
        ratio = computed / measured
        print(f"{sun:5.0f} {view:5.0f} {measured:10.4g} {ratio:.3f}")
        assert 0.7 < ratio < 1.3, f"sun {sun}, view {view}: {ratio:.3f}"


def test_twilight_of_a_mountain_lies_between_both_sites() -> None:
    """Koomen et al. 1952: theirs at 2800 m is half of what we compute, and of what they have in Maryland.

    At -12° a sixth of theirs is the night sky's, which ours does not have.
    """
    mountain, plain = twilight("Sacramento Peak"), twilight("Maryland")
    asked = {place: values for place, values in mountain.items() if place[0] >= -9}
    assert len(asked) == 4
    for (sun, view), (measured, computed) in asked.items():
        assert measured < computed < plain[sun, view][0], f"sun {sun}: {computed:.4g} cd/m²"


def test_spectra_of_a_clear_morning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kider et al. 2014: three scans that the fit has not seen, rms of the integral 5 %, of the spectra 4 mW."""
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "gallery"))
    pytest.importorskip("matplotlib")
    skies = importlib.import_module("measured_skies")
    scans = [scan for scan in skies.read_scans() if scan.time in skies.SCORED_ON]
    computed = [skies.computed(scan, skies.FITTED, 512) for scan in scans]
    for clear in (True, False):
        score = skies.score(scans, computed, clear)
        print(score)
        assert score.rms <= 0.05
        assert score.spectral_rms_mw <= 4.0

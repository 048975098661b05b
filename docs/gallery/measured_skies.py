"""Measured skies (Ithaca, 27 May 2013) beside computed ones: blind, from place and time alone, and fitted.

``--fit`` finds the fitted aerosol anew on three of the six scans (half an hour); the other three are scored.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import celaje
from common import colours, options, plt, save

SCANS = Path(__file__).resolve().parents[2] / "tests" / "reference" / "sky_kider2014.csv"
SITE, ALTITUDE_M = (42.443449, -76.481962), 325.0
FITTED_ON, SCORED_ON = ("13:45", "14:15", "14:45"), ("13:30", "14:00", "14:30")
BANDS_NM = np.arange(360.0, 721.0, 10.0)
# Every band is the mean over ±5 nm with half weights at its ends, as the measurements are.
WAVELENGTHS = "355:725:5"
# XYZ of the sRGB primaries (IEC 61966-2-1).
XYZ_OF_SRGB = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)
# What the fit varies, where it starts and how far it may go.
KNOBS = {
    "aod": (0.09, 0.03, 0.25),
    "fine_um": (0.05, 0.015, 0.2),
    "absorption": (0.02, 0.0, 0.2),
    "coarse": (3e-4, 0.0, 1e-2),
    "albedo": (0.08, 0.0, 0.4),
}
# Found by --fit.
FITTED = {"aod": 0.09, "fine_um": 0.05, "absorption": 0.02, "coarse": 3e-4, "albedo": 0.08}


@dataclass(frozen=True)
class Scan:
    """The samples of one scan of the sky that its protocol keeps.

    Attributes
    ----------
    time : str
        ``HH:MM`` [UTC].
    sun_elevation, sun_azimuth : float
        True; the azimuth in the frame of the instrument. [deg]
    azimuth, elevation : ndarray, shape (n,)
        Of the samples, in the same frame. [deg]
    radiance : ndarray, shape (n, 37)
        [W m⁻² sr⁻¹ nm⁻¹]
    suspect : ndarray of bool, shape (n,)
        Cloud or haze is suspected.
    """

    time: str
    sun_elevation: float
    sun_azimuth: float
    azimuth: NDArray[np.float64]
    elevation: NDArray[np.float64]
    radiance: NDArray[np.float64]
    suspect: NDArray[np.bool_]


def read_scans(path: Path = SCANS) -> list[Scan]:
    """The six scans, without the sample in the north (N) and those within 20° of the sun (S)."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    scans = []
    for time in sorted({row["time_utc"] for row in rows}):
        kept = [r for r in rows if r["time_utc"] == time and not set("NS") & set(r["flags"])]

        def column(name: str, kept: list[dict[str, str]] = kept) -> NDArray[np.float64]:
            return np.array([float(row[name]) for row in kept])

        scans.append(
            Scan(
                time[11:16],
                90.0 - column("sun_zenith_deg")[0],
                column("sun_azimuth_fit_deg")[0],
                column("view_azimuth_deg"),
                90.0 - column("view_zenith_deg"),
                np.stack([column(f"L_{nm:.0f}") for nm in BANDS_NM], axis=1),
                np.array(["C" in row["flags"] for row in kept]),
            )
        )
    return scans


def computed(scan: Scan, air: Mapping[str, object], spp: int) -> NDArray[np.float64]:
    """Radiance of a scan's samples in its bands under some air, shape (n, 37) [W m⁻² sr⁻¹ nm⁻¹]."""
    sky = celaje.sky(
        at=SITE,
        time=f"2013-05-27T{scan.time}Z",
        altitude=ALTITUDE_M,
        sun_elevation=scan.sun_elevation,
        sun_azimuth=scan.sun_azimuth,
        wavelengths=WAVELENGTHS,
        **air,
    )
    seen = sky.radiance(scan.azimuth, scan.elevation, method="path", spp=spp, sun_disc="off")
    fine = seen.radiance
    return 0.25 * fine[:, :-2:2] + 0.5 * fine[:, 1:-1:2] + 0.25 * fine[:, 2::2]


def fitted_air(knobs: Mapping[str, float]) -> dict[str, object]:
    """An aerosol of two modes on a low scale height, over grey ground; ozone and all else from the climate."""
    share = np.array([1.0 - knobs["coarse"], knobs["coarse"]])
    aerosol = celaje.Aerosol(
        1.45 + 1j * knobs["absorption"],
        celaje.SizeDistribution([knobs["fine_um"], 0.5], [1.8, 2.0], share, 0.005, 20.0),
        profile=1500.0,
        name="fitted",
    )
    return {"aerosol": aerosol, "aod_550": knobs["aod"], "albedo": knobs["albedo"]}


@dataclass(frozen=True)
class Score:
    """How far computed skies are from measured ones, by the protocol of ``docs/validation.md``.

    Attributes
    ----------
    spectral_rms_mw : float
        Of spectral radiance. [mW m⁻² sr⁻¹ nm⁻¹]
    bias, rms, median, p95 : float
        Of the integral from 360 to 720 nm over the measured one, less 1; the last two of its absolute value. [1]
    luminance_rms : float
        Of luminance over the measured one, less 1. [1]
    colour : float
        Mean distance in u′v′ (CIE 1976). [1]
    """

    spectral_rms_mw: float
    bias: float
    rms: float
    median: float
    p95: float
    luminance_rms: float
    colour: float


def score(scans: list[Scan], skies: list[NDArray[np.float64]], clear: bool) -> Score:
    """The score of computed `skies` of some scans; `clear` leaves out samples under suspicion of cloud."""
    kept = [~scan.suspect if clear else np.full(len(scan.suspect), True) for scan in scans]
    measured = np.concatenate([s.radiance[k] for s, k in zip(scans, kept, strict=True)])
    model = np.concatenate([s[k] for s, k in zip(skies, kept, strict=True)])
    off = np.trapezoid(model, BANDS_NM) / np.trapezoid(measured, BANDS_NM) - 1.0
    (seen, seen_uv), (true, true_uv) = photometry(model), photometry(measured)
    return Score(
        1e3 * float(np.sqrt(np.mean((model - measured) ** 2))),
        float(off.mean()),
        float(np.sqrt(np.mean(off**2))),
        float(np.median(abs(off))),
        float(np.quantile(abs(off), 0.95)),
        float(np.sqrt(np.mean((seen / true - 1.0) ** 2))),
        float(np.mean(np.hypot(*(seen_uv - true_uv).T))),
    )


def photometry(radiance: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Luminance, shape (n,) [cd/m²], and u′v′, shape (n, 2), of spectra in the bands."""
    nothing = np.zeros(len(radiance))
    _, linear, luminance = colours(
        celaje.Radiance(radiance, 0 * radiance, nothing, nothing, BANDS_NM, 1, 0)
    )
    x, y, z = XYZ_OF_SRGB @ linear.T.astype(float)
    total = x + 15.0 * y + 3.0 * z
    return luminance, np.stack([4.0 * x / total, 9.0 * y / total], axis=1)


def fit(scans: list[Scan], spp: int) -> dict[str, float]:
    """The knobs with the least squares of log radiance on some scans (`scipy`, common random numbers)."""
    from scipy.optimize import least_squares

    start, low, high = (np.array(v) for v in zip(*KNOBS.values(), strict=True))

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        air = fitted_air(dict(zip(KNOBS, x, strict=True)))
        parts = [
            np.log(computed(scan, air, spp) / scan.radiance)[~scan.suspect].ravel()
            for scan in scans
        ]
        print({k: round(float(v), 5) for k, v in zip(KNOBS, x, strict=True)},
              f"rms {np.std(np.concatenate(parts)):.4f}", file=sys.stderr)
        return np.concatenate(parts)

    found = least_squares(
        residuals, start, bounds=(low, high), x_scale=start, diff_step=0.05, loss="soft_l1",
        f_scale=0.1, max_nfev=12,
    )
    return dict(zip(KNOBS, found.x.tolist(), strict=True))

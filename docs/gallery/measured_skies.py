"""Measured skies (Ithaca, 27 May 2013) beside computed ones: blind, from place and time alone, and fitted.

``--fit`` finds the fitted aerosol anew on three of the six scans (some minutes); the other three are scored.
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
# What the fit varies: start, least, most.
KNOBS = {"aod_550": (0.1, 0.03, 0.3), "humidity": (30.0, 0.0, 85.0), "albedo": (0.06, 0.0, 0.4)}
TYPES = ("urban", "rural", "continental", "opac:urban", "opac:continental_polluted")
# Found by --fit; all else, such as ozone, is the climate's.
FITTED = {"aerosol": "urban", "aod_550": 0.101, "humidity": 25.0, "albedo": 0.083}


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


def fit(scans: list[Scan], spp: int) -> dict[str, object]:
    """The type and knobs with the least squares of relative spectral radiance on some scans."""
    from scipy.optimize import least_squares

    start, low, high = (np.array(v) for v in zip(*KNOBS.values(), strict=True))
    found = []
    for name in TYPES:

        def residuals(x: NDArray[np.float64], name: str = name) -> NDArray[np.float64]:
            # One seed for all: noise does not move with the knobs.
            air = {"aerosol": name, **dict(zip(KNOBS, x, strict=True))}
            parts = [(computed(s, air, spp) / s.radiance - 1.0)[~s.suspect] for s in scans]
            return np.concatenate(parts).ravel()

        steps = [0.05, 0.1, 0.2]
        best = least_squares(
            residuals, start, bounds=(low, high), x_scale=start, diff_step=steps, max_nfev=8
        )
        air = {"aerosol": name, **dict(zip(KNOBS, np.round(best.x, 4).tolist(), strict=True))}
        print(f"{np.sqrt(np.mean(best.fun**2)):.4f} {air}")
        found.append((best.cost, name, air))
    return min(found)[2]


def draw(scans: list[Scan], blind: list[NDArray[np.float64]], fitted: list[NDArray[np.float64]]):
    """Scans in rows: measured, blind, fitted, and how far the fitted one is off."""
    figure, axes = plt.subplots(
        len(scans),
        4,
        figsize=(7.4, 1.85 * len(scans) + 0.5),
        dpi=100,
        layout="constrained",
        subplot_kw={"projection": "polar"},
        squeeze=False,
    )
    for row, scan, blind_one, fitted_one in zip(axes, scans, blind, fitted, strict=True):
        skies = np.concatenate([scan.radiance, blind_one, fitted_one])
        nothing = np.zeros(len(skies))
        seen = celaje.Radiance(skies, 0 * skies, nothing, nothing, BANDS_NM, 1, 0)
        shown = np.split(colours(seen)[0], 3)
        off = np.trapezoid(fitted_one, BANDS_NM) / np.trapezoid(scan.radiance, BANDS_NM) - 1.0
        where = np.radians(scan.azimuth), 90.0 - scan.elevation
        for each, colour in zip(row, shown, strict=False):
            each.scatter(*where, c=np.clip(colour, 0, 1), s=60)
        drawn = row[3].scatter(*where, c=100 * off, cmap="RdBu_r", vmin=-15, vmax=15, s=60)
        for each in row:
            each.set(theta_zero_location="N", theta_direction=1, ylim=(0, 90))
            each.set_xticks([])
            each.set_yticks([])
            each.plot(
                np.radians(scan.sun_azimuth), 90.0 - scan.sun_elevation, "*", c="gold", mec="k"
            )
        row[0].set_ylabel(f"{scan.time} UTC", labelpad=12)
    for each, title in zip(axes[0], ("measured", "blind", "fitted", "fitted, off"), strict=True):
        each.set_title(title)
    figure.colorbar(drawn, ax=axes[:, 3], shrink=0.5, extend="both", label="%")
    return figure


def main() -> None:
    """Score, draw; fit before if asked to."""
    again = "--fit" in sys.argv
    if again:
        sys.argv.remove("--fit")
    given = options(__doc__)
    spp = 8 if given.quick else 1024
    scans = read_scans()
    air = fit([s for s in scans if s.time in FITTED_ON], 192) if again else FITTED
    scored = [s for s in scans if s.time in given.few(SCORED_ON)]
    skies = {
        name: [computed(s, of, spp) for s in scored]
        for name, of in (("blind", {}), ("fitted", air))
    }
    for name, sky in skies.items():
        for clear in (True, False):
            print(name, "clear samples" if clear else "all samples", score(scored, sky, clear))
    save(draw(scored, skies["blind"], skies["fitted"]), "measured_skies", given)


if __name__ == "__main__":
    main()

"""The peer scene under several suns, with and without aerosol, by sasktran2: writes peer_scene_sasktran2.csv beside it.

Scalar successive orders in spherical geometry with exact single scattering; the air of peer_scene_air_density.csv,
linear between its nodes, Henyey-Greenstein aerosol, a collimated sun, no refraction.

    pip install sasktran2 && python make_peer_sky.py
"""

import csv
from importlib.metadata import version
from pathlib import Path

import numpy as np
import sasktran2 as sk

HERE = Path(__file__).parent
WAVELENGTH_NM = np.array([430.0, 630.0])
RADIUS_M, ALBEDO, DEPOLARISATION = 6_371_000.0, 0.1, 0.0279
TAU_AEROSOL, SSA, G, MOMENTS = 0.15, 0.95, 0.70, 128
SUNS_DEG = [30.0, 60.0, 75.0, 83.0, 87.0]
POINTS, SUN_NODES = 110, 9
VIEWS = [(0.0, 0.0)] + [
    (z, a)
    for z in (15.0, 30.0, 45.0, 60.0, 75.0, 82.0, 86.0, 89.0)
    for a in (0.0, 45.0, 90.0, 135.0, 180.0)
]


def air():
    """Altitudes [m] and scattering of air [m-1], shape (altitude, wavelength)."""
    lines = (HERE / "peer_scene_air_density.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))[1:]
    z, n = np.array([[1e3 * float(r[0]), float(r[3])] for r in rows]).T
    l2 = (WAVELENGTH_NM * 1e-3) ** 2
    sigma = (
        1e-32
        * (1.0455996 - 341.29061 / l2 - 0.90230850 * l2)
        / (1 + 0.0027059889 / l2 - 85.968563 * l2)
    )
    return z, n[:, None] * sigma


def aerosol(z):
    """Its extinction [m-1], shape (altitude, wavelength)."""
    shape = np.where(z < 30e3, np.exp(-z / 1500.0), 0.0)
    tau = TAU_AEROSOL * (WAVELENGTH_NM / 550.0) ** -1.3
    return shape[:, None] * tau / np.trapezoid(shape, z)


def radiance(sun_zenith_deg, with_aerosol):
    """Radiance per unit irradiance, shape (wavelength, view) [sr-1]."""
    z, scattering = air()
    extinction = scattering.copy()
    moments = np.zeros((MOMENTS, len(z), len(WAVELENGTH_NM)))
    moments[0], moments[2] = scattering, scattering * (1 - DEPOLARISATION) / (2 + DEPOLARISATION)
    if with_aerosol:
        e = aerosol(z)
        extinction += e
        scattering = scattering + SSA * e
        k = np.arange(MOMENTS)[:, None, None]
        moments += SSA * e * (2 * k + 1) * G**k
    moments /= scattering
    config = sk.Config()
    config.num_stokes = 1
    config.num_streams = 16
    config.num_singlescatter_moments = MOMENTS
    config.multiple_scatter_source = sk.MultipleScatterSource.SuccessiveOrders
    config.single_scatter_source = sk.SingleScatterSource.Exact
    config.num_successive_orders_iterations = 30
    config.num_successive_orders_incoming = POINTS
    config.num_successive_orders_outgoing = POINTS
    config.num_sza = SUN_NODES
    config.num_threads = 2
    mu0 = float(np.cos(np.radians(sun_zenith_deg)))
    geometry = sk.Geometry1D(
        mu0, 0.0, RADIUS_M, z, sk.InterpolationMethod.LinearInterpolation, sk.GeometryType.Spherical
    )
    viewing = sk.ViewingGeometry()
    for zenith, azimuth in VIEWS:
        # Their cosine of a viewing zenith is positive for looking down.
        viewing.add_ray(
            sk.SolarAnglesObserverLocation(
                mu0, np.radians(azimuth), float(np.cos(np.radians(zenith))), 0.0
            )
        )
    a = sk.Atmosphere(geometry, config, wavelengths_nm=WAVELENGTH_NM, calculate_derivatives=False)
    a["matter"] = sk.constituent.Manual(extinction, scattering / extinction, moments)
    a["ground"] = sk.constituent.LambertianSurface(ALBEDO)
    return np.asarray(
        sk.Engine(config, geometry, viewing).calculate_radiance(a)["radiance"].values
    )[..., 0]


def main():
    lines = []
    for scene, with_aerosol in (("air", False), ("aerosol", True)):
        for sun in SUNS_DEG:
            values = radiance(sun, with_aerosol)
            for nm, row in zip(WAVELENGTH_NM, values, strict=True):
                for (zenith, azimuth), value in zip(VIEWS, row, strict=True):
                    lines.append(f"{scene},{sun:g},{nm:g},{zenith:g},{azimuth:g},{value:.7e}")
            print(scene, sun)
    header = f"""\
# Sky of the peer scene (peer_scene_rayleigh_sun60.csv) under other suns, and with aerosol, seen from the ground; scalar
# light, all orders. Source: computed by make_peer_sky.py with sasktran2 {version("sasktran2")}, successive orders of
# {POINTS} directions at {SUN_NODES} sun angles.
# Aerosol: optical depth {TAU_AEROSOL} (nm/550)^-1.3, scale height 1.5 km, nothing from 30 km on, single-scattering
# albedo {SSA}, Henyey-Greenstein g {G}.
# radiance_per_sr: per unit of normal irradiance above the air. Azimuth 0 is the sun's.
scene,sun_zenith_deg,wavelength_nm,view_zenith_deg,relative_azimuth_deg,radiance_per_sr
"""
    (HERE / "peer_scene_sasktran2.csv").write_text(header + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

"""The peer scene by sasktran2, 81 wavelengths: prints one JSON object per choice of method, for ``benches/peers.rs``.

Spherical shells, scalar light, exact single scattering, one thread, no derivatives; everything that is not named here
is sasktran2's default. Seconds are of the processor, from the coefficients to the radiances, the shortest of some runs.

    python benches/sasktran2_peer.py
"""

import json
import time
from importlib.metadata import version

import numpy as np
import sasktran2 as sk

from peer_scene import (
    ALBEDO,
    DEPOLARISATION,
    RADIUS_M,
    SUN_ZENITH_DEG,
    cross_section_m2,
    density,
    views,
)

WAVELENGTH_NM = np.arange(380.0, 781.0, 5.0)
# Every tenth is in the published table.
STRIDE, MOMENTS, RUNS = 10, 16, 2
ORDERS = sk.MultipleScatterSource.SuccessiveOrders
DISCRETE = sk.MultipleScatterSource.DiscreteOrdinates


def fine_levels() -> np.ndarray:
    """Levels 250 m apart where the air is dense, as the horizon wants them [m]."""
    parts = [np.arange(0.0, 20e3, 250.0), np.arange(20e3, 40e3, 500.0), np.arange(40e3, 101e3, 2e3)]
    return np.concatenate(parts)


def radiance(source: sk.MultipleScatterSource, levels_m: np.ndarray) -> tuple[float, np.ndarray]:
    """Processor seconds and radiance [sr-1], shape (wavelength, direction)."""
    air = np.interp(levels_m, *density())
    scattering = air[:, None] * cross_section_m2(WAVELENGTH_NM)
    moments = np.zeros((MOMENTS, *scattering.shape))
    moments[0], moments[2] = 1.0, (1 - DEPOLARISATION) / (2 + DEPOLARISATION)
    start = time.process_time()
    config = sk.Config()
    config.num_threads = 1
    config.num_singlescatter_moments = MOMENTS
    config.multiple_scatter_source = source
    config.single_scatter_source = sk.SingleScatterSource.Exact
    mu0 = float(np.cos(np.radians(SUN_ZENITH_DEG)))
    linear = sk.InterpolationMethod.LinearInterpolation
    spherical = sk.GeometryType.Spherical
    geometry = sk.Geometry1D(mu0, 0.0, RADIUS_M, levels_m, linear, spherical)
    viewing = sk.ViewingGeometry()
    for zenith, azimuth in np.radians(views()):
        ray = sk.SolarAnglesObserverLocation(mu0, float(azimuth), float(np.cos(zenith)), 0.0)
        viewing.add_ray(ray)
    scene = sk.Atmosphere(
        geometry, config, wavelengths_nm=WAVELENGTH_NM, calculate_derivatives=False
    )
    scene["air"] = sk.constituent.Manual(scattering, np.ones_like(scattering), moments)
    scene["ground"] = sk.constituent.LambertianSurface(ALBEDO)
    found = sk.Engine(config, geometry, viewing).calculate_radiance(scene)["radiance"].values
    return time.process_time() - start, np.asarray(found)[..., 0]


def main() -> None:
    """Computes and prints."""
    kilometres, _ = density()
    for name, source, levels_m in (
        ("discrete ordinates, levels of 1 km", DISCRETE, kilometres),
        ("successive orders, levels of 1 km", ORDERS, kilometres),
        ("successive orders, levels of 250 m", ORDERS, fine_levels()),
    ):
        runs = [radiance(source, levels_m) for _ in range(RUNS)]
        report = {
            "label": f"sasktran2 {version('sasktran2')}, {name}",
            "seconds": min(s for s, _ in runs),
            "radiance": [runs[0][1][::STRIDE].tolist()],
        }
        print(json.dumps(report), flush=True)


if __name__ == "__main__":
    main()

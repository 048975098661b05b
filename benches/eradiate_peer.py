"""The peer scene by Eradiate: prints one JSON object per integrator, for ``benches/peers.rs``.

Spherical shells, double precision, one wavelength at a time, one thread; layers of 100 m with the scattering
coefficient of their middle. All goes through Eradiate's own experiment, and nothing is downloaded: the coefficients are
given as arrays, a database of absorption that holds no files stands in for the one that would be fetched, and air with
depolarisation is the blend of Eradiate's Rayleigh and isotropic phase functions that equals it.

Seconds are of the processor, for one repetition, without what a repetition of one path costs. Every repetition has a
seed of its own.

    python benches/eradiate_peer.py [paths per pixel] [repetitions]
"""

import json
import sys
import time
from importlib.metadata import version

import drjit
import eradiate
import numpy as np
import pandas as pd
import xarray as xr
from axsdb import MonoAbsorptionDatabase

from peer_scene import (
    ALBEDO,
    DEPOLARISATION,
    NM,
    RADIUS_M,
    SUN_ZENITH_DEG,
    cross_section_m2,
    density,
    views,
)

eradiate.set_mode("mono_double")
eradiate.config.settings.progress = 0
drjit.set_thread_count(1)

from eradiate import unit_registry as ureg  # noqa: E402
from eradiate.experiments import AtmosphereExperiment  # noqa: E402
from eradiate.radprops import ArrayRadProfile, ZGrid  # noqa: E402
from eradiate.rng import SeedState  # noqa: E402
from eradiate.scenes.atmosphere import MolecularAtmosphere  # noqa: E402

# The integrator that it takes by itself for spherical shells; its newest, with twenty majorants instead of one, which
# cost least here of what was tried (one, twenty, a hundred; with and without its detector sampling).
INTEGRATORS = {"volpath": (1, 1, 1), "eovolpath": (20, 1, 1)}


def no_absorption() -> MonoAbsorptionDatabase:
    """Without files: asked for its wavelengths alone."""
    index = {"filename": ["none"], "wl_min [nm]": [300.0], "wl_max [nm]": [900.0]}
    index |= {"wn_min [cm^-1]": [1e7 / 900.0], "wn_max [cm^-1]": [1e7 / 300.0]}
    names = ["filename", "wavelength [nm]"]
    covered = pd.MultiIndex.from_tuples([("none", nm) for nm in NM], names=names)
    return MonoAbsorptionDatabase(
        dir_path=".",
        index=pd.DataFrame(index),
        spectral_coverage=pd.DataFrame({}, index=covered),
    )


def experiment(integrator: str, majorants: tuple[int, int, int]) -> AtmosphereExperiment:
    """The scene, ready to be rendered."""
    altitude_m, number_density = density()
    top_m = float(altitude_m[-1])
    geometry = {
        "type": "spherical_shell",
        "planet_radius": RADIUS_M * ureg.m,
        "ground_altitude": 0.0 * ureg.m,
        "toa_altitude": top_m * ureg.m,
        "zgrid": ZGrid(np.arange(0.0, top_m + 1.0, 100.0) * ureg.m),
    }
    scattering = xr.DataArray(
        cross_section_m2(NM)[:, None] * number_density,
        dims=("w", "z"),
        coords={"w": ("w", NM, {"units": "nm"}), "z": ("z", altitude_m, {"units": "m"})},
        attrs={"units": "m^-1"},
    )
    # 3 (1 + 3 γ + (1 - γ) cos²) / (4 (1 + 2 γ)) is a Rayleigh phase function without depolarisation and a constant.
    gamma = DEPOLARISATION / (2.0 - DEPOLARISATION)
    share = (1.0 - gamma) / (1.0 + 2.0 * gamma)
    atmosphere = MolecularAtmosphere(
        thermoprops=None,
        radprops_profile=ArrayRadProfile(
            sigma_s=scattering, has_absorption=False, interpolation_method="linear"
        ),
        absorption_data=no_absorption(),
        has_absorption=False,
        extremum_resolution=majorants,
        geometry=geometry,
        phase={
            "type": "blend_phase",
            "components": [{"type": "rayleigh"}, {"type": "isotropic"}],
            "weights": [share, 1.0 - share],
            "geometry": geometry,
        },
    )
    zenith, azimuth = np.radians(views()).T
    flat = np.sin(zenith)
    directions = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(zenith)], axis=1)
    # A metre above the ground, lest rays start on its surface.
    origins = np.tile([0.0, 0.0, RADIUS_M + 1.0], (len(directions), 1))
    return AtmosphereExperiment(
        geometry=geometry,
        atmosphere=atmosphere,
        surface={"type": "lambertian", "reflectance": {"type": "uniform", "value": ALBEDO}},
        illumination={
            "type": "directional",
            "zenith": SUN_ZENITH_DEG * ureg.deg,
            "azimuth": 0.0 * ureg.deg,
            "azimuth_convention": "east_right",
            "irradiance": {"type": "uniform", "value": 1.0},
        },
        measures=[
            {
                "type": "mradiancemeter",
                "origins": origins * ureg.m,
                "directions": directions,
                "spp": 1,
                "srf": {"type": "delta", "wavelengths": NM * ureg.nm},
            }
        ],
        integrator={"type": integrator},
    )


def render(scene: AtmosphereExperiment, spp: int, seed: int) -> tuple[float, np.ndarray]:
    """Processor seconds and radiance [sr-1], shape (wavelength, direction)."""
    scene.clear()
    start = time.process_time()
    scene.process(spp=spp, seed_state=SeedState(seed))
    seconds = time.process_time() - start
    results = sorted(scene.measures[0].mi_results.items())
    return seconds, np.array([np.array(found["bitmap"]).squeeze() for _, found in results])


def main() -> None:
    """Renders and prints."""
    given = [int(a) for a in sys.argv[1:]]
    spp, repetitions = given if given else (2000, 16)
    for integrator, majorants in INTEGRATORS.items():
        scene = experiment(integrator, majorants)
        scene.init()
        setup_s, _ = render(scene, 1, 0)
        runs = [render(scene, spp, seed) for seed in range(1, repetitions + 1)]
        radiance = np.array([r for _, r in runs])
        seconds = float(np.mean([s for s, _ in runs])) - setup_s
        report = {
            "label": f"Eradiate {version('eradiate')}, {integrator}",
            "seconds": seconds,
            "radiance": radiance.tolist(),
        }
        print(json.dumps(report), flush=True)


if __name__ == "__main__":
    main()

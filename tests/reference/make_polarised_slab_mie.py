"""Polarised light of a slab of air and small spheres, by sasktran2: writes polarised_slab_mie.csv beside this file.

A flat, homogeneous slab of Rayleigh air without depolarisation and log-normal spheres over a Lambertian ground, at two
wavelengths. Vector discrete ordinates (I, Q, U; circular polarisation is neglected) with exact single scattering; the
matrices of the spheres are sasktran2's own.

    pip install sasktran2 && python make_polarised_slab_mie.py
"""

from importlib.metadata import version
from pathlib import Path

import numpy as np
import sasktran2 as sk
from sasktran2.mie.distribution import integrate_mie_cpp
from scipy.stats import lognorm

WAVELENGTH_NM = np.array([450.0, 700.0])
TAU_AIR, TAU_SPHERES, ALBEDO = 0.15, 0.35, 0.2
MODE_RADIUS_NM, SIGMA, INDEX = 150.0, 1.5, 1.45 - 0.005j
STREAMS, MOMENTS = 40, 120
# Of the planet: the slab, 1 km thick, is flat on it.
RADIUS_M, LEVELS = 1e9, 101
MU0 = [0.3, 0.8]
MU = [0.1, 0.3, 0.6, 0.9]
PHI_DEG = [0.0, 30.0, 90.0, 150.0, 180.0]
# Greek coefficients of Rayleigh scattering, degrees 0 to 2.
RAYLEIGH = {"a1": [1, 0, 0.5], "a2": [0, 0, 3], "a3": [0, 0, 0], "b1": [0, 0, np.sqrt(1.5)]}


def atmosphere(config, geometry, optics):
    """Air and spheres, mixed in proportion to what they scatter."""
    a = sk.Atmosphere(geometry, config, wavelengths_nm=WAVELENGTH_NM, calculate_derivatives=False)
    albedo = np.asarray(optics["xs_scattering"] / optics["xs_total"]).reshape(-1)
    share = TAU_SPHERES * albedo
    levels, wavelengths = LEVELS, len(WAVELENGTH_NM)
    # Coefficients of one degree lie side by side: a1, a2, a3, b1.
    moments = np.zeros((4 * MOMENTS, levels, wavelengths))
    for k, (name, rayleigh) in enumerate(RAYLEIGH.items()):
        air = np.zeros((MOMENTS, 1))
        air[:3, 0] = rayleigh
        spheres = np.asarray(optics[f"lm_{name}"]).reshape(wavelengths, -1).T
        mixed = (TAU_AIR * air + share * spheres) / (TAU_AIR + share)
        moments[k::4] = mixed[:, None, :]
    ssa = (TAU_AIR + share) / (TAU_AIR + TAU_SPHERES)
    extinction = np.full((levels, wavelengths), (TAU_AIR + TAU_SPHERES) / 1000.0)
    a["slab"] = sk.constituent.Manual(extinction, extinction * 0.0 + ssa, moments)
    a["ground"] = sk.constituent.LambertianSurface(ALBEDO)
    return a


def radiance(mu0, streams, optics):
    """I, Q, U, shape (wavelength, ray, 3), and (up, mu, phi) of the rays."""
    config = sk.Config()
    config.num_stokes = 3
    config.num_streams = streams
    config.num_singlescatter_moments = MOMENTS
    config.multiple_scatter_source = sk.MultipleScatterSource.DiscreteOrdinates
    config.single_scatter_source = sk.SingleScatterSource.Exact
    geometry = sk.Geometry1D(
        mu0,
        0.0,
        RADIUS_M,
        np.linspace(0.0, 1000.0, LEVELS),
        sk.InterpolationMethod.LinearInterpolation,
        sk.GeometryType.Spherical,
    )
    viewing = sk.ViewingGeometry()
    rays = [(up, mu, phi) for up in (False, True) for mu in MU for phi in PHI_DEG]
    for up, mu, phi in rays:
        zenith, altitude = (-mu, 2000.0) if up else (mu, 0.0)
        ray = sk.SolarAnglesObserverLocation(mu0, np.radians(phi), zenith, altitude)
        viewing.add_ray(ray)
    engine = sk.Engine(config, geometry, viewing)
    return engine.calculate_radiance(atmosphere(config, geometry, optics))["radiance"].values, rays


def main():
    optics = integrate_mie_cpp(
        [lognorm(np.log(SIGMA), scale=MODE_RADIUS_NM)],
        lambda _: INDEX,
        WAVELENGTH_NM,
        num_quad=1000,
        maxintquantile=1 - 1e-9,
        num_coeffs=MOMENTS,
    )
    lines, coarse_rms = [], 0.0
    for mu0 in MU0:
        values, rays = radiance(mu0, STREAMS, optics)
        coarse, _ = radiance(mu0, STREAMS // 2, optics)
        coarse_rms = max(coarse_rms, np.abs((coarse - values) / values[..., :1]).max())
        for w, nm in enumerate(WAVELENGTH_NM):
            for r, (up, mu, phi) in enumerate(rays):
                i, q, u = values[w, r]
                lines.append(
                    f"{'UP' if up else 'DN'},{nm:.0f},{mu0},{mu},{phi:.0f},{i:.8e},{SIGN_Q * q:.8e},{SIGN_U * u:.8e}"
                )
    print("largest change from", STREAMS // 2, "to", STREAMS, "streams, of I:", coarse_rms)
    ssa = np.asarray(optics["xs_scattering"] / optics["xs_total"]).reshape(-1)
    header = f"""\
# Polarised light of a plane-parallel, homogeneous slab of air and small spheres over a Lambertian ground.
# Source: computed by make_polarised_slab_mie.py with sasktran2 {version("sasktran2")}, vector discrete ordinates
# of {STREAMS} streams with exact single scattering (half as many change no value by more than {coarse_rms:.1e} of I);
# circular polarisation neglected.
# Air: optical thickness {TAU_AIR}, no depolarisation. Albedo of the ground {ALBEDO}.
# Spheres: {TAU_SPHERES}, log-normal, mode radius {MODE_RADIUS_NM / 1000} um, sigma {SIGMA}, index 1.45 + 0.005i,
# single-scattering albedo {ssa[0]:.5f} and {ssa[1]:.5f}.
# Units: L / E0 [sr-1], E0 the irradiance of the unpolarised beam on a plane normal to it; diffuse light only.
# dir UP: leaving the top; DN: arriving at the ground. mu, mu0: cosines of the zenith angles, both positive.
# phi_deg: azimuth between the directions in which light and beam travel; 0 is forward; anticlockwise.
# Signs: Q = |E_theta|^2 - |E_phi|^2, U = 2 E_theta E_phi, azimuth of phi anticlockwise.
dir,wavelength_nm,mu0,mu,phi_deg,I,Q,U
"""
    Path(__file__).with_name("polarised_slab_mie.csv").write_text(header + "\n".join(lines) + "\n")


# sasktran2's signs, found by comparing a Rayleigh slab with the tables of Natraj et al. 2009, to ours.
SIGN_Q, SIGN_U = 1.0, -1.0

if __name__ == "__main__":
    main()

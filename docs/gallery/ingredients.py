"""What a sky is made of: phase functions, ozone, sunlight."""

import numpy as np

import celaje
from common import options, plt, save

WAVELENGTH_NM = 700.0

given = options(__doc__)
figure = plt.figure(figsize=(7.6, 7.0), dpi=100, layout="constrained")
above, below = figure.subfigures(2, 1)

# A molecule of 0.0001 µm and a water sphere of 10 µm, by the same theory.
theta_deg = np.linspace(0.0, 180.0, 200 if given.quick else 2001)
water = 1.331 + 3.35e-8j  # at 700 nm: Hale & Querry 1973, doi:10.1364/AO.12.000555
for place, radius_um, name in ((1, 1e-4, "radius 0.0001 µm"), (2, 10.0, "radius 10 µm, water")):
    x = 2 * np.pi * radius_um * 1000 / WAVELENGTH_NM
    sphere = celaje.mie(refractive_index=water, size_parameter=x)
    intensity = np.abs(sphere.s1(theta_deg)) ** 2 + np.abs(sphere.s2(theta_deg)) ** 2
    # |S1|² + |S2|² over 2π x² Q_sca is a density over the sphere.
    phase = intensity / (2 * np.pi * x**2 * sphere.q_sca)
    axes = above.add_subplot(1, 2, place, projection="polar")
    drawn = phase if radius_um < 0.01 else np.log10(phase / phase.min())
    for sign in (1, -1):
        axes.plot(sign * np.radians(theta_deg), drawn, color="C0", linewidth=0.8)
    axes.set_yticklabels([])
    axes.set_title(f"{name}, {WAVELENGTH_NM:g} nm" + (", logarithmic" if place == 2 else ""))

grid = "400:700:50" if given.quick else "300:800:1"
sky = celaje.sky(sun_elevation=30, wavelengths=grid)
air = sky.atmosphere
ozone = air.species["ozone"]
densest = int(np.argmax(ozone.number_density))
axes = below.add_subplot(1, 3, 1)
cross_section_m2 = ozone.sigma_a[densest] / ozone.number_density[densest]
axes.semilogy(sky.wavelength_nm, 1e4 * cross_section_m2, color="C2")
axes.set_xlabel("wavelength [nm]")
axes.set_ylabel("ozone's cross section [cm²]")
axes.set_title(f"at {air.temperature_k[densest]:.0f} K")

axes = below.add_subplot(1, 3, 2)
axes.plot(1e-6 * ozone.number_density, 1e-3 * air.altitude_m, color="C2")
axes.set_xlabel("ozone [molecules/cm³]")
axes.set_ylabel("altitude [km]")
axes.set_ylim(0, 60)
axes.set_title("where it is")

axes = below.add_subplot(1, 3, 3)
axes.plot(sky.wavelength_nm, sky.sun_irradiance, color="C1", linewidth=0.8)
axes.set_ylim(0, None)
axes.set_xlabel("wavelength [nm]")
axes.set_ylabel("irradiance [W m⁻² nm⁻¹]")
axes.set_title("sunlight above the air")
save(figure, "ingredients", given)

"""A dusk as one picture: the meridian of the sun, moment after moment."""

import numpy as np

from common import colours, options, plt, save, skies

FIRST, LAST, TOWARDS_SUN = 10.0, -18.0, 270.0

given = options(__doc__)
moments, points = (12, 9) if given.quick else (560, 181)
sun_elevation = np.linspace(FIRST, LAST, moments)
# From the horizon under the sun over the zenith to the horizon opposite it.
along = np.linspace(0.5, 179.5, points)
azimuth = np.where(along <= 90, TOWARDS_SUN, TOWARDS_SUN - 180)
elevation = np.where(along <= 90, along, 180 - along)
sky, _ = skies([FIRST, LAST], given, TOWARDS_SUN, aerosol="opac:continental_average")

columns, zenith = [], []
for moment in sun_elevation:
    seen = sky.under(moment, TOWARDS_SUN).radiance(azimuth, elevation, sun_disc="off")
    shown, _, luminance = colours(seen)
    columns.append(shown)
    zenith.append(luminance[points // 2])

figure, (picture, curve) = plt.subplots(
    2, 1, figsize=(7.2, 4.2), dpi=100, sharex=True, height_ratios=(3, 1), layout="constrained"
)
extent = (FIRST, LAST, 0, 180)
picture.imshow(np.stack(columns, axis=1), extent=extent, origin="lower", aspect="auto")
picture.set_yticks([0, 45, 90, 135, 180], ["sunset", "45°", "zenith", "45°", "opposite"])
picture.set_title("the meridian of the sun, each moment exposed by itself")
curve.semilogy(sun_elevation, zenith, color="black")
curve.set_ylabel("zenith [cd/m²]")
curve.set_xlabel("elevation of the sun [deg]")
curve.set_xlim(FIRST, LAST)
save(figure, "dusk_film", given)

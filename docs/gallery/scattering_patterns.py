"""Radiance at single wavelengths in false colours, from a high sun to a sun below the horizon."""

import numpy as np

from common import options, plt, save, skies

SUNS = (25.0, 5.0, 0.0, -0.5, -2.5, -5.0)
WAVELENGTHS = (420.0, 480.0, 550.0, 620.0, 700.0)

given = options(__doc__)
suns = given.few(SUNS)
size = given.size(128)
figure, axes = plt.subplots(
    len(suns),
    len(WAVELENGTHS),
    figsize=(1.42 * len(WAVELENGTHS) + 0.6, 1.42 * len(suns) + 0.3),
    dpi=100,
    layout="constrained",
)
under = skies(suns, given, 250, aerosol="opac:continental_average", wavelengths=WAVELENGTHS)
for row, sun_elevation, sky in zip(axes, suns, under, strict=True):
    film = sky.render("fisheye", size=size, sun_disc="off")
    seen = film.samples > 0
    for k, (each, wavelength) in enumerate(zip(row, WAVELENGTHS, strict=True)):
        radiance = np.where(seen, film.radiance[..., k], np.nan)
        # Patterns, not amounts: each map is relative to its own mean.
        relative = np.log10(radiance / np.nanmean(radiance))
        drawn = each.imshow(relative, cmap="turbo", vmin=-1, vmax=1)
        each.set_xticks([])
        each.set_yticks([])
        for spine in each.spines.values():
            spine.set_visible(False)
        if row is axes[0]:
            each.set_title(f"{wavelength:g} nm")
        if k == 0:
            each.set_ylabel(f"sun at {sun_elevation:g}°")
bar = figure.colorbar(drawn, ax=axes, shrink=0.5, ticks=[-1, -0.5, 0, 0.5, 1], extend="both")
bar.ax.set_yticklabels(["0.1", "0.3", "1", "3", "10"])
bar.set_label("radiance over its mean")
save(figure, "scattering_patterns", given)

"""The same sky by both methods, and the difference between them."""

import numpy as np

import celaje
from common import options, plt, rgba, save

SUNS = (40.0, 3.0)

given = options(__doc__)
size = given.size(64)
figure, axes = plt.subplots(2, 3, figsize=(7.2, 4.9), dpi=100, layout="constrained")
for row, sun_elevation in zip(axes, SUNS, strict=True):
    sky = celaje.sky(
        sun_elevation=sun_elevation,
        sun_azimuth=250,
        aerosol="opac:continental_average",
        wavelengths="400:700:50" if given.quick else "400:700:20",
    )
    shells = sky.render(size=size, sun_disc="off")
    path = sky.render(size=size, sun_disc="off", spp=4 if given.quick else 4096, seed=1)
    for each, film, name in zip(row, (shells, path), ("shells", "path"), strict=False):
        each.imshow(rgba(film))
        each.set_title(f"{name}, sun at {sun_elevation:g}°")
    # Away from the rim, whose pixels are seen in part, and from the sun, where `shells` looks at the middle of a pixel
    # and `path` all over it.
    column, row_number = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    lit = np.hypot(column - size / 2, row_number - size / 2) < size / 2 - 1.0
    lit &= path.radiance.sum(axis=2) < 0.2 * path.radiance.sum(axis=2)[lit].max()
    ratio = np.full(lit.shape, np.nan)
    ratio[lit] = shells.radiance[lit].sum(axis=1) / path.radiance[lit].sum(axis=1) - 1
    drawn = row[2].imshow(100 * ratio, cmap="RdBu_r", vmin=-3, vmax=3)
    rms = 100 * np.sqrt(np.nanmean(ratio**2))
    row[2].set_title(f"shells over path less 1, rms {rms:.2f} %")
    for each in row:
        each.axis("off")
bar = figure.colorbar(drawn, ax=axes, shrink=0.6, extend="both")
bar.set_label("%")
save(figure, "shells_and_path", given)

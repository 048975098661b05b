"""Up the meridian opposite the sun: the dark segment, the pink belt, the blue above; under two suns."""

import numpy as np

from common import colours, options, plt, save, skies

SUN_ELEVATION, TOWARDS_SUN, AWAY = (-1.5, -2.5), 270.0, 90.0

given = options(__doc__)
elevation_deg = np.linspace(0.25, 30.0, 12 if given.quick else 180)

figure, rows = plt.subplots(
    2, 3, figsize=(7.2, 6.0), dpi=100, sharey=True, width_ratios=(1, 4, 4), layout="tight"
)
for row, sky in zip(rows, skies(SUN_ELEVATION, given, TOWARDS_SUN, aerosol="rural"), strict=True):
    shown, curve, shares = row
    strip, rgb, luminance = colours(sky.radiance(AWAY, elevation_deg, method="shells"))
    shown.imshow(
        strip[::-1, None, :], extent=(0, 1, elevation_deg[0], elevation_deg[-1]), aspect="auto"
    )
    shown.set_xticks([])
    shown.set_ylabel("elevation [deg]")
    curve.plot(luminance, elevation_deg, color="black")
    share = rgb / rgb.sum(axis=1, keepdims=True)
    for channel, name in enumerate(("red", "green", "blue")):
        shares.plot(share[:, channel], elevation_deg, color=name, label=name)
    shares.axvline(1 / 3, color="grey", linewidth=0.6)
for (shown, curve, shares), sun_deg in zip(rows, SUN_ELEVATION, strict=True):
    shown.set_title(f"sun at {sun_deg}°".replace("-", "−"))
    curve.set_xlabel("luminance [cd/m²]")
    shares.set_xlabel("share of linear sRGB")
rows[0][2].legend(frameon=False)
rows[0][1].set_title("the shadow is dark")
rows[0][2].set_title("the belt is pink: less green than red")
rows[1][2].set_title("later it is a paler blue")
save(figure, "belt_of_venus", given)

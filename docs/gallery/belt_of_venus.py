"""Up the meridian opposite the sun: the dark segment, the paler and redder belt, the blue above."""

import numpy as np

from common import colours, options, plt, save, skies

SUN_ELEVATION, TOWARDS_SUN, AWAY = -2.5, 270.0, 90.0

given = options(__doc__)
elevation_deg = np.linspace(0.25, 45.0, 12 if given.quick else 180)
(sky,) = skies([SUN_ELEVATION], given, TOWARDS_SUN, aerosol="opac:continental_clean")
seen = sky.radiance(AWAY, elevation_deg, method="shells")
strip, rgb, luminance = colours(seen)

figure, (shown, curve, shares) = plt.subplots(
    1, 3, figsize=(7.2, 3.6), dpi=100, sharey=True, width_ratios=(1, 4, 4), layout="tight"
)
shown.imshow(
    strip[::-1, None, :], extent=(0, 1, elevation_deg[0], elevation_deg[-1]), aspect="auto"
)
shown.set_xticks([])
shown.set_ylabel("elevation [deg]")
shown.set_title("as seen")
curve.plot(luminance, elevation_deg, color="black")
curve.set_xlabel("luminance [cd/m²]")
curve.set_title("the shadow is dark")
share = rgb / rgb.sum(axis=1, keepdims=True)
for channel, name in enumerate(("red", "green", "blue")):
    shares.plot(share[:, channel], elevation_deg, color=name, label=name)
shares.axvline(1 / 3, color="grey", linewidth=0.6)
shares.set_xlabel("share of linear sRGB")
shares.set_title("the belt is a paler blue")
shares.legend(frameon=False)
save(figure, "belt_of_venus", given)

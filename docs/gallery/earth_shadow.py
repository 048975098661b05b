"""Earth's shadow rises opposite the sun, with the Belt of Venus above it."""

from common import options, plt, rgba, save, skies

SUNS = (-0.5, -2.5, -5.0)
TOWARDS_SUN, AWAY = 270.0, 90.0

given = options(__doc__)
suns = given.few(SUNS)
size = given.size(220)
figure, axes = plt.subplots(
    len(suns), 2, figsize=(6.9, 2.28 * len(suns)), dpi=100, width_ratios=(1, 2), layout="tight"
)
under = skies(suns, given, TOWARDS_SUN, aerosol="opac:continental_clean")
for (left, right), sun_elevation, sky in zip(axes, suns, under, strict=True):
    left.imshow(rgba(sky.render("fisheye", size=size)))
    # The horizon opposite the sun through a wide lens: it lies a tenth above the lower edge.
    wide = sky.render("perspective", size=(2 * size, size), fov=100, look=(AWAY, 24))
    right.imshow(rgba(wide))
    left.set_title(f"sun at {sun_elevation:g}°, in the west")
    right.set_title("the east")
    for each in (left, right):
        each.axis("off")
save(figure, "earth_shadow", given)

"""Rural aerosol under a sun at 5 and 15 degrees."""

from common import options, plt, rgba, save, skies

SUNS = (15.0, 5.0)

given = options(__doc__)
size = given.size(220)
figure, axes = plt.subplots(2, 2, figsize=(6.9, 4.56), dpi=100, width_ratios=(1, 2), layout="tight")
under = skies(SUNS, given, 270, aerosol="rural")
for (left, right), sun_elevation, sky in zip(axes, SUNS, under, strict=True):
    left.imshow(rgba(sky.render("fisheye", size=size)))
    right.imshow(rgba(sky.render("perspective", size=(2 * size, size), fov=100, look=(270, 24))))
    left.set_title(f"sun at {sun_elevation:g}°")
    right.set_title("towards the sun")
    for each in (left, right):
        each.axis("off")
save(figure, "rural", given)

"""What ozone does to the colours of dusk."""

from common import exposed_alike, options, picture_grid, save, skies

SUNS = (3.0, -1.0, -3.0, -5.0)

given = options(__doc__)
suns = given.few(SUNS)
films = [
    [
        sky.render("fisheye", size=given.size(170))
        for sky in skies(suns, given, 270, aerosol="opac:continental_clean", no_ozone=no_ozone)
    ]
    for no_ozone in (False, True)
]
columns = [exposed_alike(pair) for pair in zip(*films, strict=True)]
rows = list(zip(*columns, strict=True))
names = [f"sun at {s:g}°" for s in suns]
save(picture_grid(rows, names, ["with ozone", "without"], inches=1.7), "ozone_at_dusk", given)

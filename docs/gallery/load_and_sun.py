"""Little and much aerosol of three kinds under three suns."""

from common import exposed_alike, options, picture_grid, save, skies

TYPES = {"desert": "desert", "maritime clean": "maritime_clean", "urban": "urban"}
LOADS = (0.05, 0.5)
SUNS = (25.0, 5.0, 0.0)

given = options(__doc__)
suns = given.few(SUNS)
columns = [
    [
        sky.render("fisheye", size=given.size(150))
        for sky in skies(suns, given, 250, aerosol=aerosol, aod_550=aod)
    ]
    for aod in LOADS
    for aerosol in TYPES.values()
]
rows = [exposed_alike(row) for row in zip(*columns, strict=True)]
names = [f"{name}\nAOD {aod:g}" for aod in LOADS for name in TYPES]
save(picture_grid(rows, names, [f"sun at {s:g}°" for s in suns]), "load_and_sun", given, dpi=88)

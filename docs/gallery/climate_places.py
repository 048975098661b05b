"""The same sun over ten places and four seasons: what the climate alone does to a sky."""

import celaje
from common import exposed_alike, options, picture_grid, save

SUN_ELEVATION = 20.0
PLACES = {
    "Mid-Pacific": (0.0, -150.0),
    "Amazonia": (-6.0, -62.0),
    "Sahara": (23.0, 5.0),
    "Zaragoza": "Zaragoza",
    "Beijing": "Beijing",
    "Delhi": "Delhi",
    "Lhasa": "Lhasa",
    "Yakutsk": "Yakutsk",
    "Greenland": (72.6, -38.5),
    "South Pole": (-90.0, 0.0),
}
SEASONS = {"January": 1, "April": 4, "July": 7, "October": 10}

given = options(__doc__)
places, seasons = given.few(list(PLACES)), given.few(list(SEASONS))
films = []
for season in seasons:
    for place in places:
        sky = celaje.sky(
            at=PLACES[place],
            time=f"2026-{SEASONS[season]:02}-16T12:00Z",
            sun_elevation=SUN_ELEVATION,
            sun_azimuth=180.0,
            wavelengths="400:700:50" if given.quick else "400:700:20",
        )
        films.append(sky.render("fisheye", size=given.size(56)))
shown = exposed_alike(films)
rows = [shown[i : i + len(places)] for i in range(0, len(shown), len(places))]
figure = picture_grid(rows, places, seasons, inches=0.74)
save(figure, "climate_places", given)

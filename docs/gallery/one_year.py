"""The same hour through a year at one place."""

import celaje
from common import options, plt, rgba, save

PLACE, HOUR_UTC = (41.65, -0.88), "17:15"
MONTHS = "January February March April May June July August September October November December"

given = options(__doc__)
months = given.few(MONTHS.split())
rows = -(-len(months) // 4)
figure, axes = plt.subplots(rows, 4, figsize=(7.6, 2.05 * rows), dpi=100, layout="tight")
for each in axes.flat:
    each.axis("off")
for month, (each, name) in enumerate(zip(axes.flat, months, strict=False), start=1):
    sky = celaje.sky(
        at=PLACE, time=f"2026-{month:02d}-15T{HOUR_UTC}Z", wavelengths=given.wavelengths
    )
    each.imshow(rgba(sky.render("fisheye", size=given.size(180))))
    each.set_title(f"{name}, sun at {sky.conditions.sun_elevation_deg.value:.0f}°")
save(figure, "one_year", given)

"""One day at one place."""

import celaje
from common import options, plt, rgba, save

PLACE, DAY, AHEAD_H = (41.65, -0.88), "2026-06-21", 2
HOURS_UTC = ("03:50", "04:30", "05:30", "07:00", "09:00", "12:04", "15:00", "17:00", "18:40")
EVENING_UTC = ("19:36", "20:00", "20:15")

given = options(__doc__)
times = given.few(HOURS_UTC + EVENING_UTC)
figure, axes = plt.subplots(
    -(-len(times) // 4), 4, figsize=(7.6, 2.05 * -(-len(times) // 4)), dpi=100, layout="tight"
)
for each in axes.flat:
    each.axis("off")
# The air of noon all day: the climate knows no hours.
noon = celaje.sky(at=PLACE, time=f"{DAY}T12:00Z", wavelengths=given.wavelengths)
moments = [celaje.climate(at=PLACE, time=f"{DAY}T{time}Z") for time in times]
suns = [moment.sun_elevation_deg.value for moment in moments]
accuracy = "preview" if given.quick else "default"
day = noon.bake((min(suns), max(suns)), noon.conditions.altitude_m.value, accuracy)
for each, time, moment, sun in zip(axes.flat, times, moments, suns, strict=False):
    sky = day.under(sun, moment.sun_azimuth_deg.value)
    each.imshow(rgba(sky.render("fisheye", size=given.size(180))))
    hour = int(time[:2]) + AHEAD_H
    each.set_title(f"{hour:02d}{time[2:]}, sun at {sun:.0f}°")
save(figure, "one_day", given)

"""Degree and angle of polarisation of a clear sky, by day and at dusk, and its neutral points."""

import numpy as np
from matplotlib.patheffects import withStroke

import celaje
from common import options, plt, save

SUNS = (10.0, -2.0)
SUN_AZIMUTH = 270.0
WAVELENGTH = "450"


def stokes(sky: celaje.Sky, azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """I, Q and U of directions, shape (3, n)."""
    seen = sky.radiance(azimuth, elevation, method="shells", polarised=True, sun_disc="off")
    return seen.radiance[:, 0, :3].T


def fisheye(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which pixels see the sky, and the azimuths and elevations of those: zenith in the middle, north up, east left."""
    middle = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(middle, -middle)
    lit = np.hypot(x, y) < 1
    return lit, np.degrees(np.arctan2(-x[lit], y[lit])) % 360, 90 * (1 - np.hypot(x, y)[lit])


given = options(__doc__)
size = given.size(240)
figure, axes = plt.subplots(
    2, 3, figsize=(8.6, 5.2), dpi=100, layout="constrained", width_ratios=(1, 1, 1.15)
)
for row, sun_elevation in zip(axes, SUNS, strict=True):
    sky = celaje.sky(
        sun_elevation=sun_elevation,
        sun_azimuth=SUN_AZIMUTH,
        aerosol="opac:continental_clean",
        aod_550=0.05,
        wavelengths=WAVELENGTH,
    ).bake(
        (sun_elevation, sun_elevation),
        highest_observer_m=0.0,
        accuracy="preview" if given.quick else "default",
        polarised=True,
    )
    lit, azimuth, elevation = fisheye(size)
    i, q, u = stokes(sky, azimuth, elevation)
    pictures = []
    for values in (100 * np.hypot(q, u) / i, np.degrees(0.5 * np.arctan2(u, q))):
        picture = np.full(lit.shape, np.nan)
        picture[lit] = values
        pictures.append(picture)
    extent = (-1, 1, -1, 1)
    degree = row[0].imshow(pictures[0], extent=extent, cmap="magma", vmin=0, vmax=85)
    row[0].set_title(f"degree, sun at {sun_elevation:g}°")
    angle = row[1].imshow(pictures[1], extent=extent, cmap="twilight", vmin=-90, vmax=90)
    row[1].set_title("angle from the vertical; bars: electric field")

    # Bars of the electric field: θ̂ points outwards, φ̂ along growing azimuth, which runs over east on the left.
    lit, azimuth, elevation = fisheye(given.size(17))
    i, q, u = stokes(sky, azimuth, elevation)
    a, r = np.radians(azimuth), 1 - elevation / 90
    x, y = -r * np.sin(a), r * np.cos(a)
    turn, length = 0.5 * np.arctan2(u, q), 0.09 * np.hypot(q, u) / i
    along = np.cos(turn) * -np.sin(a) + np.sin(turn) * -np.cos(a)
    up = np.cos(turn) * np.cos(a) + np.sin(turn) * -np.sin(a)
    bars = np.array([[x - length * along, x + length * along], [y - length * up, y + length * up]])
    row[1].plot(*bars, color="w", lw=1.2, path_effects=[withStroke(linewidth=2.2, foreground="k")])
    for each in row[:2]:
        each.plot(
            *[(max(1 - sun_elevation / 90, 0),), (0,)],
            "o",
            mfc="none",
            mec="w",
            ms=6,
            clip_on=False,
        )
        each.axis("off")

    # From the horizon under the sun over the zenith to the opposite one.
    arc = np.linspace(0.5, 179.5, 40 if given.quick else 360)
    over = arc > 90
    i, q, u = stokes(
        sky,
        np.where(over, SUN_AZIMUTH - 180, SUN_AZIMUTH),
        np.where(over, 180 - arc, arc),
    )
    row[2].axhline(0, color="0.6", lw=0.8)
    row[2].plot(arc, 100 * q / i, color="C0")
    row[2].axvline(sun_elevation, color="C1", lw=0.8, ls=":")
    for k in np.nonzero((q[1:] > 0) != (q[:-1] > 0))[0]:
        zero = arc[k] - q[k] * (arc[k + 1] - arc[k]) / (q[k + 1] - q[k])
        if abs(zero - sun_elevation) > 2:
            above = zero - sun_elevation if zero < 90 else 180 + sun_elevation - zero
            row[2].plot(zero, 0, "o", color="k", ms=4)
            name, place, ha = (
                ("Babinet", (4, 6), "left") if zero < 90 else ("Arago", (-4, 6), "right")
            )
            label = f"{name} {above:.0f}°"
            row[2].annotate(label, (zero, 0), place, textcoords="offset points", fontsize=8, ha=ha)
    row[2].set(ylim=(-90, 30), xlim=(-4, 180), xticks=range(0, 181, 45), ylabel="Q / I  [%]")
    row[2].set_title("in the plane of the sun")
axes[1][2].set_xlabel("from the sun's horizon over the zenith  [°]")
figure.colorbar(degree, ax=axes[:, 0], shrink=0.5, location="bottom").set_label("%")
figure.colorbar(
    angle, ax=axes[:, 1], shrink=0.5, location="bottom", ticks=(-90, -45, 0, 45, 90)
).set_label("°")
save(figure, "polarisation", given)

"""Maps of what the climate says: aerosol optical depth, ozone, nearest aerosol type, in January and July."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

import celaje
from common import options, plt, save

# Aerosol where its seasons differ most, ozone in the spring of either pole.
MONTHS = {"January": 1, "July": 7, "March": 3, "October": 10}
# The AIAA types, with colours of what they are found over.
TYPES = {
    "antarctic": "#dfe6f5",
    "arctic": "#9fb6e0",
    "background": "#6b6b8a",
    "maritime-clean": "#3c78b4",
    "maritime-mineral": "#8fb08c",
    "maritime-polluted": "#5fa8a0",
    "desert": "#e0b04a",
    "continental": "#8fbf5a",
    "rural": "#4f8f3a",
    "urban": "#a03c3c",
}

given = options(__doc__)
step = 15.0 if given.quick else 2.0
latitude = np.arange(-90 + step / 2, 90, step)
longitude = np.arange(-180 + step / 2, 180, step)
grid = np.array([(lat, lon) for lat in latitude for lon in longitude])
times = [f"2026-{month:02}-16T12:00Z" for month in MONTHS.values()]
table = celaje.climate(at=grid, time=times)


def on_map(name: str, month: str) -> np.ndarray:
    """A condition over the world, shape (latitude, longitude)."""
    values = table[name][:, list(MONTHS).index(month)]
    return values.reshape(latitude.size, longitude.size)


def kind(month: str) -> np.ndarray:
    """The nearest type as a number."""
    return np.vectorize(list(TYPES).index)(on_map("aerosol_type", month))


types = ListedColormap(list(TYPES.values()))
rows = [
    (
        "aerosol optical depth at 550 nm",
        "YlOrBr",
        [0, 0.02, 0.05, 0.08, 0.11, 0.15, 0.2, 0.3, 0.4, 0.6],
    ),
    ("ozone [DU]", "viridis", list(range(160, 481, 20))),
    ("nearest AIAA type", types, [i - 0.5 for i in range(len(TYPES) + 1)]),
]
figure, axes = plt.subplots(3, 2, figsize=(8.4, 6.6), dpi=90, layout="constrained")
for row, (title, colours, bounds) in enumerate(rows):
    for column in range(2):
        month = list(MONTHS)[column + (2 if row == 1 else 0)]
        values = kind(month) if row == 2 else on_map(("aod_550", "ozone_du")[row], month)
        panel = axes[row, column]
        norm = BoundaryNorm(bounds, types.N if row == 2 else 256)
        image = panel.imshow(
            values, origin="lower", extent=(-180, 180, -90, 90), cmap=colours, norm=norm
        )
        # The shore, as the map of elevations has it.
        shore = on_map("altitude_m", month)
        panel.contour(longitude, latitude, shore, [2.0], colors="black", linewidths=0.4)
        panel.set_title(f"{title}, {month}")
        panel.set_xticks([-120, -60, 0, 60, 120])
        panel.set_yticks([-60, -30, 0, 30, 60])
    bar = figure.colorbar(image, ax=axes[row, :], fraction=0.05, pad=0.01, aspect=15)
    if row == 2:
        bar.set_ticks(range(len(TYPES)), labels=list(TYPES), fontsize=7)
save(figure, "climate_maps", given, dpi=90)

"""One row per aerosol type: how it scatters, how much it absorbs, and the sky it makes."""

import numpy as np

import celaje
from common import options, plt, rgba, save

AIAA = (
    "antarctic",
    "arctic",
    "background",
    "maritime-clean",
    "maritime-mineral",
    "maritime-polluted",
    "continental",
    "desert",
    "rural",
    "urban",
)
OPAC = (
    "opac:antarctic",
    "opac:arctic",
    "opac:maritime-clean",
    "opac:maritime-tropical",
    "opac:maritime-polluted",
    "opac:continental-clean",
    "opac:continental-average",
    "opac:continental-polluted",
    "opac:desert",
    "opac:urban",
)
HUMIDITY, SUN, AOD = 80, 15, 0.3
# Height of a row and pixels per inch: small enough for a repository.
ROW, DPI = 0.82, 74
# Decades of the polar plots, from the middle outwards.
LOWEST, HIGHEST = 1e-2, 1e2
SHOWN = {450.0: "#3366cc", 550.0: "#2e8b57", 650.0: "#cc4433"}

given = options(__doc__)
families = (given.few(AIAA), given.few(OPAC))
rows = max(len(family) for family in families)
figure = plt.figure(figsize=(10.4, ROW * rows + 0.75))
grid = figure.add_gridspec(
    rows, 8, width_ratios=(1.5, 1.1, 1.35, 1.0) * 2, hspace=0.12, wspace=0.12,
    left=0.01, right=0.99, top=1 - 0.36 / (ROW * rows + 0.75), bottom=0.55 / (ROW * rows + 0.75),
)  # fmt: skip
theta = np.concatenate([np.geomspace(0.05, 10, 60), np.linspace(10.5, 180, 200)])
wavelengths = np.linspace(380.0, 780.0, 17)
titles = ("phase function", "albedo, asymmetry", f"sky, sun at {SUN}°")

for block, family in enumerate(families):
    for row, name in enumerate(family):
        cells = [grid[row, 4 * block + k] for k in range(4)]
        kind = celaje.aerosol(name, humidity=HUMIDITY)
        # All at once is much faster than one by one; what is known is kept.
        kind.ssa([*wavelengths, *SHOWN, 440.0, 870.0])
        ratio = kind.extinction([440.0, 870.0])
        exponent = -np.log(ratio[0] / ratio[1]) / np.log(440 / 870)

        words = figure.add_subplot(cells[0])
        words.axis("off")
        title = name.removeprefix("opac:").replace("-", " ")
        words.text(0.02, 0.68, title, fontsize=9, weight="bold")
        words.text(
            0.02,
            0.12,
            f"ω {kind.ssa(550.0):.3f}   g {kind.asymmetry(550.0):.3f}\nα {exponent:.2f}",
            fontsize=8,
        )

        polar = figure.add_subplot(cells[1], projection="polar")
        for nm, colour in SHOWN.items():
            p = np.clip(kind.phase(nm, theta), LOWEST, HIGHEST)
            radius = np.log10(p / LOWEST) / np.log10(HIGHEST / LOWEST)
            for sign in (1, -1):
                polar.plot(sign * np.radians(theta), radius, color=colour, linewidth=0.9)
        polar.set_rlim(0, 1)
        polar.set_rticks([0.25, 0.5, 0.75])
        polar.set_xticks(np.radians([0, 90, 180, 270]))
        polar.tick_params(labelleft=False, labelbottom=False)
        polar.grid(linewidth=0.4)
        polar.spines["polar"].set_linewidth(0.4)

        spectrum = figure.add_subplot(cells[2])
        spectrum.plot(wavelengths, kind.ssa(wavelengths), color="black", linewidth=1.1)
        spectrum.plot(wavelengths, kind.asymmetry(wavelengths), color="#b8860b", linewidth=1.1)
        spectrum.set_ylim(0.45, 1.02)
        spectrum.set_yticks([0.5, 0.75, 1.0])
        spectrum.tick_params(labelsize=6, length=2, pad=1.5)
        spectrum.grid(linewidth=0.3)
        last = row == len(family) - 1
        spectrum.set_xticks([400, 550, 700], [400, 550, 700] if last else [])
        if last:
            spectrum.set_xlabel("nm", fontsize=7, labelpad=1)

        sky = celaje.sky(
            sun_elevation=SUN,
            aerosol=name,
            aod_550=AOD,
            humidity=HUMIDITY,
            wavelengths="400:700:50" if given.quick else "380:780:20",
        )
        film = sky.render("fisheye", size=given.size(60), method="shells")
        picture = figure.add_subplot(cells[3])
        picture.imshow(rgba(film), interpolation_stage="rgba")
        picture.axis("off")
        if row == 0:
            words.set_title(("AIAA", "OPAC")[block], fontsize=9, loc="left", pad=5)
            for axes, heading in zip((polar, spectrum, picture), titles, strict=True):
                axes.set_title(heading, fontsize=8, pad=5)

figure.text(
    0.012,
    0.004,
    f"{HUMIDITY} % humidity. ω and g at 550 nm, Ångström exponent α from 440 to 870 nm. Skies at optical depth {AOD}.\n"
    f"Phase functions at 450, 550, 650 nm (blue, green, red), forward to the right, from {LOWEST:g} at the centre to "
    f"{HIGHEST:g} sr⁻¹ at the rim. Black: ω, ochre: g.",
    fontsize=7,
    color="#444444",
)
save(figure, "aerosol_types", given, dpi=DPI)

"""What the scripts of the gallery share: options, skies side by side, files small enough for a repository.

Each script makes one picture: ``python docs/gallery/load_and_sun.py`` writes ``docs/images/gallery/load_and_sun.png``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

import celaje

IMAGES = Path(__file__).resolve().parent.parent / "images" / "gallery"
# Largest file that goes into the repository [bytes].
MOST_BYTES = 500_000

plt.rcParams.update(
    {
        "font.size": 9,
        "axes.titlesize": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "figure.facecolor": "white",
        "savefig.facecolor": "white",
    }
)


@dataclass(frozen=True)
class Options:
    """How a script is run.

    Attributes
    ----------
    quick : bool
        Tiny pictures at few wavelengths: a test that the script still works, not a picture to look at.
    folder : Path
        Where the picture goes.
    """

    quick: bool
    folder: Path

    def size(self, pixels: int) -> int:
        """Pixels of a sky: as asked for, or very few."""
        return min(pixels, 12) if self.quick else pixels

    @property
    def wavelengths(self) -> str:
        """Vacuum wavelengths as ``START:STOP:STEP``, enough for colours. [nm]."""
        return "400:700:50" if self.quick else "400:700:10"

    def few(self, values: Sequence) -> Sequence:
        """All values, or the first two."""
        return values[:2] if self.quick else values


def options(description: str | None) -> Options:
    """The options of the command line: ``--quick`` and ``--folder DIR``."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="tiny, to test the script")
    parser.add_argument("--folder", type=Path, default=IMAGES, help="where the picture goes")
    given = parser.parse_args()
    return Options(given.quick, given.folder)


def skies(
    suns: Sequence[float], given: Options, sun_azimuth: float, **air: object
) -> list[celaje.Sky]:
    """One air under several suns, solved once.

    Parameters
    ----------
    suns : sequence of float
        True elevations. [deg]
    given : Options
        Says how many wavelengths, unless `air` does.
    sun_azimuth : float
        Of all suns. [deg]
    air
        As in :func:`celaje.sky`.

    Returns
    -------
    list of Sky
        One for each sun.
    """
    air.setdefault("wavelengths", given.wavelengths)
    sky = celaje.sky(sun_elevation=suns[0], sun_azimuth=sun_azimuth, **air)
    accuracy = "preview" if given.quick else "default"
    baked = sky.bake((min(suns), max(suns)), highest_observer_m=0.0, accuracy=accuracy)
    return [baked.under(s, sun_azimuth) for s in suns]


def rgba(film: celaje.Film) -> np.ndarray:
    """A film as a display shows it, transparent where the sensor sees nothing, shape (height, width, 4)."""
    return np.concatenate([film.rgb(), (film.samples > 0)[..., None]], axis=2)


def colours(seen: celaje.Radiance) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The colours of a list of directions.

    Parameters
    ----------
    seen : Radiance
        Of n directions.

    Returns
    -------
    shown : ndarray, shape (n, 3)
        Display values under one exposure, chosen from all.
    linear : ndarray, shape (n, 3)
        Linear sRGB. [cd/m²]
    luminance : ndarray, shape (n,)
        [cd/m²]
    """
    radiance = seen.radiance[None]
    samples = np.ones(radiance.shape[:2], dtype=np.uint32)
    film = celaje.Film(radiance, np.zeros_like(radiance), samples, seen.wavelength_nm)
    # Luminance is the observer of 1931's; Y of the sRGB primaries (IEC 61966-2-1).
    luminance = film.linear_srgb(1931)[0] @ np.array([0.2126, 0.7152, 0.0722])
    return film.rgb()[0], film.linear_srgb()[0], luminance


def exposed_alike(films: Sequence[celaje.Film]) -> list[np.ndarray]:
    """Display values of several films under one exposure, chosen from all of them together.

    Parameters
    ----------
    films : sequence of Film
        Of the same height and wavelengths.

    Returns
    -------
    list of ndarray, shape (height, width, 4)
        Red, green, blue and alpha; transparent where the sensor sees nothing.
    """
    together = celaje.Film(
        np.concatenate([f.radiance for f in films], axis=1),
        np.concatenate([f.variance for f in films], axis=1),
        np.concatenate([f.samples for f in films], axis=1),
        films[0].wavelength_nm,
    )
    edges = np.cumsum([f.samples.shape[1] for f in films])[:-1]
    return np.split(rgba(together), edges, axis=1)


def picture_grid(
    pictures: Sequence[Sequence[np.ndarray]],
    columns: Sequence[str],
    rows: Sequence[str],
    inches: float = 1.5,
    compass: bool = True,
) -> Figure:
    """Pictures in rows and columns with titles.

    Parameters
    ----------
    pictures : rows of columns of ndarray, shape (height, width, 3 or 4)
        Display values in [0, 1].
    columns, rows : sequence of str
        Titles above and at the left.
    inches : float
        Width of each picture at 100 pixels per inch.
    compass : bool
        Mark north and east on the first picture, a fisheye.

    Returns
    -------
    Figure
    """
    height, width = pictures[0][0].shape[:2]
    tall = inches * height / width
    left, top, gap = 0.75, 0.42, 0.06
    total = (
        left + len(columns) * (inches + gap),
        top + len(rows) * (tall + gap) + 0.05,
    )
    figure = plt.figure(figsize=total, dpi=100)
    for r, row in enumerate(pictures):
        for c, picture in enumerate(row):
            x = (left + c * (inches + gap)) / total[0]
            y = 1 - (top + (r + 1) * (tall + gap) - gap) / total[1]
            axes = figure.add_axes((x, y, inches / total[0], tall / total[1]))
            axes.imshow(picture, interpolation_stage="rgba")
            axes.axis("off")
            if r == 0:
                axes.set_title(columns[c], pad=4)
            if c == 0:
                axes.text(
                    -0.06,
                    0.5,
                    rows[r],
                    rotation=90,
                    ha="right",
                    va="center",
                    transform=axes.transAxes,
                )
            if compass and r == c == 0:
                marks = {"N": (0.5, 0.93), "E": (0.05, 0.5), "S": (0.5, 0.05), "W": (0.95, 0.5)}
                for mark, (mx, my) in marks.items():
                    axes.text(
                        mx,
                        my,
                        mark,
                        color="white",
                        alpha=0.8,
                        fontsize=7,
                        ha="center",
                        va="center",
                        transform=axes.transAxes,
                    )
    return figure


def save(figure: Figure, name: str, given: Options, dpi: int = 100) -> Path:
    """Write the picture and say where; refuses what is too large for a repository.

    Parameters
    ----------
    figure : Figure
        Closed afterwards.
    name : str
        File name without its extension.
    given : Options
        Where to.
    dpi : int
        Pixels per inch.

    Returns
    -------
    Path
    """
    given.folder.mkdir(parents=True, exist_ok=True)
    path = given.folder / f"{name}.png"
    # Without the version of matplotlib in it, the same picture is the same file.
    figure.savefig(path, dpi=dpi, metadata={"Software": None})
    plt.close(figure)
    written = path.stat().st_size
    print(f"{path}: {written / 1000:.0f} kB")
    if written > MOST_BYTES:
        raise SystemExit(f"{path} is larger than {MOST_BYTES / 1000:.0f} kB: make it smaller")
    return path

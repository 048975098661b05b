#!/usr/bin/env python3
"""Pack the ground types with their snow and sea ice, and put together a spectral albedo for each type.

usage: make.py GROUND.npz LIBRADTRAN.csv EARTHLIB.csv SOLAR.csv OUTPUT_FOLDER

GROUND.npz has ground_type (180, 360), north to south from 89.5, west to east from -179.5, type_names, and
snow_ice_monthly (12, 180, 360) with snow as bit 1 and sea ice as bit 2. LIBRADTRAN.csv and EARTHLIB.csv have
measured spectra by surface; SOLAR.csv a solar spectrum (wavelength_nm, irradiance). `ground_1deg.bin`, little-
endian unsigned 32-bit: bits 0-3 the type, bits 4-15 snow from January to December, bits 16-27 sea ice.
`spectra.csv`: one column per type and state; each is a measured shape, or a mean of shapes, scaled to the
broadband albedo of the type; snow-covered land is a mixture of bare ground and snow of that albedo.
"""

import csv
import pathlib
import sys

import numpy as np

ground_path, libradtran_path, earthlib_path, solar_path, out = sys.argv[1:]
out = pathlib.Path(out)
WAVELENGTH_NM = np.concatenate([np.arange(280, 800, 10), np.arange(800, 2501, 25)])
# Broadband albedo without and with snow (ice on water); shapes by surface and share.
BROADBAND = {
    "water": (0.065, 0.55),
    "forest": (0.13, 0.35),
    "shrub": (0.20, 0.60),
    "grass": (0.19, 0.65),
    "crop": (0.18, 0.65),
    "barren": (0.32, 0.65),
    "ice": (0.80, 0.80),
    "urban": (0.15, 0.45),
    "wetland": (0.14, 0.50),
}
SHAPES = {
    "water": {"water_bowker": 1},
    "forest": {"grass_kentucky_blue": 0.6, "bark": 0.4},
    "shrub": {"dry_grass_usgs": 0.5, "soil_icraf": 0.5},
    "grass": {"grass_kentucky_blue": 0.6, "dry_grass_usgs": 0.4},
    "crop": {"grass_kentucky_blue": 0.5, "soil_icraf": 0.5},
    "barren": {"sand": 0.5, "soil_icraf": 0.5},
    "ice": {"snow_typical": 1},
    "urban": {
        "asphalt_road": 0.4,
        "concrete_sidewalk": 0.2,
        "comp_shingle_roof": 0.2,
        "grass_kentucky_blue": 0.2,
    },
    "wetland": {"grass_kentucky_blue": 0.7, "water_bowker": 0.3},
}


def read(path):
    return list(
        csv.DictReader(line for line in open(path, encoding="utf-8") if not line.startswith("#"))
    )


ground = np.load(ground_path)
cells = ground["ground_type"].astype("<u4")
for month in range(12):
    marks = ground["snow_ice_monthly"][month].astype("<u4")
    cells |= ((marks & 1) << (4 + month)) | ((marks >> 1 & 1) << (16 + month))
cells.astype("<u4").tofile(out / "ground_1deg.bin")

measured = {}
for rows, nm, value, unit in (
    (read(libradtran_path), "wavelength_nm", "albedo", 1),
    (read(earthlib_path), "wavelength_um", "reflectance", 1000),
):
    for r in rows:
        measured.setdefault(r["surface"], []).append((float(r[nm]) * unit, float(r[value])))


def shape(name):
    x, y = np.array(sorted(measured[name])).T
    return np.interp(WAVELENGTH_NM, x, y)


solar = read(solar_path)
names = list(solar[0])
sun = np.interp(
    WAVELENGTH_NM, [float(r[names[0]]) for r in solar], [float(r[names[1]]) for r in solar]
)
weight = sun * np.gradient(WAVELENGTH_NM.astype(float))


def scaled(spectrum, broadband):
    for _ in range(50):  # Clipping at 0.99 lowers the mean; the rest makes up for it.
        spectrum = np.minimum(spectrum * broadband / np.average(spectrum, weights=weight), 0.99)
    return spectrum


bare = {
    k: scaled(sum(share * shape(s) for s, share in SHAPES[k].items()), BROADBAND[k][0])
    for k in SHAPES
}
columns = dict(bare)
for k, (dark, bright) in BROADBAND.items():
    cover = (bright - dark) / (BROADBAND["ice"][0] - dark) if k != "ice" else 1
    columns[f"{k}_snow"] = bare[k] + cover * (bare["ice"] - bare[k])
with open(out / "spectra.csv", "w", encoding="utf-8") as f:
    print(
        "# Spectral albedo of ground types, bare and under snow (water: sea ice). See SOURCE.md.",
        file=f,
    )
    print(",".join(["wavelength_nm", *columns]), file=f)
    for i, nm in enumerate(WAVELENGTH_NM):
        print(",".join([str(nm), *(f"{v[i]:.4f}" for v in columns.values())]), file=f)
assert list(ground["type_names"]) == list(BROADBAND)

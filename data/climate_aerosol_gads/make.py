#!/usr/bin/env python3
"""Keep what the climate needs of the Global Aerosol Data Set, and OPAC's extinction at 550 nm.

usage: make.py GRID.csv OPTICS.csv OUTPUT_FOLDER

GRID.csv has season, lat, lon, profile_type, rh_class, ten columns of number densities and mitr_upper;
OPTICS.csv has component, rh_percent, wavelength_um and ext_km-1_per_cm-3. Latitudes increase, then longitudes,
in the result.
"""

import csv
import pathlib
import sys

COMPONENTS = ["waso", "inso", "soot", "ssam", "sscm", "minm", "miam", "micm", "mitr", "suso"]


def read(path):
    return csv.DictReader(line for line in open(path, encoding="utf-8") if not line.startswith("#"))


out = pathlib.Path(sys.argv[3])
rows = list(read(sys.argv[1]))
rows.sort(key=lambda r: (r["season"] == "summer", int(r["lat"]), int(r["lon"])))
with open(out / "grid.csv", "w", encoding="utf-8") as f:
    print(
        "# GADS: two seasons (winter = December-February, summer = June-August), "
        "37 x 72 nodes from -90, -180. See SOURCE.md.",
        file=f,
    )
    print(
        ",".join(
            [
                "season,latitude_deg,longitude_deg,profile,humidity_percent",
                *COMPONENTS,
                "mitr_upper",
            ]
        ),
        file=f,
    )
    for r in rows:
        cells = [r[k] for k in ("season", "lat", "lon", "profile_type", "rh_class")]
        print(",".join(cells + [f"{float(r[k]):.4g}" for k in [*COMPONENTS, "mitr_upper"]]), file=f)
with open(out / "extinction_550.csv", "w", encoding="utf-8") as f:
    print("# OPAC: extinction at 550 nm of 1 particle per cm3. See SOURCE.md.", file=f)
    print("component,humidity_percent,extinction_per_km", file=f)
    for r in read(sys.argv[2]):
        if float(r["wavelength_um"]) == 0.55:
            print(
                f"{r['component']},{float(r['rh_percent']):g},{float(r['ext_km-1_per_cm-3']):g}",
                file=f,
            )

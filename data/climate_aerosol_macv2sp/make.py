#!/usr/bin/env python3
"""Keep the optical depth of the MACv2-SP plumes: places, seasons and years from 1900.

usage: make.py PLUMES.csv SEASON.csv YEARS.csv OUTPUT_FOLDER
"""

import csv
import math
import pathlib
import sys

COLUMNS = [
    "plume",
    "lat",
    "lon",
    "feature",
    "weight",
    "sx_w",
    "sx_e",
    "sy_w",
    "sy_e",
    "theta_rad",
    "aod_max",
]


def read(path):
    return csv.DictReader(line for line in open(path, encoding="utf-8") if not line.startswith("#"))


out = pathlib.Path(sys.argv[4])
with open(out / "plumes.csv", "w", encoding="utf-8") as f:
    print(
        "# MACv2-SP: two Gaussian features of nine plumes; angles in degrees. See SOURCE.md.",
        file=f,
    )
    print(
        "plume,latitude_deg,longitude_deg,feature,weight,west_deg,east_deg,west_across_deg,east_across_deg,turn_deg,aod_max",
        file=f,
    )
    for r in read(sys.argv[1]):
        r["lon"] = f"{(float(r['lon']) + 180) % 360 - 180:g}"
        r["theta_rad"] = f"{math.degrees(float(r['theta_rad'])):.3f}"
        print(",".join(r[k] for k in COLUMNS), file=f)
for path, name, comment in (
    (sys.argv[2], "season.csv", "factor over the year, 52 steps, pXfY is feature Y of plume X"),
    (sys.argv[3], "years.csv", "factor of each plume by year, 2005 = 1"),
):
    with open(out / name, "w", encoding="utf-8") as f:
        print(f"# MACv2-SP: {comment}. See SOURCE.md.", file=f)
        rows = [r for r in read(path) if int(r.get("year") or 1900) >= 1900]
        print(",".join(rows[0]), file=f)
        for r in rows:
            print(",".join(r.values()), file=f)

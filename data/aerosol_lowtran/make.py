#!/usr/bin/env python3
"""Keep what the upper layers need of LOWTRAN 7's aerosols: three models to 4 µm, and the profiles above 11 km.

usage: make.py MODELS.csv PROFILES.csv   (writes spectral.csv and profiles.csv here)

MODELS.csv has model, wavelength_um, ext_rel, abs_rel, asymmetry_g; PROFILES.csv has z_km and extinction at 550 nm
[km-1] of each column, 0 where a column is not defined.
"""

import csv
import sys

MODELS = ["background_stratospheric", "fresh_volcanic", "aged_volcanic", "meteoric_dust"]


def rows(path):
    return csv.DictReader(line for line in open(path, encoding="utf-8") if not line.startswith("#"))


def mean(row, load):
    seasons = ["fallwinter", "springsummer"]
    return 0.5e-3 * sum(float(row[f"strat_{load}_{season}"]) for season in seasons)


with open("spectral.csv", "w", encoding="utf-8") as out:
    out.write(
        "# LOWTRAN 7: extinction and absorption over extinction at 550 nm, asymmetry. See SOURCE.md.\n"
    )
    out.write("model,wavelength_nm,ext_rel,abs_rel,asymmetry\n")
    for r in rows(sys.argv[1]):
        if r["model"] in MODELS and float(r["wavelength_um"]) <= 4:
            nm = f"{float(r['wavelength_um']) * 1e3:g}"
            out.write(
                ",".join([r["model"], nm, r["ext_rel"], r["abs_rel"], r["asymmetry_g"]]) + "\n"
            )

with open("profiles.csv", "w", encoding="utf-8") as out:
    out.write(
        "# LOWTRAN 7: extinction at 550 nm [m-1], mean of both seasons; 0 outside a layer. See SOURCE.md.\n"
    )
    out.write("altitude_m,background,moderate_volcanic,high_volcanic,meteoric_dust\n")
    for r in rows(sys.argv[2]):
        values = [mean(r, load) for load in ["background", "moderate_volcanic", "high_volcanic"]]
        values.append(1e-3 * float(r["upper_normal"]))
        if float(r["z_km"]) >= 11:
            out.write(
                ",".join([f"{float(r['z_km']) * 1e3:g}", *(f"{v:.4g}" for v in values)]) + "\n"
            )

#!/usr/bin/env python3
"""Trim the 1 nm Serdyuchenko ozone cross sections to 270-1100 nm, four digits, and convert cm2 to m2.

usage: make.py SOURCE.csv > serdyuchenko_1nm.csv

SOURCE.csv has wavelength_nm and the columns xs_193K ... xs_293K in cm2 per molecule, 214-1100 nm.
"""

import sys

print(
    "# Ozone absorption cross section, m2 per molecule, mean over 1 nm bins centred on wavelength_nm (vacuum)."
)
print(
    "# Slightly negative values are measurement noise, kept here and clipped by the reader. See SOURCE.md."
)
for line in open(sys.argv[1], encoding="utf-8"):
    if line.startswith("wavelength_nm"):
        print(line.strip())
    elif line[0].isdigit() and float(line.split(",")[0]) >= 270:
        nm, *values = line.strip().split(",")
        print(",".join([nm, *(f"{float(v) * 1e-4:.3e}" for v in values)]))

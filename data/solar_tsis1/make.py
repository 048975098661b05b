#!/usr/bin/env python3
"""Trim the 1 nm TSIS-1 HSRS table to the columns and range that celaje embeds.

usage: make.py SOURCE.csv > tsis1_hsrs_1nm.csv

SOURCE.csv has the columns wavelength_nm (centre of a 1 nm bin, vacuum) and irradiance_W_m2_nm, with '#' comments.
"""

import sys

print(
    "# TSIS-1 HSRS v2, mean over 1 nm bins centred on wavelength_nm (vacuum); W m-2 nm-1 at 1 au. See SOURCE.md."
)
print("wavelength_nm,irradiance")
for line in open(sys.argv[1], encoding="utf-8"):
    if line[0].isdigit():
        print(line.strip())

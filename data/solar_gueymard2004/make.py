#!/usr/bin/env python3
"""Trim the Gueymard 2004 spectrum to 200-2800 nm.

usage: make.py SOURCE.csv > gueymard2004.csv

SOURCE.csv has the columns wavelength_nm and irradiance_W_m2_nm in the native sampling (0.5 nm, 1 nm, coarser).
"""

import sys

print(
    "# Gueymard 2004, native sampling; W m-2 nm-1 at 1 au (solar constant 1366.1 W m-2). See SOURCE.md."
)
print("wavelength_nm,irradiance")
for line in open(sys.argv[1], encoding="utf-8"):
    if line[0].isdigit() and float(line.split(",")[0]) <= 2800:
        print(line.strip())

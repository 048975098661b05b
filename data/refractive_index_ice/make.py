#!/usr/bin/env python3
"""Keep the refractive index of ice, 0.2-4 µm.

usage: make.py SOURCE.csv > ice.csv

SOURCE.csv has material, wavelength_um, n, k (k >= 0).
"""

import csv
import sys

print("# Refractive index n + ik of ice at 266 K. See SOURCE.md.")
print("wavelength_nm,n,k")
for r in csv.DictReader(
    line for line in open(sys.argv[1], encoding="utf-8") if not line.startswith("#")
):
    if r["material"] == "ice_warren2008":
        print(f"{float(r['wavelength_um']) * 1e3:g},{r['n']},{r['k']}")

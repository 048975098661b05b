#!/usr/bin/env python3
"""Keep Vandaele's NO2 cross sections, 270-667 nm, four digits, and convert cm2 to m2.

usage: make.py SOURCE.csv > vandaele_1nm.csv

SOURCE.csv has wavelength_nm, xs_220K_vandaele and xs_294K_vandaele in cm2 per molecule, blank where not measured.
"""

import csv
import sys

print(
    "# NO2 absorption cross section, m2 per molecule, mean over 1 nm bins centred on wavelength_nm (vacuum)."
)
print("# See SOURCE.md.")
print("wavelength_nm,xs_220K,xs_294K")
for row in csv.DictReader(
    line for line in open(sys.argv[1], encoding="utf-8") if not line.startswith("#")
):
    values = [row["xs_220K_vandaele"], row["xs_294K_vandaele"]]
    if float(row["wavelength_nm"]) >= 270 and all(values):
        print(",".join([row["wavelength_nm"], *(f"{max(float(v), 0) * 1e-4:.3e}" for v in values)]))

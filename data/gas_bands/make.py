#!/usr/bin/env python3
"""Keep the absorption coefficients of water vapour and mixed gases of SPECTRL2, 550-2500 nm.

usage: make.py SOURCE.csv > spectrl2.csv

SOURCE.csv has wavelength_nm, a_w and a_u.
"""

import csv
import sys

print(
    "# Absorption coefficients of SPECTRL2: a_w of water vapour [cm-1], "
    "a_u of the uniformly mixed gases [1]. See SOURCE.md."
)
print("wavelength_nm,a_w,a_u")
for row in csv.DictReader(
    line for line in open(sys.argv[1], encoding="utf-8") if not line.startswith("#")
):
    # Edges of the oxygen B band, whose one row would else be a triangle down to 668 nm.
    if row["wavelength_nm"] == "690":
        print("684,0.0117,0")
    if row["wavelength_nm"] == "710":
        print("697,0.0148,0")
    if 550 <= float(row["wavelength_nm"]) <= 2500:
        print(",".join([row["wavelength_nm"], row["a_w"], row["a_u"]]))

#!/usr/bin/env python3
"""Keep the absorption coefficients of water vapour and mixed gases of SPECTRL2, 550-2500 nm.

usage: make.py SOURCE.csv > spectrl2.csv

SOURCE.csv has wavelength_nm, a_w and a_u.
"""

import csv
import sys

print("# Absorption coefficients of SPECTRL2: a_w of water vapour [cm-1], a_u of the uniformly mixed gases [1]. See SOURCE.md.")
print("wavelength_nm,a_w,a_u")
for row in csv.DictReader(line for line in open(sys.argv[1], encoding="utf-8") if not line.startswith("#")):
    if 550 <= float(row["wavelength_nm"]) <= 2500:
        print(",".join([row["wavelength_nm"], row["a_w"], row["a_u"]]))

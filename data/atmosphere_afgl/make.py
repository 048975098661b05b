#!/usr/bin/env python3
"""Keep pressure, temperature, air, ozone, water vapour and nitrogen dioxide of the AFGL 1986 profiles, in SI units.

usage: make.py SOURCE.csv > afgl1986.csv

SOURCE.csv has atmosphere, z_km, p_hPa, T_K, air_cm3, o3_cm3, h2o_cm3, no2_cm3 and further gases, altitude increasing.
"""

import csv
import sys

rows = csv.DictReader(
    line for line in open(sys.argv[1], encoding="utf-8") if not line.startswith("#")
)
print("# AFGL 1986 reference atmospheres, altitude above sea level, 0-120 km. See SOURCE.md.")
print("atmosphere,altitude_m,pressure_pa,temperature_k,air_m3,ozone_m3,water_m3,no2_m3")
for r in rows:
    values = [float(r["z_km"]) * 1e3, float(r["p_hPa"]) * 100, float(r["T_K"])]
    values += [float(r["air_cm3"]) * 1e6, float(r["o3_cm3"]) * 1e6]
    values += [float(r["h2o_cm3"]) * 1e6, float(r["no2_cm3"]) * 1e6]
    print(",".join([r["atmosphere"].replace("_", "-"), *(f"{v:.6g}" for v in values)]))

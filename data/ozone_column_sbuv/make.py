#!/usr/bin/env python3
"""Keep latitude, month, column, its standard deviation between years, and origin of the zonal SBUV ozone table.

usage: make.py SOURCE.csv > zonal_sbuv.csv

SOURCE.csv has lat, month, o3_DU, sd_DU, n_years, source; latitude decreasing. Here it increases. Filled cells
get 20 DU, by which they differ from MERRA-2.
"""

import csv
import sys

rows = list(
    csv.DictReader(line for line in open(sys.argv[1], encoding="utf-8") if not line.startswith("#"))
)
print(
    "# Total ozone, zonal monthly mean of 1998-2015; latitude_deg is the centre of a 5 degree zone. See SOURCE.md."
)
print("latitude_deg,month,ozone_du,deviation_du,origin")
for r in sorted(rows, key=lambda r: (float(r["lat"]), int(r["month"]))):
    print(f"{r['lat']},{r['month']},{r['o3_DU']},{r['sd_DU'] or '20'},{r['source']}")

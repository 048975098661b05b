#!/usr/bin/env python3
"""Pack the zonal climatology of ozone mixing ratios.

usage: make.py SOURCE.npz OUTPUT.bin

SOURCE.npz has lat (64), p_hPa (59) and o3_vmr_ppb (12, 64, 59). The result, little-endian: 64 latitudes and 59
pressures as 32-bit floats, then the mixing ratios as unsigned 16-bit integers, month by month, south to north,
top to bottom.
"""

import sys

import numpy as np

source = np.load(sys.argv[1])
with open(sys.argv[2], "wb") as f:
    f.write(source["lat"].astype("<f4").tobytes())
    f.write(source["p_hPa"].astype("<f4").tobytes())
    f.write(source["o3_vmr_ppb"].astype("<u2").tobytes())

#!/usr/bin/env python3
"""Pack the grid of mean elevations.

usage: make.py SOURCE.npz OUTPUT.bin

SOURCE.npz has elevation_m (360, 720), north to south from 89.75, west to east from -179.75. The result: signed
16-bit integers, little-endian, in the same order.
"""

import sys

import numpy as np

open(sys.argv[2], "wb").write(np.load(sys.argv[1])["elevation_m"].astype("<i2").tobytes())

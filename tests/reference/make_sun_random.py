#!/usr/bin/env python3
"""Sun positions by pvlib's SPA at random places and times, to compare ours with.

usage: make_sun_random.py > sun_random.csv        needs pvlib and numpy
"""

import datetime
from importlib.metadata import version

import numpy as np
from pvlib import spa

random = np.random.default_rng(10)
print(
    f"# generator: tests/reference/make_sun_random.py, pvlib {version('pvlib')} (NREL SPA), seed 10, "
    "1900 to 2100, sea level"
)
print(
    "# true topocentric angles in degrees, azimuth clockwise from north; unix_s is seconds since 1970-01-01T00:00Z"
)
print("unix_s,latitude_deg,longitude_deg,azimuth_deg,elevation_deg")
for _ in range(10_000):
    unix = int(random.integers(-2_208_988_800, 4_133_980_799))
    lat = round(float(np.degrees(np.arcsin(random.uniform(-1, 1)))), 3)
    lon = round(float(random.uniform(-180, 180)), 3)
    date = datetime.datetime(1970, 1, 1) + datetime.timedelta(seconds=unix)
    delta_t = spa.calculate_deltat(date.year, date.month)
    sun = spa.solar_position_numpy(
        np.array([float(unix)]), lat, lon, 0, 1013.25, 12, delta_t, 0.5667, 1
    )
    print(f"{unix},{lat},{lon},{sun[4][0]:.4f},{sun[3][0]:.4f}")

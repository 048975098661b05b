#!/usr/bin/env python3
"""Moon positions by astropy (its built-in ephemeris), to compare ours with.

usage: make_moon_positions.py > moon_positions.csv        needs astropy and numpy
"""

import warnings
from importlib.metadata import version

import astropy.units as u
import numpy as np
from astropy.coordinates import AltAz, EarthLocation, get_body, get_sun
from astropy.time import Time
from astropy.utils import iers

iers.conf.auto_download = False
iers.conf.auto_max_age = None
iers.conf.iers_degraded_accuracy = "ignore"
warnings.simplefilter("ignore")

random = np.random.default_rng(4)
print(f"# generator: tests/reference/make_moon_positions.py, astropy {version('astropy')}, seed 4")
print(
    "# true (unrefracted) topocentric angles in degrees, azimuth clockwise from north; distance from the place in km"
)
print("time,latitude_deg,longitude_deg,azimuth_deg,elevation_deg,distance_km,illuminated")
for k in range(120):
    # UT1 is known from 1973 on; half of the times are of those years.
    year = random.integers(1973, 2027) if k % 2 else random.integers(1900, 2101)
    day = f"{year}-{random.integers(1, 13):02}-{random.integers(1, 29):02}"
    text = f"{day}T{random.integers(0, 24):02}:{random.integers(0, 60):02}:00"
    lat = round(float(np.degrees(np.arcsin(random.uniform(-1, 1)))), 3)
    lon = round(float(random.uniform(-180, 180)), 3)
    time = Time(text, scale="utc")
    here = EarthLocation(lat=lat * u.deg, lon=lon * u.deg, height=0 * u.m)
    moon = get_body("moon", time, here)
    seen = moon.transform_to(AltAz(obstime=time, location=here))
    centre, sun = get_body("moon", time), get_sun(time)
    elongation = sun.separation(centre).rad
    far, near = sun.distance.to_value(u.km), centre.distance.to_value(u.km)
    phase = np.arctan2(far * np.sin(elongation), near - far * np.cos(elongation))
    print(
        f"{text}Z,{lat},{lon},{seen.az.deg:.5f},{seen.alt.deg:.5f},"
        f"{moon.distance.to_value(u.km):.1f},{(1 + np.cos(phase)) / 2:.5f}"
    )

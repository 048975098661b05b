#!/usr/bin/env python3
"""Sun positions by pvlib (NREL SPA) and astropy (ERFA), to compare ours with.

usage: make_sun_positions.py > sun_positions.csv        needs pvlib and astropy
"""

import warnings
from importlib.metadata import version

import astropy.units as u
import pandas as pd
import pvlib
from astropy.coordinates import AltAz, EarthLocation, get_sun
from astropy.time import Time
from astropy.utils import iers

iers.conf.auto_download = False
warnings.simplefilter("ignore")

PLACES = [
    (41.65, -0.88, 200.0),
    (39.742476, -105.1786, 1830.14),
    (0.0, 0.0, 0.0),
    (-33.87, 151.21, 50.0),
    (78.22, 15.65, 10.0),
    (-75.1, 123.35, 3233.0),
    (19.536, -155.576, 3397.0),
]
TIMES = [
    "1975-03-20T06:00:00Z",
    "1992-12-21T12:34:56Z",
    "2003-10-17T19:30:30Z",
    "2012-02-29T23:59:59Z",
    "2020-07-04T03:15:00Z",
    "2025-01-04T13:00:00Z",
]

print(
    f"# generator: tests/reference/make_sun_positions.py, pvlib {version('pvlib')}, astropy {version('astropy')}"
)
print(
    "# true (unrefracted) topocentric angles in degrees, azimuth clockwise from north, distance in au"
)
print(
    "time,latitude_deg,longitude_deg,altitude_m,spa_azimuth_deg,spa_elevation_deg,spa_distance_au,"
    "erfa_azimuth_deg,erfa_elevation_deg,erfa_distance_au"
)
for text in TIMES:
    for lat, lon, alt in PLACES:
        when = pd.DatetimeIndex([text])
        spa = pvlib.solarposition.get_solarposition(
            when, lat, lon, altitude=alt, method="nrel_numpy", delta_t=None
        ).iloc[0]
        r = pvlib.solarposition.nrel_earthsun_distance(when, delta_t=None).iloc[0]
        time = Time(text[:-1], scale="utc")
        here = EarthLocation(lat=lat * u.deg, lon=lon * u.deg, height=alt * u.m)
        sun = get_sun(time).transform_to(AltAz(obstime=time, location=here))
        geocentric = get_sun(time).distance.to_value(u.au)
        print(
            f"{text},{lat},{lon},{alt},{spa.azimuth:.6f},{spa.elevation:.6f},{r:.8f},"
            f"{sun.az.deg:.6f},{sun.alt.deg:.6f},{geocentric:.8f}"
        )

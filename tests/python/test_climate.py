"""Places and times by word, and conditions of one or of many."""

from __future__ import annotations

import time
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

import celaje

from .conftest import PLACE, TIME

JULY = "2026-07-16T12:00Z"


def test_places_and_times_have_the_words_of_the_command() -> None:
    c = celaje.climate("Zaragoza", "2026-06-21T20:30", local=True)
    assert c.time is not None
    assert c.time.value == datetime(2026, 6, 21, 18, 30, tzinfo=timezone.utc)
    assert c.local_time is not None
    assert c.local_time.value.utcoffset() == timedelta(hours=2)
    assert c.latitude_deg is not None
    assert c.latitude_deg.reason == "of Zaragoza, Spain"
    assert c.sunset is not None
    sunset = c.sunset.value
    assert sunset is not None
    later = celaje.sky(
        at="Zaragoza", time="2026-06-21 sunset+10min", wavelengths=[550.0]
    ).conditions
    assert later is not None
    assert later.time is not None
    assert abs(later.time.value - sunset - timedelta(minutes=10)) < timedelta(seconds=1)
    now = celaje.climate("Quito", "now").time
    assert now is not None
    assert abs(now.value - datetime.now(timezone.utc)) < timedelta(minutes=1)
    # A datetime64 has no zone: it is UTC; a datetime without one is a mistake, unless it is local.
    utc = celaje.climate(PLACE, np.datetime64("2026-06-21T18:30"))
    assert utc.time == c.time
    naive = datetime(2026, 6, 21, 20, 30)
    assert celaje.climate("Zaragoza", naive, local=True).time == c.time
    with pytest.raises(celaje.InvalidInputError, match="time zone"):
        celaje.climate("Zaragoza", naive)
    east = celaje.climate((41.65, 359.12), TIME).longitude_deg
    assert east is not None
    assert east.value == pytest.approx(-0.88)


@pytest.mark.parametrize(
    ("place", "when", "message", "hint"),
    [
        ("Zaragosza", TIME, "no city 'Zaragosza'", "Zaragoza, Spain"),
        ("Valencia", TIME, "'Valencia' is ambiguous", "Valencia, Venezuela"),
        ("Murmansk", "2026-06-21 sunset", "polar day", "another date"),
        ("Zaragoza", "teatime", "sun event 'teatime'", "civil dusk"),
        ("Zaragoza", "1850-06-21 noon", "year = 1850", "[1900, 2100]"),
        ((0.0, 400.0), TIME, "longitude = 400", "[-360, 360]"),
        (5, TIME, "at = 5 is not understood", "Zaragoza"),
        ([], TIME, "at is empty", "one at least"),
        ([(1.0, 2.0, 3.0)], TIME, "the place", "latitude and longitude"),
        (PLACE, 5, "time = 5 is not understood", "2026-06-21T18:30Z"),
        (PLACE, [5], "the time 5", "datetime"),
        (PLACE, np.array(["NaT"], dtype="datetime64[s]"), "NaT", "leave it out"),
    ],
)
def test_what_cannot_be_is_told(place: object, when: object, message: str, hint: str) -> None:
    with pytest.raises(celaje.CelajeError, match=message) as caught:
        celaje.climate(place, when)  # type: ignore[call-overload]
    assert hint in str(caught.value)


def test_words_that_do_not_exist_are_refused() -> None:
    with pytest.raises(TypeError, match="'aersol'"):
        celaje.climate(PLACE, TIME, aersol="desert")  # type: ignore[call-overload]
    with pytest.raises(celaje.UnknownNameError, match="desert"):
        celaje.climate(PLACE, TIME, aerosol="desart")
    with pytest.raises(celaje.UnknownNameError, match="volcanic"):
        celaje.climate([PLACE], TIME, stratosphere="volcano")


def test_conditions_are_a_table_a_dict_and_a_dataset() -> None:
    c = celaje.climate(PLACE, TIME)
    lines = repr(c).splitlines()
    assert lines[0].split() == ["CONDITION", "VALUE", "±", "UNIT", "REASON", "[SOURCE]"]
    assert len(lines) == 1 + len(list(c))
    ozone = next(line for line in lines if line.startswith("ozone_du"))
    assert ozone.split()[1:4] == [f"{c.ozone_du.value:.1f}", f"{c.ozone_du.uncertainty:.2g}", "DU"]
    altitude = next(line for line in lines if line.startswith("altitude_m"))
    assert altitude.split()[2] == f"{c.altitude_m.uncertainty:.0f}"
    table = c.to_dict()
    assert list(table) == [name for name, _ in c]
    assert set(table["aod_550"]) == {"value", "unit", "uncertainty", "source", "reason"}
    assert table["aod_550"]["uncertainty"] > 0.01
    data = c.xarray()
    assert float(data.ozone_du) == c.ozone_du.value
    assert data.ozone_du.attrs["units"] == "DU"
    assert data.time.dtype.kind == "M"
    polar = celaje.climate("Murmansk", "2026-06-21T12:00Z")
    assert polar.sunset is not None
    assert polar.sunset.value is None
    assert "polar day" in polar.sunset.reason
    assert np.isnat(polar.xarray().sunset.values)
    hazy = celaje.climate(PLACE, TIME, visibility=20)
    assert np.isnan(hazy.aod_550.value)
    assert hazy.visibility_km is not None
    assert hazy.visibility_km.value == 20


def test_many_places_and_times() -> None:
    places: list[str | tuple[float, float]] = ["Oslo, Norway", PLACE, (-90.0, 0.0)]
    times = ["2026-01-16T12:00Z", JULY]
    table = celaje.climate(places, times, altitude=100)
    assert table.dims == ("place", "time")
    for i, place in enumerate(places):
        for j, when in enumerate(times):
            single = celaje.climate(place, when, altitude=100)
            for name in ("ozone_du", "sun_elevation_deg", "aod_550", "albedo", "water_mm"):
                one = getattr(single, name)
                assert table[name][i, j] == one.value
                assert (f"{name}_uncertainty" in table) == (one.uncertainty is not None)
            assert single.moon_elevation_deg is not None
            assert table["moon_elevation_deg"][i, j] == single.moon_elevation_deg.value
            assert single.aerosol_type is not None
            assert table["aerosol_type"][i, j] == single.aerosol_type.value
    data = table.xarray()
    assert data.ozone_du.dims == ("place", "time")
    assert data.ozone_du.attrs["units"] == "DU"
    assert float(data.ozone_du.sel(place="Oslo, Norway").isel(time=1)) == table["ozone_du"][0, 1]
    assert "least" in repr(table).lower()
    assert "aerosol_type" in repr(table)
    with pytest.raises(celaje.UnknownNameError, match="known: "):
        table["ozone"]
    assert "ozone" not in table

    # The same word is another instant elsewhere.
    dusk = celaje.climate(["Madrid", "Tokyo"], "2026-06-21 sunset")
    assert dusk.dims == ("place",)
    assert dusk.time.shape == (2, 1)
    assert np.all(np.abs(dusk["sun_elevation_deg"] + 0.833) < 0.01)
    assert dusk.xarray().instant.dims == ("place",)
    alone = celaje.climate([PLACE], [JULY])
    assert alone["ozone_du"].shape == (1, 1)


def test_a_year_of_hours_takes_less_than_a_second() -> None:
    """Of processor time, all threads together."""
    year = np.arange("2026-01-01", "2027-01-01", dtype="datetime64[h]")
    celaje.climate("Zaragoza", year[:1])
    start = time.process_time()
    table = celaje.climate("Zaragoza", year)
    spent = time.process_time() - start
    print(f"a year of hours: {spent:.2f} s")
    assert table.dims == ("time",)
    assert table["aod_550"].shape == (8760,)
    assert np.array_equal(table.time, year)
    assert spent < 1.0
    noon = table["sun_elevation_deg"].reshape(365, 24).max(axis=1)
    assert noon.argmax() == pytest.approx(171, abs=3)
    assert table.xarray().sizes == {"time": 8760}

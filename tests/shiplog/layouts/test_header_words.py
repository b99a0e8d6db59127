"""Words of headers: quantities, sides and units."""

import pytest

from shiplog.layouts.header_words import is_units_row, recognise, split_header
from shiplog.units import CATALOGUE


@pytest.mark.parametrize(
    ("header", "role", "unit"),
    [
        ("HDT [deg]", "heading", "deg"), ("rot_dps", "yaw_rate", "deg/s"),
        ("Rudder (port)", "rudder.port", ""), ("Fahrt [kn]", "speed", "kn"),
        ("Shaft RPM Stbd", "rpm.starboard", ""), ("N/S", "north_south", ""),
        ("Drehzahl [1/min]", "rpm", "rpm"), ("Length", None, ""),
        ("GPS1 Latitude", "latitude.gps1", ""), ("lon_2", "longitude.2", ""),
        ("Lat1", "latitude.1", ""), ("Longitude (stern)", "longitude.stern", ""),
        ("DGPS 2 Lat N/S", "north_south.dgps2", ""), ("lat port", "latitude.port", ""),
        ("gps_speed", "speed_over_ground", ""), ("lat_error", None, ""),
        ("lat_b", "latitude.b", ""),
    ],
)  # fmt: skip
def test_a_header_gives_quantity_side_and_unit(header: str, role: str | None, unit: str) -> None:
    words, stated = split_header(header)
    assert stated == unit
    assert list(recognise({header: words}, ())) == ([role] if role else [])


@pytest.mark.parametrize("name", [name for name in CATALOGUE if name != "position"])
def test_the_name_of_a_channel_is_recognised_as_a_header(name: str) -> None:
    unit = CATALOGUE[name].display_unit
    words, stated = split_header(f"{name} [{unit}]")
    assert stated == unit
    assert recognise({"x": words}, ()) == {name: "x"}


@pytest.mark.parametrize(
    ("row", "following", "expected"),
    [
        (["", "deg", "knots"], ["x", "1", "2"], True),
        (["[s]", "[deg]", "[-]"], ["0", "1", "2"], True),
        (["0", "1", "kn"], ["1", "1", "kn"], False),
        (["", "", ""], ["0", "1", "2"], False),
        (["nan", "nan", "NA"], ["0", "1", "2"], False),
    ],
)
def test_a_row_of_units_has_units_and_no_numbers(
    row: list[str], following: list[str], expected: bool
) -> None:
    assert is_units_row(row, following) is expected

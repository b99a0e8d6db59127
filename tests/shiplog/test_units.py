import re
from itertools import product
from math import pi

import pytest
from places import PROJECT

from shiplog import UsageError
from shiplog.units import (
    CATALOGUE,
    UNITS,
    channel_kind,
    conversion_factor,
    did_you_mean,
    display_conversion,
)


@pytest.mark.parametrize(
    ("value", "unit", "to", "expected"),
    [
        (180.0, "deg", "rad", pi),
        (6.0, "deg/min", "deg/s", 0.1),
        (1.0, "kn", "m/s", 0.5144444444444445),
        (36.0, "km/h", "m/s", 10.0),
        (1.0, "nmi", "km", 1.852),
        (10.0, "ft", "m", 3.048),
        (2.0, "rev/s", "rpm", 120.0),
        (1.0, "h", "min", 60.0),
        (1e9, "ns", "s", 1.0),
        (1.0, "ms", "us", 1000.0),
        (2.0, "kN·m", "Nm", 2000.0),
        (2.0, "MN.m", "kNm", 2000.0),
    ],
)
def test_units_convert_by_their_definitions(
    value: float, unit: str, to: str, expected: float
) -> None:
    assert value * conversion_factor(unit, to) == pytest.approx(expected, rel=1e-15)


def test_a_conversion_and_its_inverse_cancel() -> None:
    for unit, to in product(UNITS, UNITS):
        if UNITS[unit][0] == UNITS[to][0]:
            assert conversion_factor(unit, to) * conversion_factor(to, unit) == pytest.approx(
                1, rel=1e-15
            )


def test_a_unit_converts_to_itself_with_factor_one() -> None:
    assert all(conversion_factor(unit, unit) == 1.0 for unit in UNITS)


def test_units_of_different_quantities_are_not_converted() -> None:
    with pytest.raises(UsageError, match=r"cannot convert 'deg' to 'm': .* rad and m"):
        conversion_factor("deg", "m")


def test_an_unknown_unit_is_reported_with_the_nearest_known_unit() -> None:
    with pytest.raises(UsageError, match=r"unknown unit 'rad/sec'; did you mean 'rad/s'\?; known"):
        conversion_factor("rad/sec", "rad/s")
    with pytest.raises(UsageError, match="unknown unit 'furlong'; known are"):
        conversion_factor("m", "furlong")


def test_every_channel_except_rpm_is_in_si_and_has_a_display_unit() -> None:
    for name, kind in CATALOGUE.items():
        assert kind.name == name
        assert kind.unit == "rpm" or UNITS[kind.unit] == (kind.unit, 1.0)
        assert conversion_factor(kind.unit, kind.display_unit) > 0
        assert kind.lowest < kind.highest
        assert kind.positive


def test_every_channel_has_its_row_in_the_page_of_the_format() -> None:
    page = (PROJECT / "docs" / "format.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| (\S+) \| .* \|$", page, flags=re.MULTILINE))
    assert {name: rows.get(name) for name in CATALOGUE} == {
        name: kind.unit for name, kind in CATALOGUE.items()
    }


def test_rudder_and_rpm_are_commanded_and_compass_angles_are_circular() -> None:
    assert {name for name, kind in CATALOGUE.items() if kind.commanded} == {"rudder", "rpm"}
    circular = {name for name, kind in CATALOGUE.items() if kind.circular}
    assert circular == {
        "heading",
        "magnetic_heading",
        "heading_order",
        "wind_direction",
        "apparent_wind_angle",
        "true_wind_angle",
        "course_over_ground",
    }


@pytest.mark.parametrize(
    ("name", "unit", "shown", "factor"),
    [
        ("yaw_rate", "rad/s", "deg/s", 180 / pi),
        ("power", "kW", "kW", 1.0),
        ("power", "MW", "kW", 1000.0),
        ("hull_power", "W", "kW", 1e-3),
        ("thruster_azimuth", "rad", "deg", 180 / pi),
        ("power", "litre/h", "litre/h", 1.0),
        ("fuel_flow", "kg/h", "kg/h", 1.0),
    ],
)
def test_any_channel_is_shown_in_the_unit_people_use(
    name: str, unit: str, shown: str, factor: float
) -> None:
    assert display_conversion(name, unit) == (shown, pytest.approx(factor))


def test_a_channel_kind_is_found_by_name_or_the_nearest_is_suggested() -> None:
    assert channel_kind("speed").unit == "m/s"
    with pytest.raises(UsageError, match=r"no channel is called 'yaw-rate'; did you mean"):
        channel_kind("yaw-rate")


def test_a_name_is_suggested_only_if_it_is_similar() -> None:
    assert did_you_mean("xyzzy", CATALOGUE) == ""
    assert did_you_mean("ruder", CATALOGUE) == "; did you mean 'rudder'?"

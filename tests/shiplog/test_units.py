from itertools import product
from math import pi

import pytest

from shiplog import UsageError
from shiplog.units import CATALOGUE, UNITS, conversion_factor, did_you_mean, kind_of


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
    ],
)
def test_units_convert_by_their_definitions(
    value: float, unit: str, to: str, expected: float
) -> None:
    assert value * conversion_factor(unit, to) == pytest.approx(expected, rel=1e-15)


def test_there_and_back_is_where_one_was() -> None:
    for unit, to in product(UNITS, UNITS):
        if UNITS[unit][0] == UNITS[to][0]:
            assert conversion_factor(unit, to) * conversion_factor(to, unit) == pytest.approx(
                1, rel=1e-15
            )


def test_a_unit_is_exactly_itself() -> None:
    assert all(conversion_factor(unit, unit) == 1.0 for unit in UNITS)


def test_what_does_not_measure_the_same_is_not_converted() -> None:
    with pytest.raises(UsageError, match=r"'deg' cannot be turned into 'm'"):
        conversion_factor("deg", "m")


def test_an_unknown_unit_is_named_with_the_nearest_known() -> None:
    with pytest.raises(UsageError, match=r"unknown unit 'rad/sec'; did you mean 'rad/s'\?; known"):
        conversion_factor("rad/sec", "rad/s")
    with pytest.raises(UsageError, match="unknown unit 'furlong'; known are"):
        conversion_factor("m", "furlong")


def test_every_channel_is_in_si_but_rpm_and_can_be_shown() -> None:
    for name, kind in CATALOGUE.items():
        assert kind.name == name
        assert kind.unit == "rpm" or UNITS[kind.unit] == (kind.unit, 1.0)
        assert conversion_factor(kind.unit, kind.display_unit) > 0
        assert kind.lowest < kind.highest
        assert kind.positive


def test_the_rudder_and_the_propeller_are_commanded_and_angles_of_the_compass_wrap() -> None:
    assert {name for name, kind in CATALOGUE.items() if kind.commanded} == {"rudder", "rpm"}
    assert {"heading", "wind_direction"} == {n for n, kind in CATALOGUE.items() if kind.circular}


def test_a_channel_is_found_by_name_or_the_nearest_is_offered() -> None:
    assert kind_of("speed").unit == "m/s"
    with pytest.raises(UsageError, match=r"no channel is called 'yaw-rate'; did you mean"):
        kind_of("yaw-rate")


def test_nothing_is_offered_where_nothing_is_near() -> None:
    assert did_you_mean("xyzzy", CATALOGUE) == ""
    assert did_you_mean("ruder", CATALOGUE) == "; did you mean 'rudder'?"

"""Vessel files: coefficients and their units, presets, and the errors of a file."""

from dataclasses import replace
from math import pi, radians
from pathlib import Path

import pytest

from shiplog import UsageError, Vessel, VesselError, load_vessel
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.settings import FilterSettings
from shiplog.vessel.vessel import with_length
from shiplog.vessel.vessel_parser import parse_vessel

DEG = 180 / pi  # degrees in a radian

TIMES = """
[yaw]
T1 = 100.0
T2 = 20.0
T3 = 2.0
c2 = 1.0
c3 = 2.0
"""
REST = """
[rudder]
alpha1 = 0.01
alpha2 = 0.002
alpha3 = 0.03
[surge]
f = -1.0
g = -0.001
h = 0.0005
"""
PRODUCTS = """
[yaw]
a = -0.1
b1 = -0.002
b2 = -0.3
b3 = -4.0
d = 0.005
e = 0.06
"""


def error_of(text: str) -> str:
    with pytest.raises(VesselError) as caught:
        parse_vessel(text, "ship.toml")
    return str(caught.value)


def test_the_paper_table_read_in_radians_gives_its_printed_coefficients() -> None:
    c = load_vessel("table1-rad")[0].coefficients
    assert c == pytest.approx(
        (
            *(-0.0266667, -1.33333e-4, -1.33333e-3, -2.66667e-3, 1.33333e-4, 6.66667e-5),
            *(-0.1, -0.0003, 0.0004),
            *(0.0171, 0.0015, 0.0654),
        ),
        rel=3e-6,
    )
    assert c.b1 == -c.d
    assert c.e == pytest.approx(0.5 * c.d, rel=1e-15)


def test_the_paper_table_read_in_degrees_scales_with_the_powers_of_the_angle() -> None:
    deg, rad = (load_vessel(name)[0].coefficients for name in ("table1", "table1-rad"))
    assert deg.b2 == pytest.approx(rad.b2 * DEG)
    assert deg.b3 == pytest.approx(rad.b3 * DEG**2)
    assert deg.f == pytest.approx(rad.f * DEG**2)
    scaled = {"b2", "b3", "f"}
    for name in set(deg._fields) - scaled:
        assert getattr(deg, name) == getattr(rad, name)


@pytest.mark.parametrize("preset", PRESETS)
def test_a_preset_is_complete_and_gives_its_own_text(preset: str) -> None:
    vessel, text = load_vessel(preset)
    assert text == PRESETS[preset]
    assert vessel.rudder_max == pytest.approx(radians(35))
    assert vessel.rudder_rate == pytest.approx(radians(2.5))
    assert vessel.approach_rpm == 80
    assert vessel.filter == FilterSettings(process_ratio=0.01 / 400)


def test_a_file_is_read_with_its_text(tmp_path: Path) -> None:
    path = tmp_path / "ship.toml"
    path.write_text(TIMES + REST, encoding="utf-8")
    vessel, text = load_vessel(path)
    assert text == TIMES + REST
    assert vessel.name == "ship"
    assert vessel.coefficients.a == pytest.approx(-(100 + 20) / 2000)
    assert vessel.coefficients.e == pytest.approx(2 / 2000)
    assert vessel.filter == FilterSettings()


def test_products_are_read_unchanged() -> None:
    c = parse_vessel(PRODUCTS + REST, "ship.toml").coefficients
    assert c[:6] == (-0.1, -0.002, -0.3, -4.0, 0.005, 0.06)


def test_products_in_degrees_scale_as_the_time_constants_do() -> None:
    c = parse_vessel('angle_unit = "deg"' + PRODUCTS + REST, "ship.toml").coefficients
    assert c.b2 == pytest.approx(-0.3 * DEG)
    assert c.b3 == pytest.approx(-4.0 * DEG**2)
    assert c.d == 0.005


def test_time_constants_and_products_give_the_same_ship() -> None:
    given = parse_vessel(TIMES + REST, "ship.toml").coefficients
    products = "".join(
        f"{k} = {v!r}\n" for k, v in given._asdict().items() if k in "a b1 b2 b3 d e"
    )
    again = parse_vessel(f"[yaw]\n{products}{REST}", "ship.toml").coefficients
    assert again == given


def test_all_errors_are_reported_at_once_in_one_line() -> None:
    text = (TIMES + REST).replace("T1 = 100.0", "T1 = -5.0").replace("h = 0.0005", 'h = "fast"')
    message = error_of(text + "[filter]\nspeed_sdt = 0.1\n")
    assert message.startswith("3 errors in the vessel file: ")
    assert "yaw.T1 must be positive, got -5" in message
    assert "surge.h must be a number, got 'fast'" in message
    assert "unknown key 'filter.speed_sdt', did you mean 'speed_std'?" in message
    assert message.endswith(": ship.toml")
    assert "\n" not in message


def test_a_single_error_is_counted_as_one() -> None:
    assert error_of((TIMES + REST).replace("h = 0.0005", "")) == (
        "one error in the vessel file: [surge] lacks h: ship.toml"
    )


def test_a_mixture_of_both_forms_is_an_error_that_lists_both() -> None:
    message = error_of(TIMES + "a = -0.1\n" + REST)
    assert "[yaw] mixes time constants (T1, T2, T3, c2, c3) with products (a)" in message


@pytest.mark.parametrize("number", ["nan", "inf", "-inf"])
def test_a_number_that_is_not_finite_is_an_error(number: str) -> None:
    text = (TIMES + REST).replace("c2 = 1.0", f"c2 = {number}")
    assert f"yaw.c2 must be finite, got {number}" in error_of(text)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("T2 = 20.0", "T2 = 0", "yaw.T2 must be positive, got 0"),
        ("T2 = 20.0", "T2 = 1e-200", "yaw.T2 must lie between"),
        ("T2 = 20.0", "T2 = true", "yaw.T2 must be a number, got True"),
        ("[surge]", "max = 0.0\n[surge]", "rudder.max must be positive"),
        ("[yaw]", "length = 2000\n[yaw]", "length must lie between 0 and 1000, got 2000"),
        ("[yaw]", 'angle_unit = "grad"\n[yaw]', "angle_unit must be 'deg' or 'rad', got 'grad'"),
        ("[yaw]", "angle_unit = [1]\n[yaw]", "angle_unit must be 'deg' or 'rad'"),
        ("[yaw]", "name = 3\n[yaw]", "name must be a string"),
        ("[yaw]", "aproach_rpm = 3\n[yaw]", "unknown key 'aproach_rpm', did you mean"),
        ("[surge]", "[surges]", "unknown key 'surges', did you mean 'surge'?"),
        ("[yaw]", "filter = 1\n[yaw]", "[filter] must be a section"),
        ("[surge]", "[filter]\nspeed_std = -1\n[surge]", "filter.speed_std must be positive"),
    ],
)
def test_an_error_names_the_key_and_the_value(old: str, new: str, message: str) -> None:
    assert message in error_of((TIMES + REST).replace(old, new))


def test_an_empty_file_is_an_error() -> None:
    assert "the vessel file is empty" in error_of("")


@pytest.mark.parametrize("length", ["", "length = 320.0\n"])
@pytest.mark.parametrize("gear", ["", "[rudder]\nmax = 0.6\nrate = 0.04\n"])
def test_any_part_of_a_ship_may_be_given_alone(length: str, gear: str) -> None:
    vessel = parse_vessel(f"name = 'a ship'\n{length}{gear}", "ship.toml")
    assert (vessel.name, vessel.coefficients, vessel.model) == ("a ship", None, None)
    assert vessel.length == (320.0 if length else None)
    assert vessel.rudder_max == (0.6 if gear else Vessel("", None).rudder_max)
    assert vessel.rudder_rate == (0.04 if gear else Vessel("", None).rudder_rate)


def test_a_misspelt_length_alone_is_an_error() -> None:
    assert "did you mean 'length'" in error_of("lenght = 320.0")


def test_a_length_given_precedes_that_of_the_vessel() -> None:
    vessel = parse_vessel("length = 320.0", "ship.toml")
    assert with_length(vessel, 7.0) == replace(vessel, length=7.0)
    assert with_length(vessel, None) is vessel


@pytest.mark.parametrize("length", [0.0, -320.0, 1e9, float("nan"), float("inf")])
def test_an_impossible_length_is_a_usage_error(length: float) -> None:
    with pytest.raises(UsageError, match="length must"):
        with_length(None, length)


def test_a_text_that_is_not_toml_is_an_error_with_its_line() -> None:
    assert "line 2" in error_of("[yaw]\nT1 = = 3")


def test_a_missing_file_offers_the_nearest_preset() -> None:
    with pytest.raises(VesselError, match=r"did you mean 'table1'\?; presets are table1, table1-r"):
        load_vessel("tabel1")


def test_a_file_that_cannot_be_read_as_text_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(VesselError, match="cannot read the vessel file"):
        load_vessel(tmp_path)
    (tmp_path / "ship.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(VesselError, match="cannot read the vessel file"):
        load_vessel(tmp_path / "ship.toml")


def test_rudder_limits_are_in_the_files_angle_unit() -> None:
    text = (TIMES + REST).replace("[surge]", "max = 30\nrate = 3\n[surge]")
    vessel = parse_vessel('angle_unit = "deg"' + text, "ship.toml")
    assert vessel.rudder_max == pytest.approx(radians(30))
    assert vessel.rudder_rate == pytest.approx(radians(3))

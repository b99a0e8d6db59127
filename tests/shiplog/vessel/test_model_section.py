"""`[model]` of a vessel file: its values, its errors, and the sections it goes with."""

from math import radians

import pytest
from model_ships import LENGTH, RPM, SHIPS, SPEED, toml_of
from places import PROJECT

from shiplog import VesselError, load_vessel
from shiplog.ships import ship_model
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.ship import ship_from_vessel
from shiplog.vessel.vessel_parser import parse_vessel

TEXT = toml_of("three-dof")


def error_of(text: str) -> str:
    with pytest.raises(VesselError) as caught:
        parse_vessel(text, "ship.toml")
    return str(caught.value)


@pytest.mark.parametrize("name", SHIPS)
def test_a_model_without_the_papers_is_simulated(name: str) -> None:
    vessel = parse_vessel(toml_of(name), "ship.toml")
    ship = ship_from_vessel(vessel)
    assert ship.model is ship_model(name)
    assert ship.coefficients._asdict().items() >= SHIPS[name].items()
    assert (ship.scale.secs, ship.scale.speed, ship.scale.rpm) == (LENGTH / SPEED, SPEED, RPM)
    assert vessel.coefficients is None
    with pytest.raises(VesselError, match=f"lacks the coefficients.*: a {name}"):
        _ = vessel.paper_coefficients


def test_without_a_model_section_the_papers_model_is_simulated() -> None:
    vessel = load_vessel("table1")[0]
    assert vessel.model is None
    assert ship_from_vessel(vessel).coefficients == vessel.coefficients


def test_with_both_models_that_of_the_model_section_is_simulated() -> None:
    both = parse_vessel(f"length = 180.0\n{PRESETS['table1']}{model_text()}", "ship.toml")
    assert both.coefficients == load_vessel("table1")[0].coefficients
    assert ship_from_vessel(both).model.name == "three-dof"
    assert both.rudder_max == pytest.approx(radians(35))


def model_text() -> str:
    return "\n" + TEXT[TEXT.index("[model]") :]


def test_the_steering_gear_can_be_given_beside_a_model() -> None:
    gear = parse_vessel(TEXT + "[rudder]\nmax = 0.5\nrate = 0.05\n", "ship.toml")
    assert gear.coefficients is None
    assert (gear.rudder_max, gear.rudder_rate) == (0.5, 0.05)


def test_angles_of_a_model_are_in_radians_whatever_the_unit_of_the_file() -> None:
    in_degrees = parse_vessel('angle_unit = "deg"\n' + TEXT, "ship.toml")
    assert in_degrees.model == parse_vessel(TEXT, "ship.toml").model


def test_an_incomplete_paper_model_beside_a_model_is_an_error() -> None:
    assert "[yaw] lacks T1, T2, T3, c2, c3; [surge] lacks f, g, h" in error_of(
        TEXT + "[rudder]\nalpha1 = 0.01\nalpha2 = 0.01\nalpha3 = 0.01\n"
    )


def test_all_errors_are_reported_at_once_in_one_line() -> None:
    text = TEXT.replace("yv = -0.75", "yv = 0.75").replace("nd = 1.0", "ndd = 1.0")
    text = text.replace("rpm = 90.0\ny", "rpm = nan\ny").replace(f"length = {LENGTH}\n", "")
    message = error_of(text + "[filter]\ngate = -1\n")
    assert message.startswith("6 errors in the vessel file: ")
    assert "model.yv must lie between -5 and 0, got 0.75" in message
    assert "unknown key 'model.ndd', did you mean 'nd'?" in message
    assert "[model] lacks nd" in message
    assert "model.rpm must be finite, got nan" in message
    assert "length is missing: the parameters of three-dof are without dimensions" in message
    assert "filter.gate must be positive" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"three-dof"', '"tree-dof"', "got 'tree-dof', did you mean 'three-dof'?"),
        (
            '"three-dof"',
            "3",
            "model.name must be one of drift-lag, mmg, nomoto, norrbin, slipstream, three-dof,",
        ),
        ('name = "three-dof"', "", "but [model] has none"),
        ('"three-dof"', '"burylin"', "'burylin' is not allowed, this model is given by [yaw]"),
        ("speed = 8.0", "speed = 0.0", "model.speed must be positive, got 0"),
        ("rpm = 90.0\ny", "rpm = -3\ny", "model.rpm must be positive, got -3"),
        ("speed = 8.0\n", "", "[model] lacks speed"),
        ("length = 180.0", "length = -1", "one error in the vessel file: length must be positive"),
        ("h = 0.05", 'h = "fast"', "model.h must be a number, got 'fast'"),
        ("x4 = 1.5", "x4 = inf", "model.x4 must be finite, got inf"),
        ("w = 0.4", "w = 1.5", "model.w must lie between 0 and 1, got 1.5"),
        ("[model]", "model = 3\n[models]", "[model] must be a section"),
        ("[model]", "[modell]", "unknown key 'modell', did you mean 'model'?"),
    ],
)
def test_an_error_names_the_key_and_the_value(old: str, new: str, message: str) -> None:
    assert old in TEXT
    assert message in error_of(TEXT.replace(old, new))


def test_a_model_that_is_not_a_section_is_a_single_error() -> None:
    assert error_of("model = 3\n") == (
        "one error in the vessel file: [model] must be a section: ship.toml"
    )


def test_the_examples_of_the_documentation_are_valid() -> None:
    text = (PROJECT / "docs" / "vessel.md").read_text(encoding="utf-8")
    _, papers, own = (block.partition("```\n")[0] for block in text.split("```toml\n"))
    assert parse_vessel(own, "docs").model is not None
    assert parse_vessel(papers.replace("as_printed = false", ""), "docs").length == 200.0

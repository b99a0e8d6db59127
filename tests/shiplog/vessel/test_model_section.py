"""`[model]` of a vessel file: what it holds, what is wrong with it, what may stand beside it."""

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


def fault_of(text: str) -> str:
    with pytest.raises(VesselError) as caught:
        parse_vessel(text, "ship.toml")
    return str(caught.value)


@pytest.mark.parametrize("name", SHIPS)
def test_a_model_alone_is_a_vessel_that_sails_by_it(name: str) -> None:
    vessel = parse_vessel(toml_of(name), "ship.toml")
    ship = ship_from_vessel(vessel)
    assert ship.model is ship_model(name)
    assert ship.coefficients._asdict().items() >= SHIPS[name].items()
    assert (ship.scale.secs, ship.scale.speed, ship.scale.rpm) == (LENGTH / SPEED, SPEED, RPM)
    assert vessel.coefficients is None
    with pytest.raises(VesselError, match=f"has a .model. alone.*too: a {name}"):
        _ = vessel.paper_coefficients


def test_without_a_model_of_its_own_she_sails_by_the_papers() -> None:
    vessel = load_vessel("table1")[0]
    assert vessel.model is None
    assert ship_from_vessel(vessel).coefficients == vessel.coefficients


def test_both_may_stand_there_and_she_sails_by_her_own() -> None:
    both = parse_vessel(f"length = 180.0\n{PRESETS['table1']}{own_section()}", "ship.toml")
    assert both.coefficients == load_vessel("table1")[0].coefficients
    assert ship_from_vessel(both).model.name == "three-dof"
    assert both.rudder_max == pytest.approx(radians(35))


def own_section() -> str:
    return "\n" + TEXT[TEXT.index("[model]") :]


def test_the_steering_gear_may_stand_beside_a_model_alone() -> None:
    gear = parse_vessel(TEXT + "[rudder]\nmax = 0.5\nrate = 0.05\n", "ship.toml")
    assert gear.coefficients is None
    assert (gear.rudder_max, gear.rudder_rate) == (0.5, 0.05)


def test_angles_of_a_model_are_in_radians_whatever_those_of_the_file_are() -> None:
    in_degrees = parse_vessel('angle_unit = "deg"\n' + TEXT, "ship.toml")
    assert in_degrees.model == parse_vessel(TEXT, "ship.toml").model


def test_half_of_the_papers_model_beside_a_model_is_a_fault() -> None:
    assert "[yaw] lacks T1, T2, T3, c2, c3; [surge] lacks f, g, h" in fault_of(
        TEXT + "[rudder]\nalpha1 = 0.01\nalpha2 = 0.01\nalpha3 = 0.01\n"
    )


def test_all_faults_are_named_at_once_in_one_line() -> None:
    text = TEXT.replace("yv = -0.75", "yv = 0.75").replace("nd = 1.0", "ndd = 1.0")
    text = text.replace("rpm = 90.0\ny", "rpm = nan\ny").replace(f"length = {LENGTH}\n", "")
    message = fault_of(text + "[filter]\ngate = -1\n")
    assert message.startswith("6 faults in the vessel file: ")
    assert "model.yv must lie between -5 and 0, got 0.75" in message
    assert "unknown key 'model.ndd', did you mean 'nd'?" in message
    assert "[model] lacks nd" in message
    assert "model.rpm must be finite, got nan" in message
    assert "length is missing: three-dof is written without dimensions" in message
    assert "filter.gate must be positive" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"three-dof"', '"tree-dof"', "got 'tree-dof', did you mean 'three-dof'?"),
        (
            '"three-dof"',
            "3",
            "model.name must be one of drift-lag, nomoto, norrbin, slipstream, three-dof,",
        ),
        ('name = "three-dof"', "", "but [model] has none"),
        ('"three-dof"', '"burylin"', "'burylin': it stands in [yaw], [surge] and [rudder]"),
        ("speed = 8.0", "speed = 0.0", "model.speed must be positive, got 0"),
        ("rpm = 90.0\ny", "rpm = -3\ny", "model.rpm must be positive, got -3"),
        ("speed = 8.0\n", "", "[model] lacks speed"),
        ("length = 180.0", "length = -1", "one fault in the vessel file: length must be positive"),
        ("h = 0.05", 'h = "fast"', "model.h must be a number, got 'fast'"),
        ("x4 = 1.5", "x4 = inf", "model.x4 must be finite, got inf"),
        ("w = 0.4", "w = 1.5", "model.w must lie between 0 and 1, got 1.5"),
        ("[model]", "model = 3\n[models]", "[model] must be a section"),
        ("[model]", "[modell]", "unknown key 'modell', did you mean 'model'?"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, says: str) -> None:
    assert old in TEXT
    assert says in fault_of(TEXT.replace(old, new))


def test_a_model_that_is_no_section_is_not_asked_for_its_name() -> None:
    assert fault_of("model = 3\n") == (
        "one fault in the vessel file: [model] must be a section: ship.toml"
    )


def test_the_example_of_the_documentation_is_one() -> None:
    text = (PROJECT / "docs" / "vessel.md").read_text(encoding="utf-8")
    _, papers, own = (block.partition("```\n")[0] for block in text.split("```toml\n"))
    assert parse_vessel(own, "docs").model is not None
    assert parse_vessel(papers.replace("as_printed = false", ""), "docs").length == 200.0

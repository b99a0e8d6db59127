"""`[hull]` of a vessel file: its values, its errors, and what follows from them."""

import pytest

from shiplog import VesselError
from shiplog.vessel.hull import Hull, hull_dict
from shiplog.vessel.vessel_parser import parse_vessel

TEXT = """
length = 200.0

[hull]
breadth = 32.0
draught_forward = 9.5
draught_aft = 10.5
block_coefficient = 0.7
rudder_area = 36.0
rudder_height = 8.0
propeller_diameter = 7.0
propeller_pitch_ratio = 0.8
propeller_turning = "right"
"""


def error_of(text: str) -> str:
    with pytest.raises(VesselError) as caught:
        parse_vessel(text, "ship.toml")
    return str(caught.value)


def test_every_dimension_is_read_in_its_unit() -> None:
    hull = parse_vessel(TEXT, "ship.toml").hull
    assert hull == Hull(
        breadth=32.0, draught_forward=9.5, draught_aft=10.5, block_coefficient=0.7,
        rudder_area=36.0, rudder_height=8.0, propeller_diameter=7.0, propeller_pitch_ratio=0.8,
        propeller_turning="right",
    )  # fmt: skip
    assert hull.mean_draught == 10.0
    assert hull.aspect_ratio == pytest.approx(64 / 36)


def test_a_file_without_the_section_has_a_hull_of_which_nothing_is_known() -> None:
    hull = parse_vessel("length = 200.0", "ship.toml").hull
    assert (hull, hull_dict(hull)) == (Hull(), {})
    assert (hull.mean_draught, hull.aspect_ratio, hull.fullness(200.0)) == (None, None, None)


def test_what_is_known_of_a_hull_is_a_section_that_gives_it_again() -> None:
    hull = parse_vessel(TEXT, "ship.toml").hull
    lines = "\n".join(f"{key} = {value!r}" for key, value in hull_dict(hull).items())
    assert parse_vessel(f"[hull]\n{lines}\n", "ship.toml").hull == hull


def test_a_displacement_gives_the_block_coefficient_once_all_dimensions_are_known() -> None:
    hull = Hull(breadth=32.0, draught=10.0, displacement=1.025 * 0.8 * 200 * 32 * 10)
    assert hull.fullness(200.0) == pytest.approx(0.8)
    assert hull.fullness(None) is None
    assert Hull(displacement=50_000.0).fullness(200.0) is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("32.0", "0", "hull.breadth must be positive, got 0"),
        ("32.0", "300", "hull.breadth must lie between 0 and 200, got 300"),
        ("32.0", '"wide"', "hull.breadth must be a number, got 'wide'"),
        ("32.0", "nan", "hull.breadth must be finite, got nan"),
        ("0.7", "0.1", "hull.block_coefficient must lie between 0.2 and 1, got 0.1"),
        ("rudder_area", "ruder_area", "unknown key 'hull.ruder_area', did you mean 'rudder_area'?"),
        ('"right"', '"Left"', "hull.propeller_turning must be one of right, left, got 'Left'"),
        ("propeller_turning =", "draught = 10.0\npropeller_turning =", "either draught, or both"),
        ("draught_aft = 10.5", "", "either draught, or both draught_forward and draught_aft"),
        ("rudder_height", "displacement = 9e4\nrudder_height", "displacement and block_coeffic"),
        ("block_coefficient = 0.7", "displacement = 9e5", "gives a block coefficient of 14, which"),
        ("rudder_height", "rudder_aspect_ratio = 2\nrudder_height", "and rudder_aspect_ratio; giv"),
        ("rudder_area = 36.0", "", "hull.rudder_height needs hull.rudder_area beside it"),
        ("200.0", "20.0", "hull.breadth = 32 m must be less than the length, 20 m"),
    ],
)  # fmt: skip
def test_an_error_names_the_key_and_the_value(old: str, new: str, message: str) -> None:
    assert message in error_of(TEXT.replace(old, new, 1))


def test_a_hull_that_is_no_section_is_an_error() -> None:
    assert "[hull] must be a section" in error_of("length = 200.0\nhull = 3\n")


def test_an_error_of_the_length_is_not_reported_of_the_hull_too() -> None:
    text = TEXT.replace("block_coefficient = 0.7", "displacement = 46000.0")
    message = error_of(text.replace("200.0", "-200.0"))
    assert message.startswith("one error in the vessel file: length must be positive")

"""A settings file is parsed in bounded memory, and all its errors are in one line."""

import pytest

from shiplog.errors import VesselError
from shiplog.toml_text import list_errors, parse_toml, unknown_key


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("x" * 100_001, "too long for a vessel file"),
        ("a." * 2000 + "b = 1", "nested too deeply"),
        ("x = " + "[" * 2000, "nested too deeply"),
        ("length = \n", "not a TOML file"),
        ("day = 2020-02-31", "not a TOML file"),
        ('"""', "not a TOML file"),
    ],
)
def test_a_hostile_or_faulty_text_is_refused_in_one_line(text: str, cause: str) -> None:
    with pytest.raises(VesselError, match=cause) as caught:
        parse_toml(text, "ship.toml", "vessel file", VesselError)
    assert "\n" not in str(caught.value)
    assert str(caught.value).endswith(": ship.toml")


def test_several_errors_are_counted_and_listed() -> None:
    text = list_errors(["[yaw] lacks T1", "max must be\npositive"], "vessel file", "x.toml")
    assert text == "2 errors in the vessel file: [yaw] lacks T1; max must be positive: x.toml"


def test_an_unknown_key_is_named_with_its_section_and_the_nearest_known_one() -> None:
    expected = "unknown key 'filter.gat', did you mean 'gate'?"
    assert unknown_key("gat", ["gate"], section="filter") == expected
    assert unknown_key("zzz", ["gate"]) == "unknown key 'zzz'"

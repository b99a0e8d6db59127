"""A settings file is parsed in bounded memory, and all its errors are in one line."""

from pathlib import Path

import pytest

from shiplog.errors import VesselError
from shiplog.toml_text import MAX_CHARACTERS, list_errors, parse_toml, read_toml_text, unknown_key


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


def test_a_file_is_read_up_to_the_longest_text_that_is_parsed(tmp_path: Path) -> None:
    file = tmp_path / "ship.toml"
    file.write_text("é" * 300_000, encoding="utf-8")
    assert read_toml_text(file, "vessel file", VesselError) == "é" * (MAX_CHARACTERS + 1)


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        ("", "cannot read the vessel file (No such file or directory); name another: {}"),
        ("no such vessel file", "no such vessel file: {}"),
    ],
)
def test_a_missing_file_is_named_with_the_remedy(
    tmp_path: Path, missing: str, message: str
) -> None:
    file = tmp_path / "none.toml"
    with pytest.raises(VesselError) as caught:
        read_toml_text(file, "vessel file", VesselError, missing)
    assert str(caught.value) == message.format(file)


def test_a_folder_and_a_binary_file_cannot_be_read_whatever_a_missing_one_is(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe")
    for path in (tmp_path, tmp_path / "a.toml"):
        with pytest.raises(VesselError, match=r"cannot read the vessel file \(.+\); name another"):
            read_toml_text(path, "vessel file", VesselError, "none")

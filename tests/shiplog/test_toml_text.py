"""A settings file is parsed in bounded memory, and all its errors are in one line."""

from pathlib import Path

import pytest

from shiplog.errors import VesselError
from shiplog.toml_text import (
    MAX_CHARACTERS,
    MAX_KEY_PARTS,
    list_errors,
    parse_toml,
    read_toml_text,
    unknown_key,
)

DEEP_KEY = ".".join("abcdefghijklmnopqrst")  # as many parts as a key may have


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("x" * (MAX_CHARACTERS + 1), "too long for a vessel file"),
        ("a." * 2000 + "b = 1", "nested too deeply"),
        ("'a' . " * 21 + "b = 1", "nested too deeply"),
        ("[" + '"a".' * 21 + "b]", "nested too deeply"),
        (f'x = """\\""" """\n{DEEP_KEY}.u = 1', "nested too deeply"),
        ("x = " + "[" * 2000, "nested too deeply"),
        ("x = " + "[ # a\n" * 21, "nested too deeply"),
        ("x = " + "{a = " * 21 + "1" + "}" * 21, "nested too deeply"),
        ("[[a]]\n" * (MAX_KEY_PARTS + 1), "too many for a vessel file"),
        (f"{DEEP_KEY} = 1\n" * (MAX_KEY_PARTS // 20 + 1), "too many for a vessel file"),
        ("x = [" + "{a = 1}," * (MAX_KEY_PARTS + 1) + "]", "too many for a vessel file"),
        ("a" * 401 + " = 1", r"a key of 401 characters \(a{20}...\), too long"),
        ("x = [{y = 0x8000_0000_0000_0000}]", "an integer of 64 bits, too large"),
        ("x = 0x" + "f" * 500_000, "an integer of 2000000 bits, too large"),
        ("x = " + "9" * 5000, "not a TOML file"),
        (f"[{'a' * 9000}]\n[{'a' * 9000}]", "not a TOML file.{,650}$"),
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


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("x = [" + "0.125, " * 5000 + "0.25]", [0.125] * 5000 + [0.25]),
        ("x = [" + "[1.5, 2.5],\n" * 2000 + "]", [[1.5, 2.5]] * 2000),
        ("x = '" + "see a.b " * 5000 + "'", "see a.b " * 5000),
        ('x = "' + '\\"a.b.c' * 5000 + '"', '"a.b.c' * 5000),
        ('x = """' + '""[[a.b\n' * 500 + '"""', '""[[a.b\n' * 500),
        ("x = 'a' # " + "[.a" * 5000, "a"),
        ("x = 0x7fff_ffff_ffff_ffff", 2**63 - 1),
        ("x = -9223372036854775808", -(2**63)),
    ],
)
def test_long_lists_and_texts_of_any_content_are_read(text: str, value: object) -> None:
    assert parse_toml(text, "ship.toml", "vessel file", VesselError) == {"x": value}


def test_a_layout_of_six_hundred_channels_and_a_key_of_the_greatest_depth_are_read() -> None:
    section = '[[channel]]\ncolumn = "{0}"\nunit = "rad/s"\nquantity = "yaw_rate"\nsource = "{0}"\n'
    text = f"{DEEP_KEY} = 1\n" + "".join(section.format(f"gyro.no_{n}") for n in range(600))
    assert len(parse_toml(text, "a.toml", "layout file", VesselError)["channel"]) == 600


def test_several_errors_are_counted_and_listed() -> None:
    text = list_errors(["[yaw] lacks T1", "max must be\npositive"], "vessel file", "x.toml")
    assert text == "2 errors in the vessel file: [yaw] lacks T1; max must be positive: x.toml"


def test_of_very_many_errors_the_first_are_listed() -> None:
    text = list_errors([f"error {n}" for n in range(10_000)], "vessel file", "x.toml")
    assert text.startswith("10000 errors in the vessel file: error 0; error 1; ")
    assert text.endswith("; error 29; and 9970 more: x.toml")


def test_an_error_that_shows_a_long_value_is_shortened_in_the_middle() -> None:
    text = list_errors(["name must be short, got " + "x" * 5000 + "; see docs"], "layout", "a.toml")
    assert len(text) < 700
    assert text.startswith("one error in the layout: name must be short, got xxx")
    assert text.endswith("xxx; see docs: a.toml")


def test_an_unknown_key_is_named_with_its_section_and_the_nearest_known_one() -> None:
    expected = "unknown key 'filter.gat', did you mean 'gate'?"
    assert unknown_key("gat", ["gate"], section="filter") == expected
    assert unknown_key("zzz", ["gate"]) == "unknown key 'zzz'"


def test_a_file_is_read_up_to_the_longest_text_that_is_parsed(tmp_path: Path) -> None:
    file = tmp_path / "ship.toml"
    file.write_text("é" * (MAX_CHARACTERS + 2), encoding="utf-8")
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

"""Tests of recorders.csv_lines.device: descriptions of devices and all their errors at once."""

import re
from pathlib import Path

import pytest
from places import LAYOUTS

from recorders.csv_lines.device import load_device, parse_device
from shiplog.errors import LayoutError

WIND = """
[[line]]
begins = "WIND"
[line.apparent_wind_speed]
column = 4
unit = "m/s"
"""


def test_a_kind_has_its_columns_and_its_name_as_source() -> None:
    device = parse_device(WIND, "wind.toml")
    kind = device.kinds["WIND"]
    assert (kind.source, kind.fields, kind.checksum, device.delimiter) == ("WIND", None, False, ",")
    assert kind.columns["apparent_wind_speed"].place == 4


def test_the_example_has_two_kinds() -> None:
    device = load_device(LAYOUTS / "weather_lines.toml")
    assert {name: kind.source for name, kind in device.kinds.items()} == {
        "WIND": "anemometer",
        "AIR": "weather",
    }
    assert device.kinds["WIND"].where == {5: "M", 6: "60"}


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", r"sections \[\[line\]\]"),
        ("line = 3", r"sections \[\[line\]\]"),
        ("delimiter = '|'" + WIND, "delimiter must be one of"),
        ("delimeter = ','" + WIND, "unknown key 'delimeter', did you mean 'delimiter'"),
        (WIND + WIND, "line 'WIND' is described twice.*two kinds of lines have apparent_wind"),
        (WIND.replace('begins = "WIND"', "") + WIND, "takes all lines"),
        (WIND.replace("m/s", "bar"), "line 'WIND': apparent_wind_speed.unit: cannot convert"),
        (WIND.replace("apparent_wind_speed", "wind_sped"), "did you mean 'wind_speed'"),
        (WIND.replace("column = 4", "column = 'v'"), "lines have no header: state its number"),
        (WIND.replace("column = 4", ""), "lacks column"),
        ('[[line]]\nbegins = "WIND"', "no channel is given"),
        (WIND.replace("[line.", "fields = 3\n[line.", 1), "column 4 of 3 fields"),
        (WIND.replace("[line.", 'where = "M"\n[line.', 1), "where must be texts by number"),
        (WIND.replace("[line.", "where = {M = 'a'}\n[line.", 1), "where must be texts by number"),
        (WIND.replace("[line.", "checksum = 1\n[line.", 1), "checksum must be true or false"),
        (WIND.replace("[line.", "fields = 0\n[line.", 1), "fields must be a whole number"),
        (WIND.replace("[line.", "source = 'a/b'\n[line.", 1), "source must be a text without '/'"),
        (WIND.replace('"WIND"', "7"), "begins must be a text"),
        ("[[line]]\n[line.velocity_north]\ncolumn = 1\nunit = 'm/s'", "no channel"),
        (
            "[[line]]\n[line.position]\nnorth = 1\neast = 2\nunit = 'm'",
            "in latitude and longitude",
        ),
        ("[[line", "not a TOML file"),
    ],
)
def test_errors_are_named(text: str, error: str) -> None:
    with pytest.raises(LayoutError, match=re.compile(error + r".*: wind\.toml$", re.DOTALL)):
        parse_device(text, "wind.toml")


def test_all_errors_are_reported_at_once() -> None:
    text = WIND.replace("m/s", "bar").replace("[line.", "checksum = 1\n[line.", 1)
    with pytest.raises(LayoutError, match=r"^2 errors in the layout file"):
        parse_device(text, "wind.toml")


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match="no such layout file"):
        load_device(tmp_path / "none.toml")

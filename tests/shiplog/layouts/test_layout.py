"""Layout files: their values, and their errors."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from layout_texts import MINIMAL, layout

from shiplog.errors import LayoutError
from shiplog.layouts.layout import load_layout
from shiplog.layouts.layout_parser import parse_layout


def errors_of(text: str) -> str:
    with pytest.raises(LayoutError) as caught:
        parse_layout(text, "gyro.toml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.endswith(": gyro.toml")
    return message


def test_a_minimal_layout_has_the_documented_defaults() -> None:
    minimal = layout()
    assert (minimal.name, minimal.source, minimal.encoding) == ("gyro", "table", "utf-8")
    assert minimal.delimiter == ","
    assert (minimal.skip_rows, minimal.header, minimal.decimal_comma) == (0, False, False)
    assert (minimal.time.start_ns, minimal.froude_scale, minimal.time.uniform) == (None, 1.0, False)


def test_the_start_is_an_instant_whatever_its_zone() -> None:
    assert layout(top="start = 1970-01-01T02:00:00.25+02:00").time.start_ns == 250_000_000


def test_all_errors_of_a_layout_are_reported_at_once_in_one_line() -> None:
    message = errors_of(
        'encodng = "utf-8"\nskip_rows = -1\nstart = 2008-04-14T00:00:00\n'
        '[time]\ncolumn = 0\nunit = "sec"\n[ruder]\ncolumn = 3\n[yaw_rate]\ncolumn = 2\nsign = 2\n'
    )
    assert message.startswith("8 errors")
    for part in (
        "unknown key 'encodng', did you mean 'encoding'?",
        "skip_rows must be",
        "start must be a time with its zone",
        "time.column must be a number from 1 or the name of a header",
        "time.unit: unknown unit 'sec'",
        "unknown key 'ruder', did you mean 'rudder'?",
        "[yaw_rate] lacks unit",
        "yaw_rate.sign must be 1 or -1, got 2",
    ):
        assert part in message


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("[yaw_rate]\ncolumn = 2\nunit = 'deg/s'", "[time] is missing"),
        ("[time]\ncolumn = 1\nunit = 's'", "no channel is given"),
        (f"delimiter = '|'\n{MINIMAL}", "delimiter must be one of 'whitespace'"),
        (f"encoding = 'latin-99'\n{MINIMAL}", "encoding must be"),
        (f"source = 'a/b'\n{MINIMAL}", "source must be a string without '/'"),
        (f"header = 1\n{MINIMAL}", "header must be true or false, got 1"),
        (f"skip_rows = true\n{MINIMAL}", "skip_rows must be"),
        (f"froude_scale = 0\n{MINIMAL}", "froude_scale must be a positive number"),
        (f"froude_scale = nan\n{MINIMAL}", "froude_scale must be a positive number"),
        (f"decimal_comma = true\n{MINIMAL}", "decimal_comma cannot be combined with"),
        (f"rudder = 3\n{MINIMAL}", "[rudder] must be a section"),
        (f"{MINIMAL}[rudder]\ncolumn = 2\nunit = 'deg'", "name the same column 2"),
        (f"{MINIMAL}[rudder]\ncolumn = 'd'\nunit = 'deg'", "which needs header = true"),
        (f"{MINIMAL}[rudder]\ncolumn = true\nunit = 'deg'", "rudder.column must be a number"),
        (f"{MINIMAL}[rudder]\ncolumn = 3\nunit = 'm'", "cannot convert 'm' to 'rad'"),
        (f"{MINIMAL}[rudder]\ncolumn = 3\nunit = 'deg'\nrebuild = 'x'", "'rudder.rebuild'"),
        (f"{MINIMAL}[heading]\ncolumn = 3\nunit = 'deg'\nrebuild = 'x'", "must be 'from yaw_rate'"),
        (f"{MINIMAL}[velocity_north]\ncolumn = 3\nunit = 'kn'", "needs the other component"),
        (f"{MINIMAL}[position]\nnorth = 3\nunit = 'm'", "[position] lacks east"),
        (f"{MINIMAL}[position]\nnorth = 3\nlatitude = 4\nunit = 'm'", "mixes north and east"),
        (f"{MINIMAL}[position.bow]\nnorth = 3\nunit = 'm'", "[position.bow] lacks east"),
        (f"{MINIMAL}[position.a]\nnorth = 3\nlatitude = 4\nunit = 'm'", "[position.a] mixes north"),
        (f"{MINIMAL}[position.'a/b']\nnorth = 3\neast = 4\nunit = 'm'", "without '/'"),
        (f"{MINIMAL}['position.a']\nnorth = 3\nunit = 'm'", "[position.a] lacks east"),
        (
            (
                "[time]\ncolumn = 1\nunit = 's'\n[heading]\ncolumn = 3\nunit = 'deg'\n"
                "rebuild = 'from yaw_rate'"
            ),
            "heading.rebuild needs a [yaw_rate]",
        ),
        (
            f"froude_scale = 10\n{MINIMAL}[position]\nlatitude = 3\nlongitude = 4\nunit = 'deg'",
            "froude_scale cannot be applied",
        ),
        (
            (
                f"{MINIMAL}[velocity_north]\ncolumn = 3\nunit = 'kn'\n"
                "[velocity_east]\ncolumn = 4\nunit = 'kn'\n[speed]\ncolumn = 5\nunit = 'kn'"
            ),
            "[speed] follows from the earth-fixed velocities",
        ),
    ],
)
def test_an_error_of_a_layout_names_the_key(text: str, part: str) -> None:
    assert part in errors_of(text)


def test_a_text_that_is_not_toml_is_an_error_with_its_line() -> None:
    assert "line 2" in errors_of("header = true\n= 1")


def test_a_missing_layout_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match=r"no such layout file: .*gone\.toml$"):
        load_layout(tmp_path / "gone.toml")


def test_further_quantities_and_sources_have_their_own_columns() -> None:
    further = layout(
        f"{MINIMAL}[rpm.port]\ncolumn = 3\nunit = 'rpm'\n[rpm.starboard]\ncolumn = 4\nunit = 'Hz'\n"
        "interpolation = 'hold'\n[fuel_flow]\ncolumn = 5\nunit = 'kg/h'\npositive = 'to the engine'"
    )
    assert set(further.columns) == {"time", "yaw_rate", "rpm.port", "rpm.starboard", "fuel_flow"}
    assert further.columns["rpm.starboard"].metadata == {"interpolation": "hold"}
    assert further.columns["fuel_flow"].metadata == {"positive": "to the engine"}


@pytest.mark.parametrize(
    ("text", "part"),
    [
        (f"encoding = 'hex'\n{MINIMAL}", "encoding must be"),
        (f"delimiter = [',']\n{MINIMAL}", "delimiter must be one of"),
        (f"{MINIMAL}[fuel]\ncolumn = 3\nunit = 'kg/h'", "needs `positive`"),
        (f"{MINIMAL}[rudder]\ncolumn = 3\nunit = ['deg']", "rudder.unit must be a unit"),
        (f"{MINIMAL}[rudder]\ncolumn = 3\nunit = 'deg'\nsign = [1]", "rudder.sign must be"),
        (f"{MINIMAL}[rpm]\ncolumn = 3\nunit = 'rpm'\ninterpolation = 'x'", "'hold' or 'linear'"),
        (MINIMAL.replace('unit = "s"', "zone = 'Mars'"), "time.zone must be"),
        (MINIMAL.replace('unit = "s"', "date_order = 'dym'"), "time.date_order must be"),
        (f"{MINIMAL}[position]\nlatitude = 3\nnorth_south = 4\nunit = 'deg'", "needs both"),
    ],
)
def test_an_error_of_a_further_key_is_named(text: str, part: str) -> None:
    assert part in errors_of(text)


def test_no_text_of_a_layout_ends_in_another_exception() -> None:
    rng = np.random.default_rng(5)
    words = ["time", "column", "unit", "[", "]", "=", ".", "'", "1", "true", "rpm", "port", "'s'"]
    words += ["\n", "position", "{", "}", ",", "nan", "-1"]
    for _ in range(300):
        with suppress(LayoutError):
            parse_layout(" ".join(rng.choice(words, 12)), "x.toml")
    for text in ("a" + ".a" * 5000 + " = 1", "a = " + "[" * 500, "a = " + "9" * 5000, "\0"):
        with pytest.raises(LayoutError):
            parse_layout(text, "x.toml")


def test_all_errors_of_several_receivers_are_reported_at_once() -> None:
    text = (
        f"froude_scale = 2\n{MINIMAL}[position.bow]\nlatitude = 3\nlongitude = 4\nunit = 'm'\n"
        "[position.stern]\nlatitude = 4\nunit = 'deg'\nnorth_south = 6\nsign = -1\n"
    )
    errors = errors_of(text)
    for part in (
        "position.bow.unit: cannot convert 'm' to 'rad'",
        "[position.stern] lacks longitude",
        "[position.stern] needs both north_south and east_west",
        "unknown key 'position.stern.sign'",
        "latitude.stern and longitude.bow name the same column 4",
        "froude_scale cannot be applied to latitude and longitude",
    ):
        assert part in errors

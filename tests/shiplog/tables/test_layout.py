"""The layout file: what it may say, and what is refused and how."""

from pathlib import Path

import pytest
from layout_texts import MINIMAL, layout

from shiplog.errors import LayoutError
from shiplog.tables.layout import load_layout, parse_layout


def faults(text: str) -> str:
    with pytest.raises(LayoutError) as caught:
        parse_layout(text, "gyro.toml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.endswith(": gyro.toml")
    return message


# ---- the layout file


def test_a_minimal_layout_has_the_documented_defaults() -> None:
    its = layout()
    assert (its.name, its.source, its.encoding, its.delimiter) == ("gyro", "table", "utf-8", ",")
    assert (its.skip_rows, its.header, its.decimal_comma) == (0, False, False)
    assert (its.start_ns, its.froude_scale, its.rebuild) == (0, 1.0, frozenset())


def test_the_start_is_an_instant_whatever_its_zone() -> None:
    assert layout(top="start = 1970-01-01T02:00:00.25+02:00").start_ns == 250_000_000


def test_all_faults_of_a_layout_are_told_at_once_in_one_line() -> None:
    said = faults(
        'encodng = "utf-8"\nskip_rows = -1\nstart = 2008-04-14T00:00:00\n'
        '[time]\ncolumn = 0\nunit = "sec"\n[ruder]\ncolumn = 3\n[yaw_rate]\ncolumn = 2\nsign = 2\n'
    )
    assert said.startswith("8 faults")
    for part in (
        "unknown key 'encodng', did you mean 'encoding'?",
        "skip_rows must be",
        "start must be a time with its zone",
        "time.column must be a number from 1 on",
        "time.unit: unknown unit 'sec'",
        "unknown key 'ruder', did you mean 'rudder'?",
        "[yaw_rate] lacks unit",
        "yaw_rate.sign must be 1 or -1, got 2",
    ):
        assert part in said


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("[yaw_rate]\ncolumn = 2\nunit = 'deg/s'", "[time] is missing"),
        ("[time]\ncolumn = 1\nunit = 's'", "no channel is given"),
        (f"delimiter = '|'\n{MINIMAL}", "delimiter must be one of 'whitespace'"),
        (f"encoding = 'latin-99'\n{MINIMAL}", "encoding must be"),
        (f"source = 'a/b'\n{MINIMAL}", "source must be a text without '/'"),
        (f"header = 1\n{MINIMAL}", "header must be true or false, got 1"),
        (f"skip_rows = true\n{MINIMAL}", "skip_rows must be"),
        (f"froude_scale = 0\n{MINIMAL}", "froude_scale must be a positive number"),
        (f"froude_scale = nan\n{MINIMAL}", "froude_scale must be a positive number"),
        (f"decimal_comma = true\n{MINIMAL}", "decimal_comma cannot go with"),
        (f"rudder = 3\n{MINIMAL}", "[rudder] must be a section"),
        (f"{MINIMAL}[rudder]\ncolumn = 2\nunit = 'deg'", "name the same column 2"),
        (f"{MINIMAL}[rudder]\ncolumn = 'd'\nunit = 'deg'", "that needs header = true"),
        (f"{MINIMAL}[rudder]\ncolumn = true\nunit = 'deg'", "rudder.column must be a number"),
        (f"{MINIMAL}[rudder]\ncolumn = 3\nunit = 'm'", "cannot convert 'm' to 'rad'"),
        (f"{MINIMAL}[rudder]\ncolumn = 3\nunit = 'deg'\nrebuild = 'x'", "'rudder.rebuild'"),
        (f"{MINIMAL}[heading]\ncolumn = 3\nunit = 'deg'\nrebuild = 'x'", "must be 'from yaw_rate'"),
        (f"{MINIMAL}[velocity_north]\ncolumn = 3\nunit = 'kn'", "only with its other component"),
        (f"{MINIMAL}[position]\nnorth = 3\nunit = 'm'", "[position] lacks east"),
        (f"{MINIMAL}[position]\nnorth = 3\nlatitude = 4\nunit = 'm'", "mixes north and east"),
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
            "[speed] stands beside earth-fixed velocities",
        ),
    ],
)
def test_a_fault_of_a_layout_is_named(text: str, part: str) -> None:
    assert part in faults(text)


def test_what_is_no_toml_is_refused_with_its_line() -> None:
    assert "line 2" in faults("header = true\n= 1")


def test_a_layout_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match=r"no layout file: .*gone\.toml$"):
        load_layout(tmp_path / "gone.toml")

"""Drafts of layouts: quantities, units and signs from headers and values."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from places import SAMPLE_DATA

from shiplog.cli.core_verbs import LAYOUT
from shiplog.errors import LayoutError
from shiplog.tables.draft import draft_layout
from shiplog.tables.foreign import read_table
from shiplog.tables.layout import load_layout
from shiplog.tables.layout_parser import parse_layout


def test_the_draft_of_the_bridges_table_reads_it_as_its_own_layout_does() -> None:
    path = SAMPLE_DATA / "bridge.csv"
    draft = draft_layout(path)
    drafted = read_table(path, parse_layout(draft.text, "draft.toml"))
    given = read_table(path, load_layout(SAMPLE_DATA / "layouts/bridge.toml"))
    assert {c.name for c in drafted} == {c.name for c in given}
    for channel in given:
        np.testing.assert_array_equal(drafted[channel.name].values, channel.values)
        np.testing.assert_array_equal(drafted[channel.name].measured_ns, channel.measured_ns)
    assert any("UTC is assumed" in remark for remark in draft.remarks)


@pytest.mark.parametrize(
    ("factor", "unit", "sign"),
    [(60, "deg/min", 1), (1, "deg/s", 1), (np.pi / 180, "rad/s", 1), (-60, "deg/min", -1)],
)
def test_the_unit_and_sign_of_a_yaw_rate_come_from_the_heading(
    tmp_path: Path, factor: float, unit: str, sign: int
) -> None:
    time_secs = np.arange(0.0, 300.0)
    heading = 180 + 30 * np.sin(time_secs / 30)
    rate = np.cos(time_secs / 30) * factor
    rows = [f"{t};{h:.2f};{r:.6f};7" for t, h, r in zip(time_secs, heading, rate, strict=True)]
    path = tmp_path / "x.csv"
    path.write_text("\n".join(["t;HDT;ROT;mystery", *rows]).replace(".", ","))
    draft = draft_layout(path)
    column = parse_layout(draft.text, "x.toml").columns["yaw_rate"]
    assert (column.unit, column.sign) == (unit, sign)
    assert "'mystery'" in draft.remarks[-2] + draft.remarks[-1]


def test_the_verb_and_its_options_have_a_help_text() -> None:
    assert "layout" in LAYOUT.help


@pytest.mark.parametrize("text", ["", "1,2\n3,4\n", "a,b\n1,2\n", "x\n", "t\n\n"])
def test_a_table_that_cannot_be_drafted_is_an_error(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(LayoutError, match="write the layout by hand"):
        draft_layout(path)


def test_no_bytes_end_in_another_exception(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    letters = list(b"0123456789.,;:-T t\n\n\r\"'#\xff\x00Zlaton[]")
    for i in range(300):
        path = tmp_path / "x.csv"
        path.write_bytes(b"t,ROT,HDT,lat,lon\n" * (i % 2) + bytes(rng.choice(letters, 80)))
        with suppress(LayoutError):
            draft_layout(path)

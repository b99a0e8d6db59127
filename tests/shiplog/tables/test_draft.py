"""Drafts of layouts: quantities, units and signs from headers and values."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from places import SAMPLE_DATA

from shiplog.cli.core_verbs import LAYOUT
from shiplog.cli.main import main
from shiplog.errors import LayoutError
from shiplog.layouts.layout import load_layout
from shiplog.layouts.layout_parser import parse_layout
from shiplog.tables.draft import draft_layout
from shiplog.tables.foreign import read_table
from shiplog.types import TrialLog


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


def drafted(tmp_path: Path, text: str, encoding: str = "utf-8") -> TrialLog:
    """Read a table by the layout drafted from it."""
    path = tmp_path / "table.csv"
    path.write_bytes(text.encode(encoding))
    return read_table(path, parse_layout(draft_layout(path).text, "draft.toml"))


def test_a_row_of_units_under_the_header_is_used_and_is_no_sample(tmp_path: Path) -> None:
    rows = "Time,Speed,Rudder\n,km/h,deg\n2026-03-29T00:00:00Z,36,5\n2026-03-29T00:00:01Z,36,5\n"
    log = drafted(tmp_path, rows)
    np.testing.assert_allclose(log["speed"].values, [10, 10])
    np.testing.assert_allclose(np.degrees(log["rudder"].values), [5, 5])


def test_hemispheres_in_columns_and_day_times_in_six_digits(tmp_path: Path) -> None:
    rows = "UTC Date,UTC Time,Lat,N/S,Lon,E/W,HDT\n"
    rows += "290326,235959.00,5412.3,S,01003.6,W,5\n300326,000000.00,5412.3,S,01003.6,W,6\n"
    log = drafted(tmp_path, rows)
    np.testing.assert_allclose(log["position"].values[:, :2], [[-54.205, -10.06]] * 2)
    assert np.diff(log["position"].measured_ns) == [10**9]
    assert log["heading"].measured_ns[0] == 1774828799 * 10**9


def test_a_german_spreadsheet_with_decimal_commas(tmp_path: Path) -> None:
    rows = "Datum;Uhrzeit;Kurs [°];Ruderlage [°];Fahrt [kn]\n"
    rows += "29.03.2026;23:59:59;5,5;-3,5;10,0\n30.03.2026;00:00:00;5,5;-3,5;10,0\n"
    log = drafted(tmp_path, rows, "cp1252")
    np.testing.assert_allclose(np.degrees(log["rudder"].values), [-3.5, -3.5])
    np.testing.assert_allclose(log["speed"].values, 10 * 1852 / 3600)
    assert np.diff(log["heading"].measured_ns) == [10**9]


@pytest.mark.parametrize(
    ("first", "second"),
    [("46110,50000000", "46110,50001157"), ("1774785600", "1774785601"),
     ("1774785600000", "1774785601000"), ("1774785600000000", "1774785601000000")],
)  # fmt: skip
def test_times_as_numbers_have_the_unit_of_their_size(
    tmp_path: Path, first: str, second: str
) -> None:
    measured = drafted(tmp_path, f"Time;Heading\n{first};5\n{second};6\n")["heading"].measured_ns
    np.testing.assert_allclose(measured * 1e-9, [1774785600, 1774785601], rtol=0, atol=1e-3)


def test_columns_of_port_and_starboard_are_sources(tmp_path: Path) -> None:
    rows = "Time,Rudder Stbd (deg),Rudder Port (deg),Shaft RPM Port\n"
    log = drafted(tmp_path, rows + "2026-03-29T00:00:00Z,1,2,80\n2026-03-29T00:00:01Z,1,2,80\n")
    assert {(c.name, c.source) for c in log} == {
        ("rudder", "starboard"), ("rudder", "port"), ("rpm", "port")
    }  # fmt: skip


def test_two_receivers_of_positions_are_sources(tmp_path: Path) -> None:
    rows = "Time,GPS1 Lat,GPS1 Lon,GPS2 Lat,GPS2 N/S,GPS2 Lon,GPS2 E/W,Lat port\n"
    rows += "2026-03-29T00:00:00Z,54.5,10.1,5430.0,S,01006.0,E,1\n"
    rows += "2026-03-29T00:00:01Z,54.6,10.2,5431.0,S,01007.0,E,2\n"
    log = drafted(tmp_path, rows)
    assert [c.topic for c in log] == ["/position/gps1", "/position/gps2"]
    np.testing.assert_allclose(log["position/gps1"].values[0, :2], [54.5, 10.1])
    np.testing.assert_allclose(log["position/gps2"].values[0, :2], [-54.5, 10.1])
    remarks = draft_layout(tmp_path / "table.csv").remarks
    assert "'GPS1 Lat' and 'GPS1 Lon': position.gps1 in deg (header and cells)" in remarks
    assert "not recognised, comments in the draft: 'Lat port'" in remarks


def test_an_assumed_date_order_is_a_warning_until_it_is_confirmed(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time,Heading\n03/04/2026 10:00:00,5\n03/04/2026 10:00:01,5\n")
    text = draft_layout(path).text
    log = read_table(path, parse_layout(text, "draft.toml"))
    assert any("day and month are assumed in the order dmy" in w for w in log.warnings)
    confirmed = text.replace('assumed = "date_order"\n', "")
    log = read_table(path, parse_layout(confirmed, "draft.toml"))
    assert not any("day and month" in w for w in log.warnings)


def test_a_line_end_in_the_name_of_a_table_is_no_line_of_its_draft(tmp_path: Path) -> None:
    path = tmp_path / "x\nsource = 'y'.csv"
    path.write_text("Time,Heading\n2026-04-03T10:00:00Z,5\n2026-04-03T10:00:01Z,5\n")
    assert "\nsource" not in draft_layout(path).text


def test_the_verb_writes_a_layout_that_converts_the_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, layout = str(SAMPLE_DATA / "bridge.csv"), str(tmp_path / "bridge.toml")
    assert main(["layout", table, "-o", layout]) == 0
    assert "'HDT [deg]': heading in deg" in "".join(capsys.readouterr())
    assert main(["convert", table, str(tmp_path / "run.mcap"), "--layout", layout]) == 0
    assert "UTC" in "".join(capsys.readouterr())

"""Foreign tables: what is read, and the errors of a text that does not fit its layout."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from layout_texts import MINIMAL, layout
from places import KVLCC2, LAYOUTS, SAMPLE_DATA
from scipy.signal import savgol_filter

from recorders.simulated.simulate import simulate
from shiplog import load_vessel
from shiplog.checks.info import read_log_info
from shiplog.errors import LayoutError
from shiplog.layouts.layout import Layout, load_layout
from shiplog.layouts.layout_parser import parse_layout
from shiplog.mcap.reader import read
from shiplog.mcap.writer import write
from shiplog.tables.convert import convert
from shiplog.tables.csv_form import write_csv
from shiplog.tables.foreign import read_table
from shiplog.tables.parquet_form import write_parquet
from shiplog.tables.rebuild import rebuilt_heading, uniform_times
from shiplog.types import TrialLog


def table(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "run.txt"
    path.write_bytes(text.encode(encoding))
    return path


def error_of(tmp_path: Path, text: str, given_layout: Layout | None = None) -> str:
    with pytest.raises(LayoutError) as caught:
        read_table(table(tmp_path, text), given_layout or layout())
    message = str(caught.value)
    assert "\n" not in message
    assert message.endswith(str(tmp_path / "run.txt"))
    return message


# ---- the table


def test_a_table_is_read_in_si_with_its_sign_and_its_times(tmp_path: Path) -> None:
    given_layout = layout(
        "[time]\ncolumn = 1\nunit = 'ms'\n[rudder]\ncolumn = 3\nunit = 'deg'\nsign = -1\n"
        "[speed]\ncolumn = 2\nunit = 'kn'\n",
        "source = 'bridge'\nstart = 2001-09-09T01:46:40Z",
    )
    log = read_table(table(tmp_path, "0,10,5\n100,20,-5\n"), given_layout)
    assert [c.topic for c in log] == ["/speed/bridge", "/rudder/bridge"]
    np.testing.assert_allclose(log["speed"].values, [18520 / 3600, 37040 / 3600])
    np.testing.assert_allclose(log["rudder"].values, np.radians([-5, 5]))
    assert log["speed"].measured_ns.tolist() == [10**18, 10**18 + 100_000_000]
    assert np.array_equal(log["rudder"].received_ns, log["rudder"].measured_ns)
    assert log.metadata == {"converted_from": "run.txt", "layout": "gyro"}


def test_columns_are_found_by_their_headers(tmp_path: Path) -> None:
    text = "[time]\ncolumn = 't [s]'\nunit = 's'\n[rpm]\ncolumn = 'shaft'\nunit = 'rpm'\n"
    given_layout = layout(
        text, "header = true\nskip_rows = 1\ndelimiter = ';'\ndecimal_comma = true"
    )
    path = table(tmp_path, '\ufeffFerry trials\n"shaft";note;"t [s]"\n80,5;a;0\n81,5;;0,1\n')
    log = read_table(path, given_layout)
    assert log["rpm"].values.tolist() == [80.5, 81.5]
    assert log["rpm"].measured_ns.tolist() == [0, 100_000_000]


def test_a_missing_header_is_an_error_with_the_nearest_one(tmp_path: Path) -> None:
    text = "[time]\ncolumn = 't'\nunit = 's'\n[rpm]\ncolumn = 'shaft rpm'\nunit = 'rpm'\n"
    message = error_of(tmp_path, "t,shaft_rpm\n0,1\n", layout(text, "header = true"))
    assert "no column is headed 'shaft rpm'; did you mean 'shaft_rpm'?" in message


def test_a_header_given_twice_is_an_error(tmp_path: Path) -> None:
    text = "[time]\ncolumn = 't'\nunit = 's'\n[rpm]\ncolumn = 'n'\nunit = 'rpm'\n"
    assert "more than one" in error_of(tmp_path, "t,n,n\n0,1,2\n", layout(text, "header = true"))


@pytest.mark.parametrize(
    ("delimiter", "text"),
    [
        ("whitespace", "  0   1 x\n\t\t\n\n 1\t 2  y\n\t\t\n"),
        (",", "0, 1,x\r\n\r\n1, 2,y\r\n,,\r\n"),
        (";", "0;1;x\n;;\n1;2;y"),
        ("tab", "0\t1\tx\n\t\t\n1\t2\ty\n"),
    ],
)
def test_every_delimiter_is_read_and_blank_lines_are_skipped(
    tmp_path: Path, delimiter: str, text: str
) -> None:
    log = read_table(table(tmp_path, text), layout(top=f"delimiter = '{delimiter}'"))
    np.testing.assert_allclose(log["yaw_rate"].values, np.radians([1, 2]))


def test_empty_and_nan_cells_are_not_measured(tmp_path: Path) -> None:
    log = read_table(table(tmp_path, '0,\n1,nan\n2 ,NaN \n3," "\n4, 1 \n'), layout())
    assert np.isnan(log["yaw_rate"].values).tolist() == [True, True, True, True, False]


@pytest.mark.parametrize("cell", ["x", "1_000", "1,5", "1-2", "0x10"])
def test_a_cell_that_is_not_a_number_is_an_error_with_line_column_and_text(
    tmp_path: Path, cell: str
) -> None:
    message = error_of(tmp_path, f'\n0,1\n\n1,"{cell}"\n')
    assert f"line 4, column 2: {cell!r} is not a number" in message


def test_a_point_beside_a_decimal_comma_is_an_error(tmp_path: Path) -> None:
    given_layout = layout(top="delimiter = ';'\ndecimal_comma = true")
    assert "'1.234'" in error_of(tmp_path, "0;1.234\n", given_layout)


def test_infinity_and_a_missing_time_are_errors_with_their_line(tmp_path: Path) -> None:
    assert "line 2 has an infinite yaw_rate" in error_of(tmp_path, "0,1\n1,-inf\n")
    assert "line 2 has an infinite yaw_rate" in error_of(tmp_path, "0,1\n1,1e999\n")
    assert "line 2 has no time" in error_of(tmp_path, "0,1\nnan,1\n")
    assert "line 1 has an infinite time" in error_of(tmp_path, "inf,1\n0,1\n")


def test_times_that_run_backwards_are_an_error_with_line_and_remedy(tmp_path: Path) -> None:
    message = error_of(tmp_path, "0,1\n2,1\n\n1,1\n")
    assert "backwards at line 4" in message
    assert "put the lines in the order of time" in message


def test_times_beyond_the_range_of_a_log_are_an_error(tmp_path: Path) -> None:
    assert "line 1 is before 1970" in error_of(tmp_path, "-1,1\n0,1\n")
    assert "line 2 is before 1970 or after 2262" in error_of(tmp_path, "0,1\n1e10,1\n")


def test_a_row_of_another_length_is_an_error_with_both_counts(tmp_path: Path) -> None:
    assert "line 3 has 3 columns where line 1 has 2" in error_of(tmp_path, "0,1\n\n1,2,3\n")


def test_a_column_beyond_the_table_is_an_error(tmp_path: Path) -> None:
    assert "line 1 has 1 columns, but yaw_rate should be column 2" in error_of(tmp_path, "0\n1\n")


def test_a_table_without_rows_is_an_error(tmp_path: Path) -> None:
    assert "no rows" in error_of(tmp_path, "")
    assert "no rows" in error_of(tmp_path, "t,r\n", layout(top="header = true"))


def test_a_wrong_encoding_is_an_error_with_its_line_and_remedy(tmp_path: Path) -> None:
    path = table(tmp_path, "0,1\n1,5°\n", "cp1252")
    with pytest.raises(LayoutError, match="line 2 is not utf-8; give the encoding"):
        read_table(path, layout())


def test_a_missing_table_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match="no such file"):
        read_table(tmp_path / "gone.txt", layout())
    with pytest.raises(LayoutError, match="cannot read"):
        read_table(tmp_path, layout())


def test_a_model_is_scaled_to_the_ship_at_equal_froude_number(tmp_path: Path) -> None:
    given_layout = layout(
        "[time]\ncolumn = 1\nunit = 's'\n[speed]\ncolumn = 2\nunit = 'm/s'\n"
        "[yaw_rate]\ncolumn = 3\nunit = 'rad/s'\n[rpm]\ncolumn = 4\nunit = 'rev/s'\n"
        "[rudder]\ncolumn = 5\nunit = 'rad'\n[position]\nnorth = 6\neast = 7\nunit = 'm'\n",
        "froude_scale = 25",
    )
    log = read_table(table(tmp_path, "0,1,1,1,1,1,2\n1,1,1,1,1,1,2\n"), given_layout)
    assert log["speed"].measured_ns.tolist() == [0, 5 * 10**9]
    expected = {"speed": 5.0, "yaw_rate": 0.2, "rpm": 12.0, "rudder": 1.0}
    assert {name: log[name].values[0] for name in expected} == pytest.approx(expected)
    assert log["position"].values.tolist() == [[25, 50], [25, 50]]
    assert log.metadata["froude_scale"] == "25.0"


def test_a_geographic_position_keeps_its_degrees(tmp_path: Path) -> None:
    text = "[time]\ncolumn = 1\nunit = 's'\n[position]\nlatitude = 2\nlongitude = 3\nunit = 'deg'\n"
    position = read_table(table(tmp_path, "0,59.5,24.25\n1,59.6,24.5\n"), layout(text))["position"]
    assert (position.fields, position.unit) == (("latitude", "longitude", "altitude"), "deg")
    np.testing.assert_array_equal(position.values, [[59.5, 24.25, np.nan], [59.6, 24.5, np.nan]])


def test_earth_fixed_velocities_are_converted_to_speed_and_sway(tmp_path: Path) -> None:
    given_layout = layout(
        "[time]\ncolumn = 1\nunit = 's'\n[heading]\ncolumn = 2\nunit = 'deg'\n"
        "[velocity_north]\ncolumn = 3\nunit = 'm/s'\n[velocity_east]\ncolumn = 4\nunit = 'm/s'\n"
    )
    # north bound and drifting east; east bound and drifting south: both to starboard
    log = read_table(table(tmp_path, "0,0,5,1\n1,90,-1,5\n"), given_layout)
    np.testing.assert_allclose(log["speed"].values, [5, 5])
    np.testing.assert_allclose(log["sway"].values, [1, 1])
    assert "over the ground" in log["speed"].metadata["computed_from"]


@pytest.mark.parametrize(
    "text",
    [
        "t,r\n0,1,\n1,2,\n",
        "t,r,\n0,1\n1,2\n",
        "t,r,,\r\n0,1,,\r\n\r\n1,2,,\r\n",
        "# gyro\nt,r\n0,1\n# a note, or two\n1,2\n",
        "# gyro\n# t,r\n0,1\n1,2\n",
        '\ufeff"t","r"\n"0","1"\n"1","2"\n',
    ],
)
def test_trailing_delimiters_comments_and_quotes_under_a_header(tmp_path: Path, text: str) -> None:
    named = MINIMAL.replace("column = 1", 'column = "t"').replace("column = 2", 'column = "r"')
    log = read_table(table(tmp_path, text), layout(named, "header = true"))
    np.testing.assert_allclose(log["yaw_rate"].values, np.radians([1, 2]))


def test_words_for_a_missing_value_are_not_measured(tmp_path: Path) -> None:
    words = ["NA", "-", "null", "N/A", "n/a", "NULL", "None", "--"]
    log = read_table(table(tmp_path, "".join(f"{i},{w}\n" for i, w in enumerate(words))), layout())
    assert np.isnan(log["yaw_rate"].values).all()


def test_an_iso_time_is_read_whatever_unit_the_layout_states(tmp_path: Path) -> None:
    text = "2026-03-29T00:55:00Z,1\n2026-03-29T00:55:01.5Z,2\n"
    log = read_table(table(tmp_path, text), layout())
    assert np.diff(log["yaw_rate"].measured_ns).tolist() == [1_500_000_000]
    assert log.warnings == ()


def test_days_of_a_spreadsheet(tmp_path: Path) -> None:
    excel = MINIMAL.replace('"s"', '"excel"\nzone = "UTC"')
    log = read_table(table(tmp_path, "46110.5,1\n"), layout(excel))
    assert (
        str(log["yaw_rate"].measured_ns.astype("datetime64[ns]")[0])[:19] == "2026-03-29T12:00:00"
    )


def test_positions_with_hemispheres_in_columns_of_their_own(tmp_path: Path) -> None:
    text = (
        "[time]\ncolumn = 1\nunit = 's'\n[position]\nlatitude = 2\nnorth_south = 3\n"
        "longitude = 4\neast_west = 5\nunit = 'ddmm.mmmm'\n"
    )
    log = read_table(table(tmp_path, "0,5412.0,S,00030.0,W\n1,,,,\n"), layout(text))
    np.testing.assert_array_equal(log["position"].values[:, :2], [[-54.2, -0.5], [np.nan, np.nan]])


@pytest.mark.parametrize("form", ["[position.{0}]", "['position.{0}']"])
def test_positions_of_several_receivers_are_sources(tmp_path: Path, form: str) -> None:
    text = (
        "[time]\ncolumn = 1\nunit = 's'\n[position]\nnorth = 2\neast = 3\nunit = 'm'\n"
        f"{form.format('bow')}\nlatitude = 4\nnorth_south = 5\nlongitude = 6\neast_west = 7\n"
        "unit = 'ddmm.mmmm'\n"
        f"{form.format('stern')}\nlatitude = 8\nlongitude = 9\naltitude = 10\nunit = 'deg'\n"
    )
    rows = "0,10,20,5430,S,01015,W,-54.4,-10.2,7\n1,11,21,5431,S,01016,W,-54.5,-10.3,8\n"
    log = read_table(table(tmp_path, rows), layout(text))
    assert [c.topic for c in log] == ["/position/table", "/position/bow", "/position/stern"]
    np.testing.assert_array_equal(log["position/table"].values, [[10, 20], [11, 21]])
    np.testing.assert_allclose(
        log["position/bow"].values[:, :2], [[-54.5, -10.25], [-54 - 31 / 60, -10 - 16 / 60]]
    )
    np.testing.assert_array_equal(
        log["position/stern"].values, [[-54.4, -10.2, 7], [-54.5, -10.3, 8]]
    )


def test_an_error_in_the_second_receiver_names_its_column(tmp_path: Path) -> None:
    text = "[time]\ncolumn = 1\nunit = 's'\n"
    for number, name in enumerate(("bow", "stern")):
        places = f"latitude = {2 + 2 * number}\nlongitude = {3 + 2 * number}\n"
        text += f"[position.{name}]\n{places}unit = 'deg'\n"
    assert "line 1, column 4" in error_of(tmp_path, "0,1,2,x,4\n", layout(text))


def test_a_position_in_radians_is_converted(tmp_path: Path) -> None:
    text = "[time]\ncolumn = 1\nunit = 's'\n[position]\nlatitude = 2\nlongitude = 3\nunit = 'rad'\n"
    position = read_table(table(tmp_path, "0,1,0.5\n"), layout(text))["position"]
    np.testing.assert_allclose(position.values[0, :2], np.degrees([1, 0.5]))


def test_further_quantities_are_kept_with_unit_and_sense(tmp_path: Path) -> None:
    text = (
        f"{MINIMAL}[power]\ncolumn = 3\nunit = 'kW'\n[rpm.port]\ncolumn = 4\nunit = 'Hz'\n"
        "[fuel_flow]\ncolumn = 5\nunit = 'kg/h'\npositive = 'to the engine'\n"
    )
    log = read_table(table(tmp_path, "0,1,2,3,4\n1,1,2,3,4\n"), layout(text))
    for suffix in (".csv", ".parquet"):  # and back
        for ending in (suffix, ".mcap"):
            target = tmp_path / f"x{ending}"
            source = tmp_path / f"x{suffix}"
            log = convert(source, target)[0] if ending == ".mcap" else log
            {".csv": write_csv, ".parquet": write_parquet, ".mcap": write}[ending](log, target)
        log = read(tmp_path / "x.mcap")
        assert [c.topic for c in log] == [
            "/yaw_rate/table", "/rpm/port", "/power/table", "/fuel_flow/table"
        ]  # fmt: skip
        assert log["power"].values[0] == 2000
        assert log["rpm"].values[0] == 180
        assert (log["fuel_flow"].unit, log["fuel_flow"].values[0]) == ("kg/h", 4)
        assert log["fuel_flow"].metadata["positive"] == "to the engine"
        assert read_log_info(tmp_path / "x.mcap").channels[-1].positive == "to the engine"


def test_no_bytes_of_a_table_end_in_another_exception(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    letters = b"0123456789.,;:-+eENT \t\n\r\"'#\xff\x00Z/"
    for _ in range(300):
        path = tmp_path / "x.txt"
        path.write_bytes(bytes(rng.choice(list(letters), 60)))
        with suppress(LayoutError):
            read_table(path, layout(top="encoding = 'cp1252'"))


# ---- values of few digits


def test_a_uniform_step_is_rebuilt_from_time_zero(tmp_path: Path) -> None:
    given_layout = layout(MINIMAL.replace('unit = "s"', 'unit = "s"\nrebuild = "uniform"'))
    text = "".join(f"{round(0.4 * i + 1e-6)},0\n" for i in range(100))
    times_ns = read_table(table(tmp_path, text), given_layout)["yaw_rate"].measured_ns
    assert times_ns[0] >= 0
    assert np.diff(times_ns) * 1e-9 == pytest.approx(0.4, rel=0.01)


def three_digits(values: np.ndarray) -> np.ndarray:
    return np.array([float(f"{value:.2e}") for value in values])


@pytest.mark.parametrize("step", [0.0213, 0.135265, 1.7])
@pytest.mark.parametrize("start", [0.0, 37.0])
def test_a_uniform_step_is_rebuilt_from_times_of_three_digits(step: float, start: float) -> None:
    times = start + step * np.arange(3000)
    rebuilt, wrong = uniform_times(three_digits(times))
    assert wrong is None
    assert np.diff(rebuilt) == pytest.approx(step, rel=1e-4)
    assert np.max(np.abs(rebuilt - times)) < step


def test_exact_uniform_times_stay_as_they_are() -> None:
    times = 0.1 * np.arange(100)
    np.testing.assert_allclose(uniform_times(times)[0], times, atol=1e-9)


def test_times_that_are_not_uniform_are_an_error(tmp_path: Path) -> None:
    given_layout = layout(MINIMAL.replace('unit = "s"', 'unit = "s"\nrebuild = "uniform"'))
    lines = [f"{i if i < 50 else i + 40},0\n" for i in range(100)]
    assert "the times are not uniform" in error_of(tmp_path, "".join(lines), given_layout)
    assert "the times are not uniform" in error_of(tmp_path, "1,0\n1,0\n1,0\n", given_layout)


def test_a_heading_of_few_digits_is_rebuilt_despite_a_gyro_bias() -> None:
    time_secs = np.arange(0, 900, 0.2)
    heading = np.radians(120 + 25 * np.sin(time_secs / 40) + 0.1 * time_secs)
    rate = np.radians(25 / 40 * np.cos(time_secs / 40) + 0.1) + np.radians(0.005)
    printed = np.radians(np.round(np.degrees(heading)) % 360)
    printed[1000:1010] = np.nan
    rebuilt = rebuilt_heading(time_secs, printed, rate)
    assert np.isnan(rebuilt).sum() == 10
    assert np.degrees(np.nanmax(np.abs(rebuilt - heading))) < 0.2
    assert np.degrees(np.nanstd(rebuilt - heading)) < 0.06


@pytest.mark.parametrize("count", [1, 2, 15])
def test_a_short_heading_is_rebuilt_too(count: int) -> None:
    time_secs = np.arange(count) * 1.0
    np.testing.assert_allclose(
        rebuilt_heading(time_secs, 0.01 * time_secs, np.full(count, 0.01)),
        0.01 * time_secs,
        atol=1e-9,
    )


# ---- the table of the sample data


def test_the_bridges_table_agrees_with_its_simulated_trial() -> None:
    log = read_table(SAMPLE_DATA / "bridge.csv", load_layout(LAYOUTS / "bridge.toml"))
    truth = simulate(load_vessel("table1")[0], "zigzag-20-20", duration_secs=600.0, seed=5).truth(2)
    start_ns = int(truth["yaw_rate"].measured_ns[0])
    assert log["yaw_rate"].measured_ns[0] == pytest.approx(start_ns, abs=5 * 10**8)
    for name, tolerance in {"yaw_rate": 1e-3, "heading": 0.01, "rudder": 0.02, "rpm": 1}.items():
        channel, exact = log[name], truth[name]
        values = np.interp(channel.measured_ns, exact.measured_ns, exact.values)
        error = channel.values - values
        if name == "heading":
            error = (error + np.pi) % (2 * np.pi) - np.pi
        assert np.sqrt(np.mean(error**2)) < tolerance, name
    assert log["position"].fields[:2] == ("latitude", "longitude")
    assert log.warnings == ()


# ---- the real data


def kvlcc2(laboratory: str) -> list[Path]:
    return sorted((KVLCC2 / laboratory).glob("*.dat"))


def real(path: Path) -> TrialLog:
    return read_table(path, load_layout(LAYOUTS / f"simman_{path.parent.name}.toml"))


RUNS = [pytest.param(path, id=path.stem) for path in kvlcc2("marin") + kvlcc2("hsva")] or [
    pytest.param(Path(), marks=pytest.mark.skip("the SIMMAN data are not in ../shared/data/kvlcc2"))
]


@pytest.mark.parametrize("path", RUNS)
def test_a_kvlcc2_run_begins_at_eight_metres_a_second_and_91_rpm(path: Path) -> None:
    log = real(path)
    assert log["speed"].values[0] == pytest.approx(8.0, abs=0.15)
    assert log["rpm"].values == pytest.approx(91.3, abs=0.9)
    assert np.all(log["speed"].values > 2.4)


@pytest.mark.parametrize("path", RUNS)
def test_the_yaw_rate_is_the_derivative_of_the_heading(path: Path) -> None:
    log = real(path)
    time_secs = (log["heading"].measured_ns - log["heading"].measured_ns[0]) * 1e-9
    turned = np.gradient(log["heading"].values, time_secs)
    assert np.degrees(np.std(turned - log["yaw_rate"].values)) < 0.012


@pytest.mark.parametrize("path", RUNS)
def test_speed_and_sway_agree_with_the_differentiated_positions(path: Path) -> None:
    log = real(path)
    position, heading = log["position"], log["heading"].values
    dt = float(np.diff(position.measured_ns).mean()) * 1e-9
    half = int(30 / dt)  # s; MARIN's positions are printed to 10 m
    north, east = (
        savgol_filter(position.values[:, i], 2 * half + 1, 3, deriv=1, delta=dt) for i in (0, 1)
    )
    inner = slice(half, -half)
    ahead = (north * np.cos(heading) + east * np.sin(heading))[inner]
    across = (east * np.cos(heading) - north * np.sin(heading))[inner]
    assert np.std(ahead - log["speed"].values[inner]) < 0.15
    assert np.std(across - log["sway"].values[inner]) < 0.25


@pytest.mark.parametrize("path", RUNS)
def test_a_positive_rudder_is_followed_by_a_turn_to_starboard(path: Path) -> None:
    log = real(path)
    rudder, rate = log["rudder"].values, log["yaw_rate"].values
    dt = float(np.diff(log["rudder"].measured_ns).mean()) * 1e-9
    first = int(np.argmax(np.abs(rudder) > 0.8 * np.abs(rudder).max()))
    later = first + int(30 / dt)
    assert np.sign(rate[later] - rate[first]) == np.sign(rudder[first])


@pytest.mark.parametrize("path", [p for p in RUNS if "MARIN" in str(p.id)] or RUNS)
def test_the_step_of_marins_runs_is_rebuilt(path: Path) -> None:
    steps = np.diff(real(path)["rudder"].measured_ns) * 1e-9
    assert steps == pytest.approx(0.135265, abs=2e-6)


@pytest.mark.parametrize("path", [p for p in RUNS if "HSVA" in str(p.id)] or RUNS)
def test_a_fine_heading_rounded_as_marins_is_rebuilt_from_the_yaw_rate(path: Path) -> None:
    log = real(path)
    time_secs = (log["heading"].measured_ns - log["heading"].measured_ns[0]) * 1e-9
    fine = log["heading"].values
    printed = np.radians(three_digits(np.degrees(fine) + 150) - 150)  # to whole degrees
    biased = log["yaw_rate"].values + np.radians(0.005)
    rebuilt = rebuilt_heading(time_secs, printed, biased)
    assert np.degrees(np.std(printed - fine)) > 0.28
    assert np.degrees(np.std(rebuilt - fine)) < 0.06


def sided_layout(role: str, unit: str, extra: str = "") -> str:
    """A layout of seconds and one quantity, by their headers."""
    return (
        'header = true\n[time]\ncolumn = "t"\nunit = "s"\n'
        f'[{role}]\ncolumn = "x"\nunit = "{unit}"\n{extra}'
    )


def test_letters_of_port_and_starboard_are_signs(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("t,x\n0,5.0P\n1,STBD 5.0\n2,0.0\n3,\n")
    log = read_table(path, parse_layout(sided_layout("rudder", "deg"), "x.toml"))
    np.testing.assert_allclose(np.degrees(log["rudder"].values), [-5, 5, 0, np.nan])
    opposite = parse_layout(sided_layout("rudder", "deg", "sign = -1\n"), "x.toml")
    with pytest.raises(LayoutError, match="sign = -1 is wrong"):
        read_table(path, opposite)


@pytest.mark.parametrize("top", ["t,x [kn]\n", "t,x\ns,kn\n"])
def test_a_unit_in_the_table_that_contradicts_the_layout_is_a_warning(
    tmp_path: Path, top: str
) -> None:
    path = tmp_path / "x.csv"
    path.write_text(top + "0,5\n1,5\n")
    name = top.split("\n", maxsplit=1)[0].split(",")[1]
    for unit, count in (("m/s", 1), ("kn", 0)):
        text = sided_layout("speed", unit).replace('"x"', f'"{name}"')
        warnings = read_table(path, parse_layout(text, "x.toml")).warnings
        assert sum("the table states kn" in w for w in warnings) == count


@pytest.mark.parametrize(
    ("times", "count"),
    [(("100057", "100058", "100059", "100100"), 1), (("100058", "100059", "100060", "100100"), 0),
     (("100000", "100100", "100200"), 0), (("0", "1", "2"), 0)],
)  # fmt: skip
def test_six_digit_day_times_read_as_seconds_are_a_warning(
    tmp_path: Path, times: tuple[str, ...], count: int
) -> None:
    path = tmp_path / "x.csv"
    path.write_text("t,x\n" + "".join(f"{t},5\n" for t in times))
    warnings = read_table(path, parse_layout(sided_layout("speed", "kn"), "x.toml")).warnings
    assert sum("hhmmss" in w for w in warnings) == count

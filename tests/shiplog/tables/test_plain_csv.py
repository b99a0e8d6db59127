"""CSV for other programs, wide and long, in SI units or those of people."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from geographic import geographic_log
from places import SAMPLE_DATA

import shiplog
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode
from shiplog.types import TrialLog

LOG = str(SAMPLE_DATA / "zigzag_10_10_dropouts.mcap")


@pytest.fixture(scope="module")
def log() -> TrialLog:
    return shiplog.read(LOG)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("people", [True, False])
def test_wide_csv_has_the_values_of_the_wide_frame_with_units_in_its_headers(
    log: TrialLog, people: bool
) -> None:
    units = ["--units", "people"] if people else []
    assert main(["convert", LOG, "wide.csv", "--wide", *units]) == ExitCode.OK
    table, frame = pd.read_csv("wide.csv"), log.to_pandas(display_units=people)
    names = [f"{name} [{unit}]" for name, unit in frame.attrs["units"].items()]
    assert list(table.columns) == ["time (UTC)", "elapsed [s]", *(frame if people else names)]
    assert "speed [kn]" in table if people else "speed [m/s]" in table
    values = table.iloc[:, 2:].to_numpy()
    np.testing.assert_allclose(values, frame.to_numpy(), rtol=1e-9 if people else 0, atol=1e-12)
    assert np.isnan(values).any()
    stamps = pd.to_datetime(table["time (UTC)"], utc=True).dt.tz_localize(None)
    near = np.abs(stamps.to_numpy() - frame.index.tz_localize(None).to_numpy())
    assert near.max() < np.timedelta64(1, "us")
    assert table["elapsed [s]"].iloc[-1] == pytest.approx(600.0, abs=0.1)


def test_long_csv_has_each_sample_with_its_unit(log: TrialLog) -> None:
    assert main(["convert", LOG, "long.csv", "--units", "people"]) == ExitCode.OK
    table = pd.read_csv("long.csv")
    speed = table[table["channel"] == "speed"]
    np.testing.assert_allclose(speed["value"], log["speed"].values * 3600 / 1852, rtol=1e-9)
    assert set(speed["unit"]) == {"kn"}
    assert len(table) == sum(channel.values.size for channel in log)
    north = table[table["component"] == "north"]
    np.testing.assert_allclose(north["value"], log["position"].values[:, 0], rtol=1e-9)
    assert main(["convert", LOG, "si.csv", "--units", "si"]) == ExitCode.OK
    rudder = pd.read_csv("si.csv").query("channel == 'rudder'")
    assert rudder["value"].tolist() == log["rudder"].values.tolist()


def test_a_wide_csv_becomes_a_log_by_the_layout_that_is_drafted_for_it(log: TrialLog) -> None:
    log = geographic_log(log)
    shiplog.write(log, "log.mcap")
    assert main(["convert", "log.mcap", "wide.csv", "--wide", "--units", "people"]) == ExitCode.OK
    assert main(["layout", "wide.csv", "-o", "wide.toml"]) == ExitCode.OK
    assert main(["convert", "wide.csv", "back.mcap", "--layout", "wide.toml"]) == ExitCode.OK
    back = shiplog.read("back.mcap")
    assert {channel.name for channel in back} == {channel.name for channel in log}
    times, values = log["rudder"].measured_ns, log["rudder"].values
    found = np.interp(back["rudder"].measured_ns, times, values)
    microsecond = 0.05 * 1e-6  # of time, in which the steering gear turns the rudder so far
    np.testing.assert_allclose(back["rudder"].values, found, rtol=0, atol=microsecond)
    latitude, recorded = back["position"].values[:, 0], log["position"].values[:, 0]
    assert latitude[[0, -1]] == pytest.approx(recorded[[0, -1]], abs=1e-5)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["x.parquet", "--wide"], "only a .csv file has a shape and units"),
        (["x.kml", "--units", "si"], "only a .csv file has a shape and units"),
    ],
)
def test_options_that_do_not_fit_the_target_are_refused(
    arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", LOG, *arguments]) == ExitCode.USAGE
    assert text in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "text"),
    [(["--wide"], "shiplog layout"), (["--units", "si"], "convert that without --units")],
)
def test_reading_a_plain_csv_without_a_layout_is_refused_with_the_remedy(
    options: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", LOG, "t.csv", "--to", "20", *options]) == ExitCode.OK
    assert main(["convert", "t.csv", "t.mcap"]) == ExitCode.USAGE
    assert text in capsys.readouterr().err

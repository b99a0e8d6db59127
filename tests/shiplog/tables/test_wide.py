"""Wide tables of a trial in pandas and xarray."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from small_logs import trial

from shiplog.errors import LogError, UsageError
from shiplog.resampling import resample
from shiplog.tables.long_form import from_frame, to_frame
from shiplog.types import Channel, TrialLog

START = 1_700_000_000_000_000_000


def channel(name: str, seconds: list[float], values: list[float], source: str = "a") -> Channel:
    at = START + np.round(np.array(seconds) * 1e9).astype(np.int64)
    return Channel(name, source, "rad", at, at, np.array(values))


def test_the_columns_are_those_of_resample_on_the_same_clock(zigzag_log: TrialLog) -> None:
    frame, signals = zigzag_log.to_pandas(), resample(zigzag_log)
    assert {"yaw_rate", "speed", "rudder", "rpm"} <= set(frame.columns)
    assert np.array_equal(frame.index.as_unit("ns").asi8, signals.timestamps_ns)
    for name in ("yaw_rate", "speed", "rudder", "rpm"):
        np.testing.assert_array_equal(frame[name], signals[name])


def test_the_index_is_the_time_in_utc() -> None:
    frame = TrialLog("x", (channel("rudder", [0, 1, 2], [0, 0.1, 0.2]),)).to_pandas(0.5)
    assert isinstance(frame.index, pd.DatetimeIndex)
    assert str(frame.index.tz) == "UTC"
    assert frame.index[0] == pd.Timestamp(START, unit="ns", tz="UTC")
    assert frame["rudder"].tolist() == pytest.approx([0, 0.05, 0.1, 0.15, 0.2])


def test_the_clock_covers_all_channels_and_takes_the_shortest_interval() -> None:
    slow, fast = channel("speed", [0, 2, 4], [1, 2, 3]), channel("yaw_rate", [3, 4, 5, 6], [0] * 4)
    frame = TrialLog("x", (slow, fast)).to_pandas()
    assert len(frame) == 7
    np.testing.assert_array_equal(frame["speed"], [1, np.nan, 2, np.nan, 3, np.nan, np.nan])
    assert frame["yaw_rate"].isna().sum() == 3


def test_display_units_are_named_in_the_columns(zigzag_log: TrialLog) -> None:
    si, shown = zigzag_log.to_pandas(), zigzag_log.to_pandas(display_units=True)
    np.testing.assert_allclose(shown["yaw_rate [deg/s]"], np.degrees(si["yaw_rate"]))
    np.testing.assert_allclose(shown["speed [kn]"], si["speed"] * 3600 / 1852)
    assert shown.attrs["units"]["rudder [deg]"] == "deg"
    assert si.attrs["units"]["rudder"] == "rad"


def further_channels() -> TrialLog:
    """Return a log of quantities that no replay uses, and a second shaft."""
    at, port = [0.0, 1.0, 2.0, 3.0], [80.0, 81.0, 82.0, 83.0]
    units = {"heel": "rad", "power": "W", "fuel_flow": "kg/h", "thruster_azimuth": "rad"}
    further = [
        replace(channel(name, at, [0.1, 0.2, 0.3, 0.4]), unit=unit) for name, unit in units.items()
    ]
    shafts = [
        replace(channel("rpm", at, [k * each for each in port], source), unit="rpm")
        for source, k in (("port", 1), ("starboard", 2))
    ]
    return TrialLog("x", (*further, *shafts))


def test_further_channels_are_columns_with_their_units() -> None:
    frame = further_channels().to_pandas()
    assert frame.attrs["units"] == {
        "heel": "rad", "power": "W", "fuel_flow": "kg/h", "thruster_azimuth": "rad",
        "rpm": "rpm", "rpm/starboard": "rpm",
    }  # fmt: skip
    assert frame["power"].tolist() == [0.1, 0.2, 0.3, 0.4]
    assert frame["rpm/starboard"].tolist() == [160.0, 162.0, 164.0, 166.0]


def test_further_channels_are_shown_in_the_units_people_use() -> None:
    log = further_channels()
    frame = log.to_pandas(display_units=True)
    assert list(frame.columns) == [
        "heel [deg]", "power [kW]", "fuel_flow [kg/h]", "thruster_azimuth [deg]",
        "rpm [rpm]", "rpm/starboard [rpm]",
    ]  # fmt: skip
    assert list(frame.attrs["units"].values()) == ["deg", "kW", "kg/h", "deg", "rpm", "rpm"]
    expected = (
        ("heel", 180 / np.pi),
        ("power", 1e-3),
        ("fuel_flow", 1),
        ("thruster_azimuth", 180 / np.pi),
    )
    for (name, factor), column in zip(expected, frame.columns, strict=False):
        np.testing.assert_allclose(frame[column], log[name].values * factor)


def test_the_long_form_keeps_further_channels_with_their_units() -> None:
    log = further_channels()
    frame = to_frame(log)
    assert set(frame["topic"]) == {each.topic for each in log}
    power = frame[frame["topic"] == "/power/a"]
    assert power["value"].tolist() == log["power"].values.tolist()
    back = from_frame(frame)
    assert {each.topic: each.unit for each in back} == {each.topic: each.unit for each in log}


def test_components_and_second_sources_are_columns_and_empty_channels_are_omitted() -> None:
    frame = trial().to_pandas()
    assert list(frame.columns) == ["yaw_rate", "position_north", "position_east", "yaw_rate/mems"]
    np.testing.assert_allclose(frame["position_east"], trial()["position"].values[:, 1])
    np.testing.assert_allclose(frame["yaw_rate/mems"], trial()["yaw_rate/mems"].values[::-1])


def test_a_geographic_position_keeps_its_units() -> None:
    at = START + 10**9 * np.arange(3)
    fields = ("latitude", "longitude", "altitude")
    gps = Channel("position", "gps", "deg", at, at, np.arange(9.0).reshape(3, 3), fields)
    units = TrialLog("x", (gps,)).to_pandas(display_units=True).attrs["units"]
    assert list(units.values()) == ["deg", "deg", "m"]


def test_what_cannot_be_resampled_is_an_error() -> None:
    with pytest.raises(LogError, match="no channel with two valid samples or more in x"):
        TrialLog("x", (channel("speed", [0], [1]),)).to_pandas()
    far = TrialLog("x", (channel("speed", [0, 1, 2, 1e9], [1, 2, 3, 4]),))
    with pytest.raises(LogError, match=r"span 1.157e\+04 days.*larger dt_secs"):
        far.to_pandas()
    with pytest.raises(UsageError, match="dt_secs must be a positive number of seconds, got 0"):
        far.to_pandas(0)


def test_a_dataset_has_the_columns_and_units_of_the_frame(zigzag_log: TrialLog) -> None:
    pytest.importorskip("xarray")
    dataset, frame = zigzag_log.to_xarray(dt_secs=1.0), zigzag_log.to_pandas(dt_secs=1.0)
    assert set(dataset.data_vars) == set(frame.columns)
    assert dataset["speed"].attrs["units"] == "m/s"
    np.testing.assert_array_equal(dataset["speed"], frame["speed"])
    np.testing.assert_array_equal(dataset["time"], frame.index.tz_localize(None))

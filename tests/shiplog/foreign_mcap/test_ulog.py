"""ULog files of PX4: their topics, the drafted layout, and the channels it gives."""

import json
from pathlib import Path

import numpy as np
import pytest
from ulog_files import write_ulog

import shiplog
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode
from shiplog.errors import LogError, ShiplogError
from shiplog.foreign_mcap.ulog import ulog_as_mcap

pytest.importorskip("pyulog")
UTC_USEC = 1_767_225_600_000_000  # of boot
COUNT = 50
SECS = 0.1 * np.arange(COUNT)
RATE, HEADING = 0.01 * np.sin(SECS), 0.5 + 0.1 * SECS  # rad/s, rad


def stamps(first_usec: int = 5_000_000) -> list[int]:
    return [first_usec + round(1e6 * secs) for secs in SECS]


TIMES = stamps()
SAMPLED = [time - 2000 for time in TIMES]
TOPICS = [
    (
        "vehicle_angular_velocity",
        ["uint64_t timestamp", "uint64_t timestamp_sample", "float[3] xyz"],
        [[t, s, 0.0, 0.0, r] for t, s, r in zip(TIMES, SAMPLED, RATE, strict=True)],
    ),
    (
        "vehicle_attitude",
        ["uint64_t timestamp", "float[4] q"],
        [[t, np.cos(h / 2), 0.0, 0.0, np.sin(h / 2)] for t, h in zip(TIMES, HEADING, strict=True)],
    ),
    (
        "vehicle_global_position",
        ["uint64_t timestamp", "double lat", "double lon", "float alt"],
        [[t, 60 + 1e-6 * i, 20.0, 3.0] for i, t in enumerate(TIMES)],
    ),
    (
        "sensor_gps",
        ["uint64_t timestamp", "uint64_t time_utc_usec"],
        [[TIMES[0], 0], [TIMES[1], UTC_USEC + TIMES[1]]],
    ),
]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_drafted_layout_gives_the_channels_of_a_log_in_utc() -> None:
    write_ulog(Path("flight.ulg"), TOPICS)
    assert main(["layout", "flight.ulg", "-o", "px4.toml"]) == ExitCode.OK
    assert main(["convert", "flight.ulg", "trial.mcap", "--layout", "px4.toml"]) == ExitCode.OK
    log = shiplog.read("trial.mcap")
    rate, heading, position = log["yaw_rate"], log["heading"], log["position"]
    np.testing.assert_allclose(rate.values, RATE, rtol=1e-6)
    np.testing.assert_allclose(heading.values, HEADING, rtol=1e-6)
    np.testing.assert_allclose(position.values[:, 0], 60 + 1e-6 * np.arange(COUNT), rtol=1e-12)
    utc_ns = UTC_USEC * 1000
    assert (heading.measured_ns - utc_ns).tolist() == [time * 1000 for time in TIMES]
    assert (rate.measured_ns - utc_ns).tolist() == [time * 1000 for time in SAMPLED]
    assert (rate.received_ns - utc_ns).tolist() == [time * 1000 for time in TIMES]
    assert log.metadata["converted_from"] == "flight.ulg"


def test_info_lists_the_topics(capsys: pytest.CaptureFixture[str]) -> None:
    write_ulog(Path("flight.ulg"), [*TOPICS, TOPICS[1]], instances={4: 1})
    assert main(["info", "flight.ulg", "--json", "-"]) == ExitCode.OK
    content = json.loads(capsys.readouterr().out)
    assert content["name"] == "flight.ulg"
    assert content["start_utc"].startswith("2026-01-01T00:00:05")
    topics = {topic["topic"]: topic for topic in content["foreign"]}
    assert topics["/vehicle_attitude/1"]["schema"] == "vehicle_attitude"
    assert topics["/vehicle_angular_velocity"]["messages"] == COUNT


def test_without_a_gnss_time_the_times_count_from_boot_with_a_warning(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_ulog(Path("flight.ulg"), TOPICS[:2])
    assert main(["layout", "flight.ulg", "-o", "px4.toml"]) == ExitCode.OK
    assert main(["convert", "flight.ulg", "trial.mcap", "--layout", "px4.toml"]) == ExitCode.OK
    assert "count from boot" in capsys.readouterr().err
    first = shiplog.read("trial.mcap")["heading"].measured_ns[0]
    assert np.datetime64(int(first), "ns") == np.datetime64("2000-01-01T00:00:05")


@pytest.mark.parametrize(
    ("data", "text"),
    [(b"", "not a ULog file"), (b"ULog", "not a ULog file"), (b"x" * 100, "not a ULog file")],
)
def test_what_is_no_ulog_is_refused(
    data: bytes, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("flight.ulg").write_bytes(data)
    assert main(["info", "flight.ulg"]) == ExitCode.FAILURE
    err = capsys.readouterr().err
    assert text in err
    assert err.count("\n") == 1


def test_a_missing_layout_and_an_empty_file_are_refused_with_the_remedy(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_ulog(Path("flight.ulg"), TOPICS)
    assert main(["convert", "flight.ulg", "a.mcap"]) == ExitCode.USAGE
    assert "--layout" in capsys.readouterr().err
    write_ulog(Path("empty.ulg"), [])
    with pytest.raises(LogError, match="no messages in it"), ulog_as_mcap(Path("empty.ulg")):
        pass
    Path("wrong.toml").write_text('[heading]\ntopic = "/attitude"\nfield = "q"\nunit = "rad"\n')
    assert main(["convert", "flight.ulg", "a.mcap", "--layout", "wrong.toml"]) != ExitCode.OK
    err = capsys.readouterr().err
    assert "no topic '/attitude'" in err
    assert err.rstrip().endswith(": flight.ulg")
    assert not Path("a.mcap").exists()


def test_without_a_place_for_the_temporary_copy_the_remedy_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    flight = write_ulog(tmp_path / "flight.ulg", TOPICS)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with pytest.raises(ShiplogError, match=r"cannot write a temporary copy.*TMPDIR"):
        ulog_as_mcap(flight).__enter__()


def test_a_file_that_is_cut_off_is_read_to_the_cut() -> None:
    data = write_ulog(Path("flight.ulg"), TOPICS).read_bytes()
    Path("cut.ulg").write_bytes(data[: len(data) // 2])
    assert main(["info", "cut.ulg"]) in {ExitCode.OK, ExitCode.DATA_LOST}

"""The verbs `record` and `mark` with live sources, as processes on loopback."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest
from extensions import declare, import_from
from mcap.reader import make_reader
from places import PROJECT

from recorders.streams.format import GROUP
from shiplog import read
from shiplog.cli.main import main

TRIAL = """
[output]
file = "trial.mcap"
[conditions]
draught_aft = 8.5
[[source]]
name = "bridge"
format = "numbers"
address = "udp://127.0.0.1:{port}"
[[source]]
name = "engine"
format = "numbers"
address = "tcp://127.0.0.1:1"
"""
NEEDED = (b"yaw_rate 0.01", b"speed 7.5", b"rudder -0.1", b"rpm 80")


@pytest.fixture
def environment(tmp_path: Path) -> Mapping[str, str]:
    """An environment in which the format `numbers` is installed."""
    declare(tmp_path / "site", "numbers", GROUP, numbers="number_format:NUMBERS")
    folders = (tmp_path / "site", PROJECT, PROJECT / "tests" / "helpers")
    return os.environ | {"PYTHONPATH": os.pathsep.join(map(str, folders))}


@contextmanager
def _running(
    environment: Mapping[str, str], folder: Path, *arguments: str
) -> Iterator["subprocess.Popen[str]"]:
    with subprocess.Popen(
        [sys.executable, "-m", "shiplog", *arguments],
        env=environment,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def _free_port() -> int:
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _send(port: int, *lines: bytes) -> None:
    with socket.socket(type=socket.SOCK_DGRAM) as sender:
        for line in lines:
            sender.sendto(line, ("127.0.0.1", port))


def _wait_for_line(process: "subprocess.Popen[str]", text: str) -> None:
    """Wait until the process has printed a line on stderr."""
    assert process.stderr is not None
    for line in process.stderr:
        if text in line:
            return
    raise AssertionError(f"{text!r} was not printed")


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_a_live_trial_is_recorded_marked_and_ended_by_a_signal(
    environment: Mapping[str, str], tmp_path: Path, ending: signal.Signals
) -> None:
    port = _free_port()
    (tmp_path / "trial.toml").write_text(TRIAL.format(port=port), encoding="utf-8")
    with _running(environment, tmp_path, "record", "trial.toml") as process:
        _wait_for_line(process, "recording to trial.mcap")
        time.sleep(0.3)
        _send(port, *NEEDED, b"noise")
        with _running(environment, tmp_path, "mark", "trial", "execute, 20 starboard") as mark:
            output, error = mark.communicate(timeout=60)
            assert (mark.returncode, error) == (0, "")
            assert output == "marked in trial: execute, 20 starboard\n"
        process.send_signal(ending)
        output, error = process.communicate(timeout=60)
    assert process.returncode == 0, error
    assert "trial.mcap: 4 samples of 4 channels" in output
    assert "not a number" in output
    log = read(tmp_path / "trial.mcap")
    assert log["yaw_rate/bridge.N"].values.tolist() == [0.01]
    assert log.metadata["condition.draught_aft"] == "8.5 m"
    assert log.metadata["bridge.rejected.not a number"] == "1"
    with (tmp_path / "trial.mcap").open("rb") as file:
        events = [m.data for _, _, m in make_reader(file).iter_messages(topics=["/events"])]
    assert any(b"execute, 20 starboard" in event for event in events)
    assert any(b"no connection to tcp://127.0.0.1:1: Connection refused" in e for e in events)
    assert [path.name for path in tmp_path.glob("*.part")] == []


def test_what_a_killed_recorder_received_a_second_before_can_be_read(
    environment: Mapping[str, str], tmp_path: Path
) -> None:
    port = _free_port()
    command = ("record", "numbers", f"udp://127.0.0.1:{port}", "-o", "trial.mcap")
    with _running(environment, tmp_path, *command) as process:
        _wait_for_line(process, "recording to trial.mcap")
        time.sleep(0.3)
        _send(port, *NEEDED)
        time.sleep(1.0)
        process.kill()
        process.wait(timeout=60)
    log = read(tmp_path / "trial.mcap.part")
    assert {channel.name: channel.values.tolist() for channel in log.channels} == {
        "yaw_rate": [0.01],
        "speed": [7.5],
        "rudder": [-0.1],
        "rpm": [80.0],
    }


def test_a_recording_goes_on_without_stdin_and_when_nobody_reads_its_status(
    environment: Mapping[str, str], tmp_path: Path
) -> None:
    port = _free_port()
    command = (sys.executable, "-c", CLOSED, f"udp://127.0.0.1:{port}")
    with subprocess.Popen(
        command, env=environment, cwd=tmp_path, stderr=subprocess.PIPE, text=True
    ) as process:
        _wait_for_line(process, "recording to trial.mcap")
        assert process.stderr is not None
        process.stderr.close()
        time.sleep(0.3)
        _send(port, *NEEDED)
        time.sleep(1.0)
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=60)
    assert len(read(tmp_path / "trial.mcap").channels) == 4


CLOSED = """
import os, sys
sys.stdin = None
from recorders.cli import live_display
live_display.LINE_SECS = 0.1
from shiplog.cli.main import main
main(["record", "numbers", sys.argv[1], "-o", "trial.mcap"])
"""


def test_a_second_recorder_of_one_log_is_refused_and_the_first_goes_on(
    environment: Mapping[str, str], tmp_path: Path
) -> None:
    command = ("record", "numbers", f"udp://127.0.0.1:{_free_port()}", "-o", "trial.mcap")
    with _running(environment, tmp_path, *command) as first:
        _wait_for_line(first, "recording to trial.mcap")
        with _running(environment, tmp_path, *command) as second:
            output, error = second.communicate(timeout=60)
        assert (second.returncode, output) == (1, "")
        assert "another recorder is writing it" in error
        assert error.count("\n") == 1
        with _running(environment, tmp_path, "mark", "trial", "execute") as mark:
            assert mark.wait(timeout=60) == 0
        first.send_signal(signal.SIGHUP)
        _, error = first.communicate(timeout=60)
    assert first.returncode == 1
    assert "no sample was recorded" in error
    assert [event.text for event in read(tmp_path / "trial.mcap").events] == ["execute"]
    with _running(environment, tmp_path, *command) as third:
        output, error = third.communicate(timeout=60)
    assert third.returncode == 1
    assert "a live recording replaces none" in error


def test_a_dry_run_reports_what_is_missing_and_writes_nothing(
    environment: Mapping[str, str], tmp_path: Path
) -> None:
    port = _free_port()
    (tmp_path / "trial.toml").write_text(TRIAL.format(port=port), encoding="utf-8")
    with _running(environment, tmp_path, "record", "--dry-run", "trial.toml") as process:
        _wait_for_line(process, "listening")
        time.sleep(0.3)
        _send(port, *NEEDED[:3])
        time.sleep(0.7)
        process.send_signal(signal.SIGINT)
        output, error = process.communicate(timeout=60)
    assert process.returncode == 1, error
    assert "missing for a replay: rpm" in output
    assert "nothing decoded from engine: nothing was received; check the address" in output
    assert "/yaw_rate/bridge.N" in output
    assert "Connection refused" in " ".join(output.split())
    assert list(tmp_path.glob("*.mcap*")) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("record numbers none.txt -o a.mcap", "no such file: none.txt"),
        ("record numbers udp://127.0.0.1 -o a.mcap", "host or port is missing"),
        ("record numbers none.txt", "no output; add -o FILE"),
        ("record none.toml", "cannot read the trial file"),
        ("record trial none.toml", "cannot read the trial file"),
        ("record --dry-run simulate spiral -o a.mcap", "--dry-run is for trial files"),
        ("mark none execute", "no recording of it runs here"),
    ],
)
def test_what_cannot_be_recorded_is_one_line_of_error(
    environment: Mapping[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: str,
    message: str,
) -> None:
    import_from(environment, monkeypatch)
    monkeypatch.chdir(tmp_path)
    assert main(arguments.split()) in (1, 2)
    output, error = capsys.readouterr()
    assert output == ""
    assert message in error
    assert error.count("\n") == 1

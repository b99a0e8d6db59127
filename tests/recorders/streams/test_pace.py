"""Recordings let through at their own pace give the same log as at full speed, to the last byte."""

import time
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest

from recorders.streams.pace import STEP_NS, paced
from recorders.streams.packets import Packet
from shiplog.cli.main import main

SHIP = Path(__file__).parents[3] / "sample_data" / "ship.nmea"
LAST_SECS = 500.0  # of its stamps, since the first one


class SimulatedClock:
    """A clock that runs on only while somebody sleeps by it."""

    def __init__(self) -> None:
        self.secs = 0.0

    def now(self) -> float:
        """Return the time, s."""
        return self.secs

    def sleep(self, secs: float) -> None:
        """Let time pass."""
        self.secs += secs


def _outputs(folder: Path, sentences: bytes, *options: str, replay: bool) -> dict[str, bytes]:
    """Record sentences, and return the samples of the log and the summary of its replay."""
    folder.mkdir()
    file, log = folder / "ship.nmea", folder / "ship.mcap"
    file.write_bytes(sentences)
    assert main(["record", "nmea0183", str(file), *options, "-o", str(log)]) == 0
    assert main(["convert", str(log), str(folder / "ship.csv")]) == 0
    if replay:
        paths = ["-o", str(folder / "ship.rrd"), "--json", str(folder / "ship.json")]
        assert main(["replay", str(log), "--length", "320", *paths]) == 0
    written = [path for path in folder.iterdir() if path.suffix in (".csv", ".json")]
    return {path.name: path.read_bytes() for path in written}


def test_packets_are_let_through_when_they_are_due() -> None:
    clock = SimulatedClock()
    packets = [Packet(b"", n * 10**8) for n in range(100)]
    parts = [
        (clock.secs, part[-1].received_ns)
        for part in paced(iter([packets]), 2.0, clock=clock.now, sleep=clock.sleep)
    ]
    assert all(secs == pytest.approx(last_ns * 1e-9 / 2.0) for secs, last_ns in parts)
    assert all(b - a <= STEP_NS + 10**8 for (_, a), (_, b) in pairwise(parts))


def test_a_trial_at_its_own_pace_is_the_one_at_full_speed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = SimulatedClock()
    by_clock = partial(paced, clock=clock.now, sleep=clock.sleep)
    monkeypatch.setattr("recorders.trial.open_source.paced", by_clock)
    sentences = SHIP.read_bytes()
    slow = _outputs(tmp_path / "slow", sentences, "--pace", "1", replay=True)
    fast = _outputs(tmp_path / "fast", sentences, replay=True)
    assert clock.secs == pytest.approx(LAST_SECS, abs=0.3)
    assert set(fast) == {"ship.csv", "ship.json"}
    assert slow == fast


def test_a_stretch_is_let_through_by_the_clock_of_the_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert paced.__kwdefaults__ == {"clock": time.monotonic, "sleep": time.sleep}
    waits: list[float] = []

    def sleep(secs: float) -> None:
        waits.append(secs)
        time.sleep(secs)

    monkeypatch.setattr("recorders.trial.open_source.paced", partial(paced, sleep=sleep))
    sentences = b"".join(SHIP.read_bytes().splitlines(keepends=True)[:40])
    slow = _outputs(tmp_path / "slow", sentences, "--pace", "4", replay=False)
    fast = _outputs(tmp_path / "fast", sentences, replay=False)
    assert waits
    assert slow == fast

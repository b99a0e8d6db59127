import threading
import time
from pathlib import Path

import pytest

from recorders import disk_sync
from recorders.disk_sync import DiskSync


def _wait_until(condition: object, secs: float = 10.0) -> None:
    assert callable(condition)
    end = time.monotonic() + secs
    while not condition() and time.monotonic() < end:
        time.sleep(0.005)
    assert condition()


def test_a_file_is_synchronised_again_and_again_within_the_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(disk_sync, "sync_file", synced.append)
    with DiskSync(tmp_path / "a.mcap", 0.01) as disk:
        _wait_until(lambda: len(synced) >= 3)
        disk.check()
    count = len(synced)
    time.sleep(0.05)
    assert len(synced) == count
    assert set(synced) == {tmp_path / "a.mcap"}


def test_a_disk_that_is_gone_is_reported_at_the_next_check(tmp_path: Path) -> None:
    with DiskSync(tmp_path / "gone.mcap", 0.01) as disk:
        _wait_until(lambda: disk._error is not None)
        with pytest.raises(FileNotFoundError):
            disk.check()


def test_a_slow_disk_delays_nothing_that_is_written_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Path] = []
    ended: list[Path] = []
    disk_is_done = threading.Event()

    def slow(path: Path) -> None:
        begun.append(path)
        disk_is_done.wait(10.0)
        ended.append(path)

    monkeypatch.setattr(disk_sync, "sync_file", slow)
    with DiskSync(tmp_path / "a.mcap", 0.01) as disk:
        _wait_until(lambda: bool(begun))
        for _ in range(100):
            disk.check()
        assert not ended
        disk_is_done.set()
    assert ended


def test_a_device_is_not_synchronised() -> None:
    with DiskSync(Path("/dev/null"), 0.001) as disk:
        time.sleep(0.02)
        disk.check()

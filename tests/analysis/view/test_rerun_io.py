"""Files of reviews: complete, or refused in one line."""

import errno
import os
from pathlib import Path

import pytest
import rerun as rr
from rerun.chunk import RrdReader

from analysis.view import file_pipe
from analysis.view.rerun_io import save_recording
from shiplog import ShiplogError


def save_text(path: Path, text: str = "all") -> None:
    recording = rr.RecordingStream("test")
    with save_recording(recording, path):
        rr.log("page", rr.TextDocument(text), recording=recording)


def has_page(path: Path) -> bool:
    return any(chunk.entity_path == "/page" for chunk in RrdReader(path).stream())


def test_a_review_is_in_its_file_when_the_block_ends(tmp_path: Path) -> None:
    save_text(tmp_path / "x.rrd", "page" * 100_000)
    assert has_page(tmp_path / "x.rrd")


def test_a_review_is_written_where_the_system_has_no_paths_of_pipes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_pipe, "DESCRIPTORS", tmp_path / "absent")
    save_text(tmp_path / "x.rrd")
    assert has_page(tmp_path / "x.rrd")


@pytest.mark.parametrize("room", [0, 100, 5000, 70_000])
def test_a_review_on_a_full_disk_is_refused_with_the_cause_and_nothing_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    """Rerun's own writer waits for ever in some of these cases."""
    write, written = os.write, 0

    def write_until_full(file: int, data: memoryview) -> int:
        nonlocal written
        if written + len(data) > room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written += len(data)
        return write(file, data)

    monkeypatch.setattr(file_pipe.os, "write", write_until_full)
    with pytest.raises(ShiplogError, match=r"(?i)no space left on device.*x.rrd"):
        save_text(tmp_path / "x.rrd", "".join(map(str, range(30_000))))
    assert list(tmp_path.iterdir()) == []


def test_an_error_within_the_block_is_raised_and_nothing_is_kept(tmp_path: Path) -> None:
    recording = rr.RecordingStream("test")
    with pytest.raises(ZeroDivisionError), save_recording(recording, tmp_path / "x.rrd"):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
def test_a_review_to_a_full_device_is_refused() -> None:
    with pytest.raises(ShiplogError, match=r"(?i)no space left on device"):
        save_text(Path("/dev/full"))

"""Tests of recorders.trial.marks: marks reach the recording they name, and no other."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from recorders.streams.reception_clock import ReceptionClock
from recorders.trial.marks import MarkListener, clean_text, send_mark
from shiplog.errors import ShiplogError, UsageError
from shiplog.types import Event, EventLevel


@pytest.fixture
def listener(tmp_path: Path) -> Iterator[MarkListener]:
    found = MarkListener(tmp_path / "trial.mcap", ReceptionClock())
    yield found
    found.close()


def _sent(listener: MarkListener, log: str, text: str) -> list[Event]:
    """Send a mark from another thread, as another terminal does."""
    thread = threading.Thread(target=send_mark, args=(log, text))
    thread.start()
    marks: list[Event] = []
    for _ in range(200):
        marks += listener.take()
        if not thread.is_alive():
            break
        time.sleep(0.01)
    thread.join()
    return marks


@pytest.mark.parametrize("name", ["trial.mcap", "trial"])
def test_a_mark_becomes_an_event_at_the_time_it_was_sent(
    listener: MarkListener, tmp_path: Path, name: str
) -> None:
    before = time.time_ns()
    (event,) = _sent(listener, str(tmp_path / name), "execute, 20 starboard")
    assert (event.text, event.source, event.level) == (
        "execute, 20 starboard",
        "operator",
        EventLevel.INFO,
    )
    assert before - 10**8 < event.time_ns < time.time_ns() + 10**8
    assert listener.take() == []


def test_a_log_that_is_not_recorded_is_an_error(listener: MarkListener, tmp_path: Path) -> None:
    with pytest.raises(ShiplogError, match="no recording of it runs here"):
        send_mark(str(tmp_path / "other.mcap"), "execute")
    assert listener.take() == []


def test_after_the_recording_a_mark_is_an_error(tmp_path: Path) -> None:
    MarkListener(tmp_path / "trial.mcap", ReceptionClock()).close()
    with pytest.raises(ShiplogError, match="no recording of it runs here"):
        send_mark(str(tmp_path / "trial.mcap"), "execute")


@pytest.mark.parametrize("text", ["", "  ", "x" * 201, "escape \x1b[2J"])
def test_a_mark_without_a_printable_line_is_a_usage_error(text: str) -> None:
    with pytest.raises(UsageError, match="mark"):
        clean_text(text)

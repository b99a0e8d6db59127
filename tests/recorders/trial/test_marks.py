"""Tests of recorders.trial.marks: marks reach the recording they name, and no other."""

import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from recorders.streams.reception_clock import ReceptionClock
from recorders.trial import marks
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


def test_who_connects_and_sends_nothing_holds_up_nothing(
    listener: MarkListener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    idle = []
    for _ in range(marks._MAX_AT_ONCE - 1):
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.connect(str(listener._path))
        idle.append(connection)
    assert listener.take() == []
    assert len(listener._connections) == len(idle)
    assert {connection.gettimeout() for connection, _ in listener._connections} == {0.0}
    (event,) = _sent(listener, str(tmp_path / "trial.mcap"), "execute")
    assert event.text == "execute"
    monkeypatch.setattr(marks, "_ANSWER_SECS", 0.0)
    assert listener.take() == []
    assert not listener._connections
    for connection in idle:
        assert connection.recv(1) == b""
        connection.close()


@pytest.mark.parametrize("sent", [b"", b"x", b"1 ", b"\xff 1", b"9" * 800, b"-1 \x1b[2J"])
def test_what_is_no_mark_is_no_event_and_not_confirmed(listener: MarkListener, sent: bytes) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.connect(str(listener._path))
        connection.sendall(sent)
        connection.shutdown(socket.SHUT_WR)
        assert listener.take() == []
        assert connection.recv(16) == b""


def test_a_second_recorder_of_one_log_is_refused_and_the_first_one_still_takes_marks(
    listener: MarkListener, tmp_path: Path
) -> None:
    with pytest.raises(ShiplogError, match="another recorder is writing it"):
        MarkListener(tmp_path / "trial.mcap", ReceptionClock())
    (event,) = _sent(listener, str(tmp_path / "trial.mcap"), "execute")
    assert event.text == "execute"


def test_the_socket_of_a_recorder_that_was_killed_is_replaced(tmp_path: Path) -> None:
    killed = MarkListener(tmp_path / "trial.mcap", ReceptionClock())
    killed._socket.close()  # its file stays
    MarkListener(tmp_path / "trial.mcap", ReceptionClock()).close()


def test_a_log_with_a_very_long_path_is_marked(tmp_path: Path) -> None:
    log = tmp_path / ("a" * 200) / ("b" * 200) / "trial.mcap"
    listener = MarkListener(log, ReceptionClock())
    (event,) = _sent(listener, str(log), "execute")
    listener.close()
    assert event.text == "execute"


def test_a_folder_that_others_can_enter_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(marks.tempfile, "gettempdir", lambda: str(tmp_path))
    folder = tmp_path / f"shiplog-{marks.os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(OSError, match="not a private folder"):
        MarkListener(tmp_path / "trial.mcap", ReceptionClock())
    with pytest.raises(ShiplogError, match="no recording of it runs here"):
        send_mark(str(tmp_path / "trial.mcap"), "execute")

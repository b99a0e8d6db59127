"""Marks: events that a person adds to a running recording from another terminal.

The recorder listens at a Unix socket in a folder that only its user can enter; the socket's name is
derived from the path of the log. Each connection carries one mark and is answered, so that the one
who marks knows that the event will be in the log.
"""

import hashlib
import os
import socket
import tempfile
from collections import deque
from contextlib import suppress
from pathlib import Path

from recorders.streams.reception_clock import ReceptionClock, steady_ns
from shiplog.errors import ShiplogError, UsageError
from shiplog.types import Event

MAX_TEXT = 200  # characters of a mark
_MAX_BYTES = 4 * MAX_TEXT + 32
_ANSWER_SECS = 3.0
_MAX_AT_ONCE = 32


def clean_text(text: str) -> str:
    """Return the text of a mark in one line.

    Raises
    ------
    UsageError
        It is empty, too long, or has characters that cannot be printed.

    Examples
    --------
    >>> clean_text(" execute,  20 starboard ")
    'execute, 20 starboard'
    """
    line = " ".join(text.split())
    if not line:
        raise UsageError("the text of the mark is empty; write what happened")
    if len(line) > MAX_TEXT or not line.isprintable():
        raise UsageError(f"a mark is one line of at most {MAX_TEXT} printable characters")
    return line


class MarkListener:
    """Receives the marks of one recording, without a thread: `take` accepts what waits.

    Nobody who connects can hold up the recording: what was not sent yet is read at a later call.

    Parameters
    ----------
    log
        The log that is recorded.
    clock
        The clock of reception.

    Raises
    ------
    ShiplogError
        Another recorder listens for that log.
    OSError
        There is no place for the socket.
    """

    def __init__(self, log: Path, clock: ReceptionClock) -> None:
        self._clock = clock
        self._path = _socket_path(log)
        if _is_answered(self._path):
            raise ShiplogError(f"another recorder is writing it; name another log with -o: {log}")
        self._path.unlink(missing_ok=True)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.bind(os.fspath(self._path))
        self._socket.listen(_MAX_AT_ONCE)
        self._socket.setblocking(False)
        self._connections: deque[tuple[socket.socket, int]] = (
            deque()
        )  # and when each was accepted, ns

    def take(self) -> list[Event]:
        """Return the marks that were sent since the last call, at the times they were sent."""
        self._accept()
        events = []
        for _ in range(len(self._connections)):
            connection, since_ns = self._connections.popleft()
            try:
                if event := self._event(connection):
                    events.append(event)
                    connection.sendall(b"ok")
                connection.close()
            except BlockingIOError:  # nothing was sent yet
                if steady_ns() - since_ns < _ANSWER_SECS * 1e9:
                    self._connections.append((connection, since_ns))
                else:
                    connection.close()
            except OSError:
                connection.close()
        return events

    def close(self) -> None:
        """Stop to listen."""
        for connection, _ in self._connections:
            connection.close()
        self._socket.close()
        self._path.unlink(missing_ok=True)

    def _accept(self) -> None:
        while len(self._connections) < _MAX_AT_ONCE:
            try:
                connection, _ = self._socket.accept()
            except OSError:  # none waits
                return
            connection.setblocking(False)
            self._connections.append((connection, steady_ns()))

    def _event(self, connection: socket.socket) -> Event | None:
        """Read a mark; None where it is none. Raises BlockingIOError where nothing was sent."""
        data = connection.recv(_MAX_BYTES)
        with suppress(ValueError, UsageError):
            sent, _, text = data.decode().partition(" ")
            age_ns = min(max(steady_ns() - int(sent), 0), 10**10)
            return Event(self._clock.now_ns() - age_ns, clean_text(text))
        return None


def _is_answered(path: Path) -> bool:
    """Whether a recorder listens at a socket."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(_ANSWER_SECS)
        try:
            connection.connect(os.fspath(path))
        except OSError:
            return False
        return True


def send_mark(log: str, text: str) -> None:
    """Add an event to a running recording.

    Parameters
    ----------
    log
        The log that is recorded, with or without ``.mcap``.
    text
        What happened, in one line.

    Raises
    ------
    UsageError
        The text is no possible mark.
    ShiplogError
        No recording of that log runs on this computer, or it does not answer.
    """
    line = clean_text(text)
    path = Path(log if log.lower().endswith(".mcap") else f"{log}.mcap")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(_ANSWER_SECS)
        try:
            connection.connect(os.fspath(_socket_path(path)))
        except OSError as error:
            raise ShiplogError(
                f"no recording of it runs here; name the log that `shiplog record` writes: {path}"
            ) from error
        try:
            connection.sendall(f"{steady_ns()} {line}".encode())
            answered = connection.recv(16) == b"ok"
        except OSError:
            answered = False
    if not answered:
        raise ShiplogError(f"the recorder did not take the mark; mark it again: {path}")


def _socket_path(log: Path) -> Path:
    """Return the socket of a log, in a folder of the user's own, which is made where needed.

    Raises PermissionError where another user has a folder of its name, or can enter it.
    """
    folder = Path(tempfile.gettempdir()) / f"shiplog-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.lstat()
    if status.st_uid != os.getuid() or status.st_mode & 0o077 or folder.is_symlink():
        raise PermissionError(f"not a private folder of this user: {folder}")
    name = hashlib.sha256(os.fsencode(log.resolve())).hexdigest()[:24]
    return folder / f"{name}.mark"

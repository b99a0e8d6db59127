"""Lines from the standard input as they come, stamped at reception."""

import os
import select
import sys

from recorders.streams.line_splitter import LineSplitter
from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock

_READ_BYTES = 1 << 16


class PipeTransport:
    """The standard input, or another open file descriptor, of another program's lines.

    Parameters
    ----------
    clock
        The clock of reception.
    descriptor
        The file descriptor; by default the standard input.
    """

    address = "-"
    lost = 0  # a pipe waits

    def __init__(self, clock: ReceptionClock, descriptor: int | None = None) -> None:
        self._clock = clock
        self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self._splitter = LineSplitter()

    def open(self) -> None:
        """Do nothing: the input is open."""

    def receive(self, timeout_secs: float) -> list[Packet]:
        """Return the lines that have arrived; the last one may have no end."""
        if not select.select([self._descriptor], [], [], timeout_secs)[0]:
            return []
        data = os.read(self._descriptor, _READ_BYTES)
        now_ns = self._clock.now_ns()
        if data:
            return [Packet(line, now_ns) for line in self._splitter.lines(data)]
        if rest := self._splitter.rest():
            return [Packet(rest, now_ns)]
        raise EOFError

    def close(self) -> None:
        """Do nothing: the input belongs to the process."""

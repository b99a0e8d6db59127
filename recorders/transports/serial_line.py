"""Lines over a serial port, by pyserial."""

import re
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Protocol

from recorders.streams.line_splitter import LineSplitter
from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock

if TYPE_CHECKING:
    import serial

DEFAULT_BAUD = 4800  # of NMEA 0183; 38400 at high speed

is_bit_rate = re.compile(r"[1-9][0-9]{0,8}").fullmatch
"""Whether a text is a rate in bit/s."""


class Splitter(Protocol):
    """What splits bytes as they come into lines or messages."""

    def lines(self, data: bytes) -> list[bytes]:
        """Return the lines that the next bytes complete."""


_split_lines = partial(LineSplitter, begins_inside=True)


class SerialTransport:
    """A serial port with 8 data bits, no parity, and 1 stop bit.

    Parameters
    ----------
    address
        The address as the user wrote it.
    device
        The port, such as ``/dev/ttyUSB0``.
    baud
        The rate, bit/s.
    clock
        The clock of reception.
    make_splitter
        Makes what splits the bytes, anew for each connection; by default into lines.
    greeting
        Sent to the device when the port is opened.
    """

    lost = 0  # the system reports none

    def __init__(
        self,
        address: str,
        device: str,
        baud: int,
        clock: ReceptionClock,
        *,
        make_splitter: Callable[[], Splitter] = _split_lines,
        greeting: bytes = b"",
    ) -> None:
        self.address = address
        self._device, self._baud = device, baud
        self._clock = clock
        self._port: serial.Serial | None = None
        self._make_splitter, self._greeting = make_splitter, greeting
        self._splitter = make_splitter()

    def open(self) -> None:
        """Open the port, for this process alone; the first line, which may be cut, is discarded."""
        import serial  # noqa: PLC0415 - only where a serial port is used

        self._splitter = self._make_splitter()
        self._port = serial.Serial(self._device, self._baud, exclusive=True)
        self._port.write(self._greeting)

    def receive(self, timeout_secs: float) -> list[Packet]:
        """Return the lines that have arrived, stamped when their ends arrived."""
        if self._port is None:
            raise OSError("not open")
        if self._port.timeout != timeout_secs:  # setting it configures the port anew
            self._port.timeout = timeout_secs
        data = self._port.read(1)
        if not data:
            return []
        data += self._port.read(self._port.in_waiting)
        now_ns = self._clock.now_ns()
        return [Packet(line, now_ns) for line in self._splitter.lines(data)]

    def close(self) -> None:
        """Close the port."""
        if self._port is not None:
            self._port.close()
            self._port = None

"""Lines over TCP: shiplog connects to a server, such as a multiplexer or a gateway."""

import socket

from recorders.streams.line_splitter import LineSplitter
from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock

CONNECT_SECS = 5.0
# a pulled cable is no event for a socket that only listens: the system asks the other end after
# this long a silence, s, so often, s, and so many times
_PROBES = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3}
_READ_BYTES = 1 << 16


class TcpTransport:
    """A connection to a server that sends lines.

    Parameters
    ----------
    address
        The address as the user wrote it.
    host, port
        The server.
    clock
        The clock of reception.
    """

    lost = 0  # the system reports none

    def __init__(self, address: str, host: str, port: int, clock: ReceptionClock) -> None:
        self.address = address
        self._server = host, port
        self._clock = clock
        self._socket: socket.socket | None = None
        self._splitter = LineSplitter()

    def open(self) -> None:
        """Connect; a line that was cut by the loss of an older connection is forgotten."""
        self._splitter = LineSplitter()
        self._socket = socket.create_connection(self._server, CONNECT_SECS)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in _PROBES.items():
            if (option := getattr(socket, name, None)) is not None:  # not on all systems
                self._socket.setsockopt(socket.IPPROTO_TCP, option, value)

    def receive(self, timeout_secs: float) -> list[Packet]:
        """Return the lines that have arrived, stamped when their ends arrived."""
        if self._socket is None:
            raise OSError("not open")
        self._socket.settimeout(timeout_secs)
        try:
            data = self._socket.recv(_READ_BYTES)
        except TimeoutError:
            return []
        if not data:
            raise ConnectionResetError("the server closed the connection")
        now_ns = self._clock.now_ns()
        return [Packet(line, now_ns) for line in self._splitter.lines(data)]

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

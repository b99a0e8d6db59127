"""Datagrams over UDP: from one sender, a broadcast, or a multicast group (IEC 61162-450)."""

import errno
import select
import socket
import sys
import time
from ipaddress import IPv4Address

from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock

RECEIVE_BUFFER_BYTES = 8 << 20  # asked of the system, which may grant less
SO_RXQ_OVFL = getattr(socket, "SO_RXQ_OVFL", 40)  # Linux; 40 where Python lacks the name
MAX_AT_ONCE = 2048  # datagrams of one call, so that a flood cannot hold the loop
MAX_DATAGRAM_BYTES = 65_535
REJOIN_SECS = 10.0  # of silence, after which the membership of a group is verified


class UdpTransport:
    """A socket that listens at one address, and at no other.

    Parameters
    ----------
    address
        The address as the user wrote it.
    host, port
        The local address to listen at, or a multicast group to join.
    interface
        The local address of the network interface on which a group is joined; by default the
        system chooses it.
    clock
        The clock of reception.

    Attributes
    ----------
    lost
        The number of datagrams that found the receive buffer full; known on Linux only.
    """

    def __init__(
        self, address: str, host: str, port: int, interface: str, clock: ReceptionClock
    ) -> None:
        self.address = address
        self._host, self._port, self._interface = host, port, interface
        self._clock = clock
        self._socket: socket.socket | None = None
        self._group: bytes | None = None  # of the open socket, and its interface
        self._verify_secs = 0.0  # by the monotonic clock
        self._reported_losses = 0  # of the open socket, as the system counts them
        self.lost = 0

    def open(self) -> None:
        """Listen; a group is joined on its interface only, and only its datagrams are received.

        Raises
        ------
        OSError
            The address or the interface is none of this computer now.
        """
        self._group = None
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
            if sys.platform == "linux":
                listener.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
            if IPv4Address(socket.gethostbyname(self._host)).is_multicast:
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                listener.bind((self._host, self._port))
                self._join(listener)
            else:
                listener.bind((self._host, self._port))
            listener.setblocking(False)
        except BaseException:
            listener.close()
            raise
        self._socket, self._reported_losses = listener, 0

    def receive(self, timeout_secs: float) -> list[Packet]:
        """Return the datagrams that have arrived.

        Raises
        ------
        OSError
            The interface of a group is gone, such as a network adapter that was unplugged.
        """
        if self._socket is None:
            raise OSError("not open")
        if not select.select([self._socket], [], [], timeout_secs)[0]:
            self._verify_membership(self._socket)
            return []
        self._verify_secs = time.monotonic() + REJOIN_SECS
        packets = [self._first(self._socket)]
        try:
            while len(packets) < MAX_AT_ONCE:
                data, sender = self._socket.recvfrom(MAX_DATAGRAM_BYTES)
                packets.append(Packet(data, self._clock.now_ns(), sender[0]))
        except BlockingIOError:
            pass
        return packets

    def _first(self, listener: socket.socket) -> Packet:
        """Receive a datagram with the number of those that the system has dropped before it."""
        data, extra, _, sender = listener.recvmsg(MAX_DATAGRAM_BYTES, socket.CMSG_SPACE(4))
        now_ns = self._clock.now_ns()
        for level, kind, content in extra:
            if (level, kind) == (socket.SOL_SOCKET, SO_RXQ_OVFL):
                losses = int.from_bytes(content[:4], sys.byteorder)
                self.lost += (losses - self._reported_losses) % 2**32  # the count wraps around
                self._reported_losses = losses
        return Packet(data, now_ns, sender[0])

    def close(self) -> None:
        """Close the socket, which also leaves the group."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _join(self, listener: socket.socket) -> None:
        if sys.platform == "linux":  # elsewhere a socket receives the groups that it has joined
            any_group = getattr(socket, "IP_MULTICAST_ALL", 49)  # where Python lacks the name
            listener.setsockopt(socket.IPPROTO_IP, any_group, 0)
        interface = socket.inet_aton(self._interface) if self._interface else bytes(4)  # any one
        self._group = socket.inet_aton(self._host) + interface
        listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, self._group)
        self._verify_secs = time.monotonic() + REJOIN_SECS

    def _verify_membership(self, listener: socket.socket) -> None:
        """Join the group again where the silent interface is another one than before, or raise.

        The system forgets the groups of a network adapter that is unplugged, without an error.
        """
        if self._group is None or time.monotonic() < self._verify_secs:
            return
        self._verify_secs = time.monotonic() + REJOIN_SECS
        try:
            listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, self._group)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:  # the group is joined
                raise

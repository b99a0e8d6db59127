"""The interface of a transport."""

from typing import Protocol

from recorders.streams.packets import Packet


class Transport(Protocol):
    """A connection from which packets come: a socket, a serial line, a CAN bus."""

    @property
    def address(self) -> str:
        """The address as the user wrote it, for messages."""

    @property
    def lost(self) -> int:
        """The number of packets that the system dropped so far, where it counts them."""

    def open(self) -> None:
        """Connect, or listen.

        Raises
        ------
        OSError
            Not possible now; it may be later.
        """

    def receive(self, timeout_secs: float) -> list[Packet]:
        """Return what was received, with the time of reception of each packet.

        Parameters
        ----------
        timeout_secs
            How long to wait for the first packet; the list is empty if none comes.

        Raises
        ------
        OSError
            The connection is lost.
        EOFError
            The source has ended for good, such as a pipe that was closed.
        """

    def close(self) -> None:
        """Close the connection; a second call has no effect."""

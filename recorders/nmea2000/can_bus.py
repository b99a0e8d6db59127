"""Frames of a live CAN bus, by python-can; nothing is ever sent to it."""

from typing import TYPE_CHECKING, Any

from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from shiplog.errors import UsageError

from .can_address import CanAddress

if TYPE_CHECKING:
    from can import BusABC, Message

MAX_AT_ONCE = 2048  # frames of one call: a second of a full bus
_ERROR_FLAG = 0x20000000  # of Linux, in the identifiers of error frames


class CanBusTransport:
    """A CAN bus; each frame is a packet, a line as ``candump -L`` writes it but for the time.

    Parameters
    ----------
    address
        The address as the user wrote it.
    bus
        The bus.
    clock
        The clock of reception.

    Raises
    ------
    UsageError
        python-can is not installed.
    """

    lost = 0  # the system reports none

    def __init__(self, address: str, bus: CanAddress, clock: ReceptionClock) -> None:
        self.address = address
        self._can_address, self._clock = bus, clock
        self._bus: BusABC | None = None
        _require_library()

    def open(self) -> None:
        """Connect to the bus.

        Raises
        ------
        OSError
            There is no such bus now, or it is down.
        """
        import can  # noqa: PLC0415 - only where a bus is used

        interface, channel, bitrate = self._can_address
        settings: dict[str, Any] = {} if bitrate is None else {"bitrate": bitrate}
        try:
            self._bus = can.Bus(
                channel=channel, interface=interface, ignore_config=True, **settings
            )
        except (can.CanError, ValueError, ImportError) as error:
            raise OSError(f"{error or type(error).__name__}") from error

    def receive(self, timeout_secs: float) -> list[Packet]:
        """Return the frames that have arrived, stamped when they were read."""
        import can  # noqa: PLC0415 - only where a bus is used

        if self._bus is None:
            raise OSError("not open")
        packets: list[Packet] = []
        try:
            message = self._bus.recv(timeout_secs)
            while message is not None:
                packets.append(Packet(_line(message), self._clock.now_ns()))
                message = self._bus.recv(0) if len(packets) < MAX_AT_ONCE else None
        except can.CanError as error:
            raise OSError(str(error)) from error
        return packets

    def close(self) -> None:
        """Leave the bus."""
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None


def _line(message: "Message") -> bytes:
    """Return a frame as a line of candump."""
    identifier = message.arbitration_id | (_ERROR_FLAG if message.is_error_frame else 0)
    digits = 8 if message.is_extended_id or message.is_error_frame else 3
    data = "" if message.is_remote_frame else bytes(message.data).hex().upper()
    return f"can {identifier:0{digits}X}#{data}".encode()


def _require_library() -> None:
    try:
        import can  # noqa: F401, PLC0415 - whether it is there
    except ImportError as error:
        raise UsageError(
            "a CAN bus needs python-can; install it with `pip install 'shiplog[nmea2000]'`"
        ) from error

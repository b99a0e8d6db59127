"""The Actisense NGT-1, a gateway that sends binary messages over a serial line."""

from typing import Any

from recorders.streams.reception_clock import ReceptionClock
from recorders.transports.serial_line import SerialTransport
from shiplog.errors import UsageError

from .device_address import parse_device_address

SCHEME = "ngt1"
DEFAULT_BAUD = 115_200
_FORM = "ngt1:///dev/ttyUSB0, or ngt1:///dev/ttyUSB0?baud=230400"


class NgtSplitter:
    """Splits the bytes of an NGT-1 into messages, each a line as Actisense's gateways print it.

    A message with a wrong checksum is a line of no format, so that its decoder counts it.

    Parameters
    ----------
    codec
        The codec of canboat's library.
    """

    def __init__(self, codec: Any) -> None:  # noqa: ANN401 - of a compiled module
        self._codec = codec

    def lines(self, data: bytes) -> list[bytes]:
        """Return the messages that the next bytes complete."""
        lines = []
        for kind, content in self._codec.receive(data):
            if kind == "frame":
                priority, pgn, source, destination, payload = content
                head = f"{source:02X}{destination:02X}{priority:X} {pgn:05X} "
                lines.append(head.encode() + payload.hex().upper().encode())
            elif kind == "error":
                lines.append(f"damaged: {content}".encode())
        return lines


def ngt1_transport(address: str, clock: ReceptionClock) -> SerialTransport | None:
    """Make the transport of an NGT-1; None where the address is not that of one.

    The gateway is asked to pass on all messages when the port is opened; the bus is sent nothing.

    Raises
    ------
    UsageError
        The address has errors, or a library is not installed.
    """
    if not address.startswith(f"{SCHEME}:"):
        return None
    try:
        device, baud = parse_device_address(address, "baud")
    except ValueError:
        raise UsageError(f"the address of an NGT-1 is {_FORM}: {address}") from None
    from .canboat_library import ngt1_codec  # noqa: PLC0415 - the library is of an extra

    return SerialTransport(
        address,
        device,
        baud or DEFAULT_BAUD,
        clock,
        make_splitter=lambda: NgtSplitter(ngt1_codec()),
        greeting=bytes(ngt1_codec().open()),
    )

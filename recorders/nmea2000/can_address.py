"""Addresses of CAN buses, such as ``can0`` or ``slcan:///dev/ttyACM0``."""

import re
from typing import NamedTuple

from shiplog.errors import UsageError

from .device_address import parse_device_address

INTERFACES = ("socketcan", "slcan", "pcan", "kvaser", "ixxat", "gs_usb", "vector", "virtual")
DEFAULT_BITRATE = 250_000  # of NMEA 2000
_FORM = "can0, socketcan://can0, slcan:///dev/ttyACM0?bitrate=250000, or virtual://NAME"


class CanAddress(NamedTuple):
    """A CAN bus as python-can names it.

    Attributes
    ----------
    interface
        The kind of the interface, one of `INTERFACES`.
    channel
        The interface or device.
    bitrate
        The rate, bit/s; None where the system sets it.
    """

    interface: str
    channel: str
    bitrate: int | None


def parse_can_address(address: str) -> CanAddress | None:
    """Parse an address; return None where it is not that of a CAN bus.

    Raises
    ------
    UsageError
        It is that of a CAN bus, and has errors.

    Examples
    --------
    >>> parse_can_address("can0")
    CanAddress(interface='socketcan', channel='can0', bitrate=None)
    >>> parse_can_address("slcan:///dev/ttyACM0").channel
    '/dev/ttyACM0'
    """
    if re.fullmatch(r"(v|sl)?can\d{1,3}", address):
        return CanAddress("socketcan", address, None)
    scheme, separator, _ = address.partition("://")
    if not separator or scheme not in INTERFACES:
        return None
    try:
        channel, bitrate = parse_device_address(address, "bitrate")
    except ValueError:
        raise UsageError(f"the address of a CAN bus is {_FORM}: {address}") from None
    if scheme in ("socketcan", "virtual"):
        if bitrate:
            raise UsageError(f"the system sets the bit rate of {channel}; omit it: {address}")
        return CanAddress(scheme, channel, None)
    return CanAddress(scheme, channel, bitrate or DEFAULT_BITRATE)

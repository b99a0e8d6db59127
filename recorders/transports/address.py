"""Addresses of transports, such as ``udp://127.0.0.1:10110`` or ``serial:///dev/ttyUSB0?baud=4800``."""

from collections.abc import Mapping
from ipaddress import AddressValueError, IPv4Address
from urllib.parse import parse_qsl, urlsplit

from recorders.streams.reception_clock import ReceptionClock
from shiplog.errors import UsageError
from shiplog.units import did_you_mean

from .pipe import PipeTransport
from .serial_line import DEFAULT_BAUD, SerialTransport, is_bit_rate
from .tcp import TcpTransport
from .transport import Transport
from .udp import UdpTransport

FORMS = (
    "udp://HOST:PORT, tcp://HOST:PORT, serial:///dev/PORT?baud=4800, or - for the standard input"
)
_OPTIONS = {"udp": ("interface",), "tcp": (), "serial": ("baud",)}


def is_live(address: str) -> bool:
    """Whether an address is that of a live transport rather than the name of a file.

    Examples
    --------
    >>> is_live("udp://127.0.0.1:10110"), is_live("gyro.log")
    (True, False)
    """
    return "://" in address


def open_transport(address: str, clock: ReceptionClock) -> Transport:
    """Make the transport of an address; it is not opened yet.

    Parameters
    ----------
    address
        One of `FORMS`. A UDP address is the local one to listen at, or a multicast group with
        ``?interface=`` for the local address of the network interface.
    clock
        The clock of reception.

    Raises
    ------
    UsageError
        The address is not of these forms.

    Examples
    --------
    >>> open_transport("tcp://127.0.0.1:10110", ReceptionClock()).address
    'tcp://127.0.0.1:10110'
    """
    if address == "-":
        return PipeTransport(clock)
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
        options = dict(parse_qsl(parts.query, strict_parsing=bool(parts.query)))
    except ValueError as error:
        raise UsageError(f"{error}; an address is {FORMS}: {address}") from error
    if parts.scheme not in _OPTIONS:
        hint = did_you_mean(parts.scheme, _OPTIONS)
        raise UsageError(f"no transport {parts.scheme!r}{hint}; an address is {FORMS}: {address}")
    _check_options(address, parts.scheme, options)
    if parts.scheme == "serial":
        return _serial(address, parts.netloc + parts.path, options, clock)
    if not host or not port:
        raise UsageError(f"host or port is missing; an address is {FORMS}: {address}")
    if parts.path.strip("/") or parts.fragment or "@" in parts.netloc:
        raise UsageError(f"more than a host and a port; an address is {FORMS}: {address}")
    if parts.scheme == "udp":
        interface = options.get("interface", "")
        _check_interface(address, host, interface)
        return UdpTransport(address, host, port, interface, clock)
    return TcpTransport(address, host, port, clock)


def _check_interface(address: str, host: str, interface: str) -> None:
    """Refuse what could never be listened at, and an interface that would not be used."""
    if ":" in host:
        raise UsageError(f"UDP is received over IPv4 only; give the local IPv4 address: {address}")
    try:
        is_group = IPv4Address(host).is_multicast
    except AddressValueError:
        is_group = False  # the name of a host
    if not interface:
        return
    if not is_group:
        raise UsageError(
            f"?interface= is for multicast groups; to listen at one interface, give its address as "
            f"the host: {address}"
        )
    try:
        IPv4Address(interface)
    except AddressValueError:
        raise UsageError(
            f"the interface is the local IPv4 address of one, not {interface!r}: {address}"
        ) from None


def _check_options(address: str, scheme: str, options: Mapping[str, str]) -> None:
    known = _OPTIONS[scheme]
    for name in options:
        if name not in known:
            possible = ", ".join(known) or "none"
            hint = did_you_mean(name, known)
            raise UsageError(
                f"{scheme} has no option {name!r}{hint} (possible: {possible}): {address}"
            )


def _serial(
    address: str, device: str, options: Mapping[str, str], clock: ReceptionClock
) -> SerialTransport:
    baud = options.get("baud", str(DEFAULT_BAUD))
    if not device or not is_bit_rate(baud):
        raise UsageError(f"device or baud rate is missing; an address is {FORMS}: {address}")
    return SerialTransport(address, device, int(baud), clock)

"""Why a transport cannot be opened or was lost, in words, with what to do about it."""

import errno
import socket
from collections.abc import Mapping

_LIST_ADDRESSES = "`ip address` lists those of this computer"
_START_BUS = "start it: sudo ip link set can0 up type can bitrate 250000"
_IN_USE = "another program has it open; end that one"
_ADVICE: Mapping[tuple[str, int], str] = {
    ("udp", errno.EADDRNOTAVAIL): f"the host is the local address to listen at; {_LIST_ADDRESSES}",
    ("udp", errno.EADDRINUSE): "another program listens at this port; end it, or use another port",
    ("udp", errno.EACCES): "ports below 1024 are for privileged programs; use a higher one",
    ("udp", errno.ENODEV): "no interface has the address of ?interface=, or its adapter is "
    f"unplugged; {_LIST_ADDRESSES}",
    ("tcp", errno.ECONNREFUSED): "no server listens there; start it, or check the port",
    ("tcp", errno.EHOSTUNREACH): "check the address, and that the network is connected",
    ("tcp", errno.ENETUNREACH): "check the address, and that the network is connected",
    ("serial", errno.EACCES): "join the group of the port: sudo usermod -aG dialout $USER, then "
    "log in again",
    ("serial", errno.ENOENT): "`python -m serial.tools.list_ports` lists the ports; is it plugged "
    "in?",
    ("serial", errno.EBUSY): _IN_USE,
    ("serial", errno.EAGAIN): _IN_USE,  # the lock of the port is held
    ("bus", errno.EAFNOSUPPORT): "this system has no CAN; on Linux: sudo modprobe can_raw",
    ("bus", errno.ENODEV): "`ip link` lists the interfaces; is the adapter plugged in?",
    ("bus", errno.ENETDOWN): f"the interface is down; {_START_BUS}",
    ("bus", errno.ENETUNREACH): f"the interface is down; {_START_BUS}",
}
"""What to do, by the kind of transport and the error of the system."""

_KINDS = {"udp": "udp", "tcp": "tcp", "serial": "serial", "ngt1": "serial", "slcan": "serial"}


def fault_text(error: Exception, address: str) -> str:
    """Return what went wrong, and what to do about it where that is known.

    Parameters
    ----------
    error
        What the transport has raised; of an error that none should raise, the type is stated too.
    address
        The address of the transport; one without a known scheme is that of a CAN bus.

    Examples
    --------
    >>> fault_text(OSError(errno.ECONNREFUSED, "Connection refused"), "tcp://127.0.0.1:10110")
    'Connection refused; no server listens there; start it, or check the port'
    """
    text = " ".join(str(getattr(error, "strerror", None) or error).split())
    if not isinstance(error, OSError):
        return f"{type(error).__name__}: {text}" if text else type(error).__name__
    advice = _advice(error, address)
    return "; ".join(part for part in (text or type(error).__name__, advice) if part)


def _advice(error: OSError, address: str) -> str:
    if isinstance(error, socket.gaierror):
        return "no host has this name; check it, or give the address in numbers"
    kind = _KINDS.get(address.partition("://")[0], "bus")
    return _ADVICE.get((kind, error.errno or 0), "")

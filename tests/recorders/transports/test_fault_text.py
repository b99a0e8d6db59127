"""Faults of transports: what the system states, with what to do about it."""

import errno
import os
import pty
import socket
from collections.abc import Iterator

import pytest

from recorders.streams.reception_clock import ReceptionClock
from recorders.transports.address import open_transport
from recorders.transports.fault_text import fault_text


def _fault(address: str) -> str:
    transport = open_transport(address, ReceptionClock())
    with pytest.raises(OSError) as error:  # noqa: PT011 - the system's text is part of the result
        transport.open()
    transport.close()
    return fault_text(error.value, address)


@pytest.fixture
def used_port() -> Iterator[int]:
    """A UDP port of this computer at which another program listens."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        yield other.getsockname()[1]


@pytest.fixture
def opened_port() -> Iterator[str]:
    """A serial port that another program has opened."""
    _, device = pty.openpty()
    name = os.ttyname(device)
    other = open_transport(f"serial://{name}", ReceptionClock())
    other.open()
    yield name
    other.close()


def test_a_port_in_use_is_named_with_a_remedy(used_port: int) -> None:
    assert "another program listens at this port" in _fault(f"udp://127.0.0.1:{used_port}")


def test_a_serial_port_in_use_is_named_with_a_remedy(opened_port: str) -> None:
    assert _fault(f"serial://{opened_port}").endswith("another program has it open; end that one")


@pytest.mark.parametrize(
    ("address", "advice"),
    [
        ("udp://192.0.2.1:10110", "local address to listen at; `ip address` lists"),
        (
            "udp://239.192.0.1:60001?interface=192.0.2.1",
            "no interface has the address of ?interface=",
        ),
        ("udp://host.invalid:10110", "no host has this name"),
        ("tcp://127.0.0.1:1", "no server listens there"),
        ("serial:///dev/ttyNONE", "`python -m serial.tools.list_ports` lists the ports"),
    ],
)
def test_what_the_system_states_has_a_remedy(address: str, advice: str) -> None:
    text = _fault(address)
    assert advice in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("address", "number", "advice"),
    [
        ("serial:///dev/ttyUSB0", errno.EACCES, "usermod -aG dialout"),
        ("udp://0.0.0.0:80", errno.EACCES, "ports below 1024"),
        ("can0", errno.ENODEV, "`ip link` lists the interfaces"),
        ("can0", errno.ENETDOWN, "sudo ip link set can0 up"),
        ("ngt1:///dev/ttyACM0", errno.ENOENT, "list_ports"),
    ],
)
def test_errors_that_are_not_made_here_have_a_remedy(
    address: str, number: int, advice: str
) -> None:
    text = fault_text(OSError(number, os.strerror(number)), address)
    assert text.startswith(f"{os.strerror(number)}; ")
    assert advice in text


def test_an_error_without_advice_is_what_the_system_states() -> None:
    assert fault_text(OSError("cable pulled"), "tcp://127.0.0.1:1") == "cable pulled"
    assert fault_text(EOFError(), "can0") == "EOFError"
    assert fault_text(ValueError("bad\nframe"), "can0") == "ValueError: bad frame"

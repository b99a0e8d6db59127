"""Gateways of NMEA 2000 that send text over TCP and UDP, on loopback."""

import socket
import time

import pytest
from decoded_streams import decode, options_of

from recorders.nmea2000.cli import NMEA2000
from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.transports.address import open_transport
from recorders.transports.transport import Transport

LINE = b"17:33:21.107 R 09F1121B FF 10 27 FF 7F FF 7F FC\r\n"


def _receive(transport: Transport, packets: int) -> list[Packet]:
    received: list[Packet] = []
    end = time.monotonic() + 10
    while len(received) < packets and time.monotonic() < end:
        received += transport.receive(0.1)
    return received


def test_lines_of_a_gateway_over_tcp_are_stamped_at_reception() -> None:
    clock = ReceptionClock()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        transport = open_transport(f"tcp://127.0.0.1:{port}", clock)
        transport.open()
        connection, _ = server.accept()
        with connection:
            before = clock.now_ns()
            connection.sendall(b"half a line\r\n" + LINE + LINE[:20])
            first = _receive(transport, 2)
            connection.sendall(LINE[20:])
            packets = first + _receive(transport, 1)
        transport.close()
    decoded = decode(iter([packets]), NMEA2000.make_decoder(options_of(NMEA2000)))
    heading = decoded.channels["/heading/27"]
    assert heading.values.tolist() == [pytest.approx(1.0)] * 2
    assert (heading.received_ns >= before).all()
    assert decoded.counts.rejected == {"line of no known format": 1}


def test_datagrams_of_a_gateway_hold_several_lines() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    transport = open_transport(f"udp://127.0.0.1:{port}", ReceptionClock())
    transport.open()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(3):
            sender.sendto(LINE * 4, ("127.0.0.1", port))
    packets = _receive(transport, 3)
    transport.close()
    decoded = decode(iter([packets]), NMEA2000.make_decoder(options_of(NMEA2000)))
    assert decoded.values("/heading/27") == [pytest.approx(1.0)] * 12

"""Tests of the transports on loopback: datagrams, multicast, TCP, a pseudo-terminal, a pipe."""

import os
import pty
import socket
import sys
import tty
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from recorders.streams.packets import MAX_PACKET_BYTES, Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.transports.address import is_live, open_transport
from recorders.transports.pipe import PipeTransport
from recorders.transports.tcp import TcpTransport
from recorders.transports.transport import Transport
from shiplog.errors import UsageError

LINES = [b"$HEHDT,218.53,T*12", b"$TIROT,-0.45,A*27"]


def _free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def _opened(address: str) -> Iterator[Transport]:
    transport = open_transport(address, ReceptionClock())
    transport.open()
    try:
        yield transport
    finally:
        transport.close()


@contextmanager
def _connected() -> Iterator[tuple[Transport, socket.socket]]:
    """A transport that is connected to a server, and the server's end of the connection."""
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        _opened(f"tcp://127.0.0.1:{server.getsockname()[1]}") as transport,
    ):
        peer, _ = server.accept()
        with peer:
            yield transport, peer


def _received(transport: Transport, count: int) -> list[Packet]:
    packets: list[Packet] = []
    for _ in range(50):
        packets += transport.receive(0.1)
        if len(packets) >= count:
            break
    return packets


def test_datagrams_are_received_with_their_sender_and_ascending_times() -> None:
    port = _free_port()
    with (
        _opened(f"udp://127.0.0.1:{port}") as transport,
        socket.socket(type=socket.SOCK_DGRAM) as s,
    ):
        for line in LINES:
            s.sendto(line + b"\r\n", ("127.0.0.1", port))
        packets = _received(transport, 2)
    assert [p.data for p in packets] == [line + b"\r\n" for line in LINES]
    assert {p.origin for p in packets} == {"127.0.0.1"}
    assert packets[0].received_ns <= packets[1].received_ns


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux counts them")
def test_datagrams_that_found_the_receive_buffer_full_are_counted() -> None:
    port, sent = _free_port(), 60_000
    with (
        _opened(f"udp://127.0.0.1:{port}") as transport,
        socket.socket(type=socket.SOCK_DGRAM) as s,
    ):
        for _ in range(sent):
            s.sendto(b"x" * 200, ("127.0.0.1", port))
        received = len(_received(transport, sent))
        s.sendto(b"last", ("127.0.0.1", port))
        received += len(_received(transport, 1))
        assert transport.lost > 0
        assert received + transport.lost == sent + 1


def test_a_listener_on_one_address_does_not_hear_another() -> None:
    port = _free_port()
    with (
        _opened(f"udp://127.0.0.1:{port}") as transport,
        socket.socket(type=socket.SOCK_DGRAM) as s,
    ):
        s.sendto(b"x", ("127.0.0.2", port))
        assert transport.receive(0.2) == []


def test_a_silent_server_is_probed_so_that_a_pulled_cable_is_noticed() -> None:
    with _connected() as (transport, _):
        assert isinstance(transport, TcpTransport)
        own = transport._socket
        assert own is not None
        probes = [
            own.getsockopt(socket.IPPROTO_TCP, option)
            for option in (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        ]
    idle, interval, count = probes
    assert idle + interval * count < 60


def test_a_multicast_group_is_joined_on_loopback_and_only_its_datagrams_are_received() -> None:
    port = _free_port()
    address = f"udp://239.192.0.4:{port}?interface=127.0.0.1"
    with _opened(address) as transport, socket.socket(type=socket.SOCK_DGRAM) as sender:
        loopback = socket.inet_aton("127.0.0.1")
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, loopback)
        sender.sendto(b"unicast", ("127.0.0.1", port))
        sender.sendto(b"UdPbC\0", ("239.192.0.4", port))
        assert [p.data for p in _received(transport, 1)] == [b"UdPbC\0"]
        assert transport.receive(0.2) == []


def test_lines_over_tcp_are_joined_across_segments_and_the_end_is_a_lost_connection() -> None:
    with _connected() as (transport, peer):
        peer.sendall(LINES[0] + b"\r\n" + LINES[1][:5])
        assert [p.data for p in _received(transport, 1)] == [LINES[0]]
        peer.sendall(LINES[1][5:] + b"\n")
        assert [p.data for p in _received(transport, 1)] == [LINES[1]]
        peer.close()
        with pytest.raises(ConnectionResetError, match="server closed"):
            transport.receive(1.0)


def test_no_server_is_an_os_error() -> None:
    transport = open_transport(
        f"tcp://127.0.0.1:{_free_port(socket.SOCK_STREAM)}", ReceptionClock()
    )
    with pytest.raises(OSError, match="refused"):
        transport.open()


def test_lines_over_a_serial_port_begin_after_the_one_that_may_be_cut() -> None:
    controller, port = pty.openpty()
    tty.setraw(port)
    try:
        with _opened(f"serial://{os.ttyname(port)}?baud=38400") as transport:
            os.write(controller, b"8.53,T*12\r\n" + LINES[0] + b"\r\n" + LINES[1] + b"\r\n")
            assert [p.data for p in _received(transport, 2)] == LINES
            assert transport.receive(0.05) == []
    finally:
        os.close(controller)
        os.close(port)


def test_a_serial_port_that_is_pulled_is_an_os_error() -> None:
    controller, port = pty.openpty()
    tty.setraw(port)
    with _opened(f"serial://{os.ttyname(port)}") as transport:
        os.close(port)
        os.close(controller)
        with pytest.raises(OSError, match=r".+"):
            _received(transport, 1)


def test_a_pipe_yields_its_last_line_without_an_end_and_then_ends() -> None:
    reading, writing = os.pipe()
    transport = PipeTransport(ReceptionClock(), reading)
    os.write(writing, b"a\nb")
    os.close(writing)
    assert [p.data for p in transport.receive(1.0)] == [b"a"]
    assert [p.data for p in transport.receive(1.0)] == [b"b"]
    with pytest.raises(EOFError):
        transport.receive(1.0)
    os.close(reading)


def test_a_line_without_end_is_cut_and_needs_no_memory() -> None:
    with _connected() as (transport, peer):
        peer.sendall(b"x" * 100_000 + b"\n" + LINES[0] + b"\n")
        packets = _received(transport, 2)
    assert [len(p.data) for p in packets] == [MAX_PACKET_BYTES, len(LINES[0])]


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("upd://127.0.0.1:1", "did you mean 'udp'"),
        ("udp://127.0.0.1", "host or port is missing"),
        ("udp://:10110", "host or port is missing"),
        ("udp://127.0.0.1:99999", "an address is udp://HOST:PORT"),
        ("udp://127.0.0.1:1?interfac=127.0.0.1", "did you mean 'interface'"),
        ("tcp://127.0.0.1:1?baud=1", "tcp has no option 'baud'"),
        ("serial://", "device or baud rate is missing"),
        ("serial:///dev/ttyS0?baud=fast", "device or baud rate is missing"),
        ("udp://127.0.0.1:0", "host or port is missing"),
        ("udp://127.0.0.1:1/other", "more than a host and a port"),
        ("tcp://user@127.0.0.1:1", "more than a host and a port"),
        ("udp://[::1]:10110", "over IPv4 only"),
        ("udp://239.192.0.4:60004?interface=eth0", "local IPv4 address of one, not 'eth0'"),
        ("udp://192.168.1.5:60004?interface=192.168.1.5", "interface= is for multicast"),
        ("udp://127.0.0.1:1?x", "an address is udp://HOST:PORT"),
    ],
)
def test_a_wrong_address_is_a_usage_error_that_names_the_forms(address: str, message: str) -> None:
    with pytest.raises(UsageError, match=message.replace("?", r"\?")):
        open_transport(address, ReceptionClock())


def test_a_file_name_is_no_live_address() -> None:
    assert not is_live("gyro.log")
    assert is_live("serial:///dev/ttyUSB0")

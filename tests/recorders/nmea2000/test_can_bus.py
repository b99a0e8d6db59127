"""Tests of recorders.nmea2000.can_bus with a virtual bus, and with vcan where there is one."""

import socket
import sys
from pathlib import Path

import can
import pytest
from decoded_streams import decode, options_of

from recorders.nmea2000.can_address import CanAddress, parse_can_address
from recorders.nmea2000.can_bus import CanBusTransport
from recorders.nmea2000.cli import NMEA2000
from recorders.streams.reception_clock import ReceptionClock
from shiplog.errors import UsageError

HEADING = bytes.fromhex("ff1027ff7fff7ffc")


@pytest.mark.parametrize(
    ("address", "parsed"),
    [
        ("can0", CanAddress("socketcan", "can0", None)),
        ("vcan12", CanAddress("socketcan", "vcan12", None)),
        ("socketcan://can1", CanAddress("socketcan", "can1", None)),
        ("virtual://test", CanAddress("virtual", "test", None)),
        ("slcan:///dev/ttyACM0", CanAddress("slcan", "/dev/ttyACM0", 250_000)),
        ("pcan://PCAN_USBBUS1?bitrate=500000", CanAddress("pcan", "PCAN_USBBUS1", 500_000)),
        ("udp://127.0.0.1:10110", None),
        ("gyro.log", None),
        ("can", None),
    ],
)
def test_addresses_of_can_buses_are_recognised(address: str, parsed: CanAddress | None) -> None:
    assert parse_can_address(address) == parsed


@pytest.mark.parametrize(
    "address",
    [
        "slcan://",
        "slcan://[",
        "slcan:///dev/ttyACM0?bitrate=0",
        f"slcan:///dev/ttyACM0?bitrate={'9' * 5000}",
        "virtual://a?b=c",
        "socketcan://can0?bitrate=1",
    ],
)
def test_a_wrong_address_of_a_can_bus_is_refused(address: str) -> None:
    with pytest.raises(UsageError, match="can0"):
        parse_can_address(address)


def _clock() -> ReceptionClock:
    return ReceptionClock(lambda: 1_000_000_000, lambda: 0)


def test_frames_of_a_virtual_bus_are_decoded() -> None:
    transport = NMEA2000.open_transport("virtual://frames", _clock())
    assert transport is not None
    assert transport.receive.__self__ is transport
    transport.open()
    with can.Bus(channel="frames", interface="virtual") as bus:
        bus.send(can.Message(arbitration_id=0x09F1121B, data=HEADING, is_extended_id=True))
        bus.send(can.Message(arbitration_id=0x123, data=b"1", is_extended_id=False))
        bus.send(can.Message(arbitration_id=0x09F1121B, is_extended_id=True, is_remote_frame=True))
        bus.send(can.Message(arbitration_id=4, data=bytes(8), is_error_frame=True))
        packets = transport.receive(1.0)
    transport.close()
    transport.close()
    assert [packet.data for packet in packets] == [
        b"can 09F1121B#FF1027FF7FFF7FFC",
        b"can 123#31",
        b"can 09F1121B#",
        b"can 20000004#0000000000000000",
    ]
    assert {packet.received_ns for packet in packets} == {1_000_000_000}
    decoded = decode(iter([packets]), NMEA2000.make_decoder(options_of(NMEA2000)))
    assert decoded.values("/heading/27") == [pytest.approx(1.0)]
    assert decoded.counts.rejected == {
        "CAN frame with an 11-bit identifier": 1,
        "message without data": 1,
        "error frame of the CAN bus": 1,
    }


def test_a_quiet_bus_yields_nothing_and_a_closed_one_is_an_error() -> None:
    transport = CanBusTransport("virtual://q", CanAddress("virtual", "q", None), _clock())
    transport.open()
    assert transport.receive(0.01) == []
    transport.close()
    with pytest.raises(OSError, match="not open"):
        transport.receive(0.01)


def test_a_bus_that_is_not_there_can_be_tried_again() -> None:
    transport = NMEA2000.open_transport("can987", _clock())
    assert transport is not None
    with pytest.raises(OSError, match=r"\S"):
        transport.open()


def test_frames_of_vcan_are_received() -> None:
    if sys.platform != "linux" or not Path("/sys/class/net/vcan0").exists():
        pytest.skip("there is no vcan0: `ip link add vcan0 type vcan && ip link set vcan0 up`")
    transport = NMEA2000.open_transport("vcan0", _clock())
    assert transport is not None
    transport.open()
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as sender:
        sender.bind(("vcan0",))
        sender.send(bytes.fromhex("1b12f18908000000") + HEADING)
    assert [p.data for p in transport.receive(1.0)] == [b"can 09F1121B#FF1027FF7FFF7FFC"]
    transport.close()


def test_without_the_libraries_one_line_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "can", None)
    with pytest.raises(UsageError, match=r"pip install 'shiplog\[nmea2000\]'"):
        NMEA2000.open_transport("can0", _clock())
    monkeypatch.setitem(sys.modules, "nmea2000", None)
    for name in [name for name in sys.modules if name.startswith("recorders.nmea2000.")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(UsageError, match=r"pip install 'shiplog\[nmea2000\]'"):
        NMEA2000.make_decoder(options_of(NMEA2000))

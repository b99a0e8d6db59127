"""NMEA 2000 as a format of streams: its options, and its own addresses of buses and gateways."""

import argparse
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from recorders.streams.counts import StreamCounts
from recorders.streams.format import OpenedFile, StreamFormat
from recorders.streams.gnss_clock import add_time_option
from recorders.streams.line_files import peek
from recorders.streams.packets import Batches
from shiplog.errors import LogError, UsageError

if TYPE_CHECKING:
    from recorders.streams.reception_clock import ReceptionClock
    from recorders.transports.transport import Transport

    from .pgn_decoder import PgnDecoder

HEAD_LINES = 5000  # of a file, from which the format is detected
_BINARY = b"\x1b\x01", b"\x10\x02"  # Actisense's logs (EBL), and the messages of its gateways
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def _configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of NMEA 2000."""
    add_time_option(parser)
    parser.add_argument(
        "--line-format",
        metavar="NAME",
        help="canboat, candump, candump-elapsed, candump-intervals, yacht-devices, "
        "actisense-ascii or ikonvert (default: that of the first lines)",
    )
    parser.add_argument(
        "--start",
        metavar="TIME",
        help="of a file whose stamps have no date: the date of its first line, or the instant from "
        "which the stamps count, such as 2026-11-29 or 2026-11-29T08:00:00Z (UTC)",
    )


def _make_decoder(options: argparse.Namespace) -> "PgnDecoder":
    """Make the decoder of packets with times; the first line shows their format."""
    from .line_formats import find_format
    from .pgn_decoder import PgnDecoder

    line_format = find_format(options.line_format) if options.line_format else None
    return PgnDecoder(line_format, gnss_time=options.time == "gnss")


def _open_file(batches: Batches, options: argparse.Namespace) -> OpenedFile:
    """Detect the format of a file, and take the times of its lines from their stamps."""
    from .line_formats import FORMATS, detect_format, find_format
    from .line_times import LineTimes
    from .pgn_decoder import PgnDecoder

    head, batches = peek(batches, HEAD_LINES)
    lines = [packet.data for packet in head]
    line_format = find_format(options.line_format) if options.line_format else detect_format(lines)
    if line_format is None and any(line.startswith(_BINARY) for line in lines):
        raise LogError(
            "the file is binary, such as an EBL log: export it as text, with its times, by "
            "Actisense's EBL Reader; an NGT-1 is recorded live from ngt1:///dev/ttyUSB0"
        )
    if line_format is None:
        raise LogError(
            f"none of the first {len(lines)} lines is of a known format of NMEA 2000; known are "
            f"{', '.join(FORMATS)}"
        )
    decoder = PgnDecoder(gnss_time=options.time == "gnss")
    decoder.set_format(line_format, lines)
    start_ns = _instant_ns(options.start) if options.start else None
    for _ in LineTimes(line_format, start_ns, StreamCounts()).apply(iter([head])):
        pass  # stamps that cannot be times are found before anything is recorded
    times = LineTimes(line_format, start_ns, decoder.counts)
    return OpenedFile(times.apply(batches), decoder)


def _instant_ns(text: str) -> int:
    """Return the instant of a date, with or without a time of day, by default in UTC."""
    try:
        instant = datetime.fromisoformat(text)
    except ValueError:
        raise UsageError(
            f"--start takes a date such as 2026-11-29 or 2026-11-29T08:00:00Z, not {text!r}"
        ) from None
    if instant.tzinfo is None:
        instant = instant.replace(tzinfo=UTC)
    return (instant - _EPOCH) // timedelta(microseconds=1) * 1000


def _transport(address: str, clock: "ReceptionClock") -> "Transport | None":
    """Make the transport of a CAN bus or an NGT-1; None where the address is not one of these."""
    from .can_address import parse_can_address
    from .ngt1 import ngt1_transport

    parsed = parse_can_address(address)
    if parsed is None:
        return ngt1_transport(address, clock)
    from .can_bus import CanBusTransport

    return CanBusTransport(address, parsed, clock)


NMEA2000 = StreamFormat(
    "nmea2000",
    "NMEA 2000 from a CAN bus, a gateway, or a log of one",
    _make_decoder,
    _open_file,
    _configure,
    _transport,
)

"""Format of a stream's packets, detected from the first of them by the installed decoders."""

import time
from collections.abc import Sequence
from contextlib import suppress

from recorders.streams.counts import StreamCounts
from recorders.streams.format import GROUP, StreamFormat
from recorders.streams.line_files import peek, read_lines
from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.sample_buffer import SampleBuffer
from recorders.streams.stamps import StampReader, find_stamp_form, read_stamps
from recorders.streams.stream_options import parse_options
from recorders.transports.address import is_live, open_transport
from recorders.transports.fault_text import fault_text
from shiplog.errors import LogError, ShiplogError, UsageError
from shiplog.extensions import extension_names, load_extension

LISTEN_SECS = 10.0
ENOUGH_PACKETS = 20  # of a live stream
HEAD_LINES = 500  # of a file
_MOST = 0.5  # a share of packets


def detect_stream_format(address: str) -> str:
    """Return the name of the format of a live stream or a file.

    Parameters
    ----------
    address
        The address of a live transport, which is listened to for up to `LISTEN_SECS`, or a file.

    Raises
    ------
    ShiplogError
        Nothing can be received, or the file cannot be read.
    UsageError
        No installed format reads most of the packets without options of its own, or several do.
    """
    formats = _loadable_formats()
    clock = ReceptionClock()
    for name, stream_format in formats.items():
        if stream_format.open_transport(address, clock) is not None:
            return name  # an address that only this format has
    packets = _live_packets(address, clock) if is_live(address) else _file_packets(address)
    unstamped = _without_stamps(packets)
    able = [
        name
        for name, each in formats.items()
        if max(_readable(each, packets), _readable(each, unstamped)) > _MOST
    ]
    if len(able) == 1:
        return able[0]
    cause = "no format reads most of its packets" if packets else "nothing was received"
    if able:
        cause = f"{' and '.join(able)} read most of its packets"
    raise UsageError(
        f"the format of {address} was not detected ({cause}); state it: "
        f"shiplog record FORMAT {address} with one of {', '.join(formats)}; csv-lines needs "
        "--layout, and a table is converted by `shiplog convert`"
    )


def _loadable_formats() -> dict[str, StreamFormat]:
    """Return the installed formats without those that cannot be loaded; `record` lists these."""
    formats = {}
    for name in extension_names(GROUP):
        with suppress(ShiplogError):
            formats[name] = load_extension(GROUP, name, StreamFormat, "format")
    return formats


def _readable(stream_format: StreamFormat, packets: Sequence[Packet]) -> float:
    """Return the share of packets that a format can read, whether it uses them or not."""
    try:
        decoder = stream_format.make_decoder(parse_options(stream_format, {}, stream_format.name))
    except ShiplogError:  # it needs an option, or a library that is not installed
        return 0.0
    decoder.decode(packets, SampleBuffer())
    counts = decoder.counts
    read = sum(counts.accepted.values()) + sum(counts.unused.values())
    return read / max(read + sum(counts.rejected.values()), 1)


def _live_packets(address: str, clock: ReceptionClock) -> list[Packet]:
    transport, packets = open_transport(address, clock), list[Packet]()
    end = time.monotonic() + LISTEN_SECS
    try:
        transport.open()
        while len(packets) < ENOUGH_PACKETS and (secs := end - time.monotonic()) > 0:
            packets += transport.receive(secs)
    except (OSError, EOFError) as error:
        raise ShiplogError(f"no connection to {address}: {fault_text(error, address)}") from error
    finally:
        transport.close()
    return packets


def _file_packets(address: str) -> list[Packet]:
    return peek(read_lines(address), HEAD_LINES)[0]


def _without_stamps(packets: Sequence[Packet]) -> list[Packet]:
    """Return packets without the time stamps before them; none where not all have the same."""
    try:
        form = find_stamp_form(packets)
    except LogError:
        return []
    if form is None:
        return []
    return next(read_stamps(iter([[*packets]]), StampReader(form), StreamCounts()))

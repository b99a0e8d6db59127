"""Signal K as a format of streams: its options, and the times of the lines of a file."""

import argparse

from recorders.streams.counts import StreamCounts
from recorders.streams.format import OpenedFile, StreamFormat
from recorders.streams.gnss_clock import add_time_option
from recorders.streams.line_files import peek
from recorders.streams.packets import NO_TIME, Batches, Packet
from recorders.streams.stamps import StampReader, find_stamp_form, read_stamps
from shiplog.errors import LogError

from .delta_decoder import DeltaDecoder, DeltaError, instant_ns, parse_delta

HEAD_LINES = 1000  # of a file, in which time stamps before the deltas are looked for


def _configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of Signal K."""
    add_time_option(parser)
    parser.add_argument(
        "--self",
        metavar="CONTEXT",
        help="the own ship, such as vessels.urn:mrn:imo:mmsi:230029970 (default: vessels.self, and "
        "the one that the server names)",
    )


def _make_decoder(options: argparse.Namespace) -> DeltaDecoder:
    return DeltaDecoder(options.self, gnss_time=options.time == "gnss")


def _open_file(batches: Batches, options: argparse.Namespace) -> OpenedFile:
    """Take the times of the lines from stamps before them, or else from the deltas."""
    head, batches = peek(batches, HEAD_LINES)
    if not any(b"{" in packet.data for packet in head):
        raise LogError(f"none of the first {len(head)} lines is a delta of Signal K, which is JSON")
    form = find_stamp_form(head)
    own_times = form is None
    decoder = DeltaDecoder(options.self, own_times=own_times, gnss_time=options.time == "gnss")
    if form is None:
        timed = _with_delta_times(batches, decoder.counts)
    else:
        timed = read_stamps(batches, StampReader(form), decoder.counts)
    return OpenedFile(timed, decoder)


def _with_delta_times(batches: Batches, counts: StreamCounts) -> Batches:
    """Yield lines with the time of their first update; others have that of the line before."""
    last_ns = NO_TIME
    for batch in batches:
        times = [_time_ns(packet.data) for packet in batch]
        if last_ns == NO_TIME:  # a greeting without a time has that of the first delta
            last_ns = next((time_ns for time_ns in times if time_ns is not None), NO_TIME)
        if last_ns == NO_TIME:
            counts.reject("no time stamp", len(batch))
            continue
        timed: list[Packet] = []
        for packet, time_ns in zip(batch, times, strict=True):
            last_ns = last_ns if time_ns is None else time_ns
            timed.append(Packet(packet.data, last_ns))
        yield timed
    if last_ns == NO_TIME:
        raise LogError("no delta has a time; log the stream with time stamps, or record it live")


def _time_ns(line: bytes) -> int | None:
    """Return the time of the first update of a line that has one."""
    try:
        updates = parse_delta(line).get("updates")
        times = (update["timestamp"] for update in updates or () if "timestamp" in update)
        first = next(times, None)
        return None if first is None else instant_ns(first)
    except (DeltaError, TypeError):
        return None


SIGNALK = StreamFormat(
    "signalk", "Signal K deltas, one in each line", _make_decoder, _open_file, _configure
)

"""The stages of a stream of sentences: times for its packets, and its decoder."""

import argparse
from collections.abc import Sequence
from datetime import date

from recorders.streams.counts import StreamCounts
from recorders.streams.format import OpenedFile, StreamFormat
from recorders.streams.gnss_clock import add_time_option
from recorders.streams.line_files import peek
from recorders.streams.packets import Batches, Packet
from recorders.streams.stamps import (
    StampForm,
    StampReader,
    add_date_option,
    add_stamp_option,
    find_stamp_form,
    read_stamps,
)
from shiplog.errors import LogError, UsageError

from .framing import FramingError, parse_sentence, split_packet
from .sentence_decoder import DecodingOptions, SentenceDecoder
from .sentence_times import (
    SentenceTimes,
    even_times,
    find_reference,
    first_day,
    midnight_ns,
)
from .tag_groups import has_tag_times, tag_times

HEAD_LINES = 5000  # of a file, from which stamps, checksums and times are detected


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of NMEA 0183."""
    add_time_option(parser)
    add_stamp_option(parser)
    add_date_option(parser)
    parser.add_argument(
        "--interval",
        type=_interval,
        metavar="S",
        help="time from a line to the next, in s, for a file without times",
    )
    parser.add_argument(
        "--no-checksum", action="store_true", help="accept sentences without a checksum"
    )


def make_decoder(arguments: argparse.Namespace) -> SentenceDecoder:
    """Make the decoder of a live stream or of raw packets, given the options of `configure`."""
    return SentenceDecoder(
        DecodingOptions(not arguments.no_checksum, gnss_time=arguments.time == "gnss")
    )


def open_file(batches: Batches, arguments: argparse.Namespace) -> OpenedFile:
    """Give the lines of a file their times, and make their decoder.

    Parameters
    ----------
    batches
        Lines without times.
    arguments
        The options of `configure`.

    Raises
    ------
    LogError
        The file has no line, or no time.
    UsageError
        An option contradicts the file.
    """
    head, batches = peek(batches, HEAD_LINES)
    if not head:
        raise LogError("the file has no line")
    counts = StreamCounts()
    form = find_stamp_form(head, arguments.stamp)
    if form is not None:
        head, batches = _read_stamps(head, batches, form, arguments.date, counts)
    require_checksum = not arguments.no_checksum
    if require_checksum and _has_no_checksum(head):
        require_checksum = False
        counts.warn("no sentence has a checksum: errors of transmission are not detected")
    options = DecodingOptions(require_checksum, arguments.time == "gnss", form is not None)
    if form is None:
        batches = _derive_times(head, batches, arguments, counts)
    return OpenedFile(batches, SentenceDecoder(options, counts))


def _read_stamps(
    head: Sequence[Packet],
    batches: Batches,
    form: StampForm,
    day: date | None,
    counts: StreamCounts,
) -> tuple[list[Packet], Batches]:
    """Return the first lines and all lines with the times of their stamps."""
    if form.name == "clock" and day is None:
        unstamped = read_stamps(iter([[*head]]), StampReader(form), StreamCounts())
        day = first_day([packet for batch in unstamped for packet in batch])
        since = f"counted from {day or '1970-01-01'}"
        counts.warn(f"the time stamps have no date: {since}; state it with --date")
    reader = StampReader(form, day)
    head, batches = peek(read_stamps(batches, reader, counts), HEAD_LINES)
    if reader.zone_is_assumed:
        counts.warn("the time stamps have no time zone, read as UTC")
    return head, batches


def _derive_times(
    head: Sequence[Packet],
    batches: Batches,
    arguments: argparse.Namespace,
    counts: StreamCounts,
) -> Batches:
    """Give the lines of a file without stamps their times."""
    day: date | None = arguments.date
    if arguments.interval is not None:
        counts.warn(f"no time stamps: times are counted, {arguments.interval} s from line to line")
        if day is None:
            counts.warn("the lines have no date: counted from 1970-01-01; state it with --date")
        return even_times(batches, midnight_ns(day), arguments.interval)
    if has_tag_times(head):
        return tag_times(batches)
    reference = find_reference(head, day)
    for text in reference.warnings:
        counts.warn(text)
    return SentenceTimes(reference, counts.warn).stamped(batches)


def _has_no_checksum(head: Sequence[Packet]) -> bool:
    """Whether there are sentences, and none has a checksum."""
    if any(b"*" in packet.data for packet in head):
        return False
    lines = [line for packet in head for line in split_packet(packet.data)]
    return any(map(_is_sentence, lines))


def _is_sentence(line: bytes) -> bool:
    try:
        parse_sentence(line, require_checksum=False)
    except FramingError:
        return False
    return True


def _interval(text: str) -> float:
    try:
        secs = float(text)
    except ValueError:
        secs = 0.0
    if not 0 < secs < 86_400:
        raise UsageError(f"--interval takes a time in s, such as 0.1, not {text!r}")
    return secs


NMEA0183 = StreamFormat(
    "nmea0183",
    "NMEA 0183 or IEC 61162-450 sentences",
    make_decoder,
    open_file,
    configure,
)

"""Lines of separated values as a format of streams: its options, and the times of a file."""

import argparse
from pathlib import Path

from recorders.streams.format import OpenedFile, StreamFormat
from recorders.streams.line_files import peek
from recorders.streams.packets import Batches
from recorders.streams.stamps import (
    StampReader,
    add_date_option,
    add_stamp_option,
    find_stamp_form,
    read_stamps,
)
from shiplog.errors import LogError, UsageError

from .csv_decoder import CsvDecoder
from .device import load_device

HEAD_LINES = 1000  # of a file, from which time stamps are detected


def _configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of lines of separated values."""
    parser.add_argument(
        "--layout",
        type=Path,
        metavar="FILE",
        help="description of the lines (docs/stream_formats.md)",
    )
    add_stamp_option(parser)
    add_date_option(parser)


def _make_decoder(options: argparse.Namespace) -> CsvDecoder:
    if options.layout is None:
        raise UsageError("lines of values need --layout FILE, which states what they are")
    return CsvDecoder(load_device(options.layout))


def _open_file(batches: Batches, options: argparse.Namespace) -> OpenedFile:
    """Take the times of the lines from the stamps before them."""
    decoder = _make_decoder(options)
    head, batches = peek(batches, HEAD_LINES)
    form = find_stamp_form(head, options.stamp)
    if form is None:
        raise LogError(
            "no time stamps before the lines; log with stamps such as 2014-08-01T00:00:00.124Z, "
            "record the device live, or convert a table by `shiplog convert --layout`"
        )
    if form.name == "clock" and options.date is None:
        decoder.counts.warn(
            "the stamps have no date: the log begins on 1970-01-01; state it by --date"
        )
    reader = StampReader(form, options.date)
    return OpenedFile(read_stamps(batches, reader, decoder.counts), decoder)


CSV_LINES = StreamFormat(
    "csv-lines",
    "lines of separated values, as a layout describes them",
    _make_decoder,
    _open_file,
    _configure,
)

"""Lines of files and of the standard input, in batches of bounded size, without times."""

import sys
from contextlib import nullcontext
from itertools import chain
from pathlib import Path
from typing import BinaryIO

from shiplog.errors import LogError

from .line_splitter import LineSplitter
from .packets import NO_TIME, Batches, Packet

_READ_BYTES = 1 << 17  # some 2500 sentences


def read_lines(path: str) -> Batches:
    """Yield the lines of a file as packets without times.

    Lines end with LF, CR or both; the last one may have no end. Lines are bounded as by
    `LineSplitter`, so that a file of any content and length is read in constant memory.

    Parameters
    ----------
    path
        The name of the file; ``-`` for the standard input.

    Raises
    ------
    LogError
        The file cannot be read.
    """
    name = "the standard input" if path == "-" else path
    try:
        with nullcontext(sys.stdin.buffer) if path == "-" else Path(path).open("rb") as file:
            yield from _batches(file)
    except OSError as error:
        raise LogError(f"cannot be read ({error.strerror or error}): {name}") from error


def _batches(file: BinaryIO) -> Batches:
    splitter = LineSplitter()
    while data := file.read(_READ_BYTES):
        if lines := splitter.lines(data):
            yield [Packet(line, NO_TIME) for line in lines]
    if rest := splitter.rest():
        yield [Packet(rest, NO_TIME)]


def peek(batches: Batches, packets: int) -> tuple[list[Packet], Batches]:
    """Return the first packets of a stream, and the whole stream, these packets included.

    Parameters
    ----------
    batches
        The stream.
    packets
        How many packets to wait for; there are fewer where the stream ends before.
    """
    first: list[list[Packet]] = []
    count = 0
    while count < packets and (batch := next(batches, None)) is not None:
        first.append(batch)
        count += len(batch)
    head = [packet for batch in first for packet in batch][:packets]
    return head, chain(first, batches)

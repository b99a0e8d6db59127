"""Text formats of NMEA 2000: the frame or message that a line holds.

A line is matched as a whole. What looks like a line of the format and is not one is rejected under
its reason.
"""

import re
from binascii import Error as CodingError
from binascii import a2b_base64, unhexlify
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from typing import NamedTuple

from shiplog.errors import UsageError
from shiplog.units import did_you_mean

from .canboat_library import FrameError, split_identifier

MAX_IDENTIFIER = (1 << 29) - 1
FRAME_BYTES = 8  # of a CAN frame
MAX_MESSAGE_BYTES = 1785  # of ISO 11783-3; a fast packet has at most 223
_TOO_LONG = f"message of more than {MAX_MESSAGE_BYTES} bytes"


class StampKind(Enum):
    """What the stamp of a line measures."""

    INSTANT = "instant"
    DAY_TIME = "time of day"
    ELAPSED = "time since the start"
    ELAPSED_MILLIS = "time since the power-up"  # seconds, a point, and whole milliseconds
    INTERVAL = "time since the line before"


class Frame(NamedTuple):
    """A CAN frame, or a message made of several ones.

    Attributes
    ----------
    pgn
        The parameter group number.
    source
        The address of the sender.
    destination
        The address of the receiver; 255 for all.
    data
        The bytes.
    bus
        The name of the bus where the line has one; else empty.
    """

    pgn: int
    source: int
    destination: int
    data: bytes
    bus: bytes = b""


@dataclass(frozen=True)
class LineFormat:
    """A text format.

    Attributes
    ----------
    name
        Its name for ``--format``.
    stamp
        What the stamps of its lines measure.
    assembled
        Whether a line holds a whole message; None where this depends on the file.
    pattern
        Matches a line; the group `stamp` is its time.
    parse
        Makes the frame of a match.
    """

    name: str
    stamp: StampKind
    assembled: bool | None
    pattern: re.Pattern[bytes]
    parse: Callable[[re.Match[bytes]], Frame]

    def frame(self, line: bytes) -> Frame | None:
        """Return the frame of a line, or None where the line is a comment or a status.

        Raises
        ------
        FrameError
            The line is none of these.
        """
        match = self.pattern.fullmatch(line)
        if match is None:
            if not line.strip() or line.startswith((b"#", b"$PDGY,")):
                return None
            raise FrameError("malformed line")
        frame = self.parse(match)
        if not frame.data:
            raise FrameError("message without data")
        return frame


def find_format(name: str) -> LineFormat:
    """Return the format of a name.

    Raises
    ------
    UsageError
        There is none of this name.
    """
    if name not in FORMATS:
        raise UsageError(
            f"no format {name!r}{did_you_mean(name, FORMATS)}; known are {', '.join(FORMATS)}"
        )
    return FORMATS[name]


def detect_format(lines: Sequence[bytes]) -> LineFormat | None:
    """Return the format of which the first lines of a stream are, or None where they are of none.

    Raises
    ------
    UsageError
        The stamps can be elapsed times or intervals, and the lines do not show which.

    Examples
    --------
    >>> detect_format([b"17:33:21.107 R 19F51323 01 2F 30 70 00 2F 30 70"]).name
    'yacht-devices'
    """
    best = matching_format(lines)
    return _candump_of(lines) if best is CANDUMP else best


def matching_format(lines: Sequence[bytes]) -> LineFormat | None:
    """Return the format of which most lines are, whatever their stamps mean; None for no format.

    A live stream needs no more: its lines have the times of their reception.
    """
    counts = {
        format_.name: sum(bool(format_.pattern.fullmatch(line)) for line in lines)
        for format_ in FORMATS.values()
    }
    best = max(counts, key=lambda name: counts[name])
    return FORMATS[best] if counts[best] else None


def is_assembled(lines: Sequence[bytes]) -> bool:
    """Whether the lines of a canboat file are whole messages, by its header or a long line."""
    return any(
        b"format=FAST" in line
        or ((match := CANBOAT.pattern.fullmatch(line)) and int(match["length"]) > FRAME_BYTES)
        for line in lines
    )


def _candump_of(lines: Sequence[bytes]) -> LineFormat:
    """Return the kind of a candump log: small stamps are elapsed times or intervals."""
    matches = [CANDUMP.pattern.fullmatch(line) for line in lines]
    stamps = [match["stamp"] for match in matches if match and match["stamp"]]
    try:
        secs = [float(stamp) for stamp in stamps]
    except ValueError:  # a date
        return CANDUMP
    if not secs or secs[0] >= FIRST_EPOCH_SECS:
        return CANDUMP
    if any(later < earlier for earlier, later in pairwise(secs)):
        return CANDUMP_INTERVALS
    if len(secs) >= ENOUGH_STAMPS and secs[-1] > secs[0]:
        return CANDUMP_ELAPSED
    raise UsageError(
        "the stamps of the candump log can be elapsed times or intervals; "
        f"state --line-format {CANDUMP_ELAPSED.name} or {CANDUMP_INTERVALS.name}"
    )


# ---- one parser for each format


def _can_frame(identifier: bytes, data: bytes) -> Frame:
    number = int(identifier, 16)
    if number > MAX_IDENTIFIER:
        raise FrameError("error frame of the CAN bus")
    if len(identifier) != 8:
        raise FrameError("CAN frame with an 11-bit identifier")
    return Frame(*split_identifier(number), data)


def _address(text: bytes) -> int:
    if (address := int(text)) > 255:
        raise FrameError("address above 255")
    return address


def _bytes(text: bytes) -> bytes:
    try:
        return unhexlify(text)
    except CodingError:
        raise FrameError("data are not hexadecimal") from None


def _parse_canboat(match: re.Match[bytes]) -> Frame:
    data, length = match["data"], int(match["length"])
    if length > MAX_MESSAGE_BYTES:
        raise FrameError(_TOO_LONG)
    if len(data) != 3 * length or data.count(b",") != length:
        raise FrameError("number of data bytes differs from the one stated")
    return Frame(
        int(match["pgn"]),
        _address(match["source"]),
        _address(match["destination"]),
        _bytes(data.replace(b",", b"")),
    )


def _parse_candump(match: re.Match[bytes]) -> Frame:
    if match["packed"] is not None:
        return _can_frame(match["id"], _bytes(match["packed"]))._replace(bus=match["bus"])
    data = unhexlify(b"".join(match["spaced"].split()))
    if len(data) != int(match["length"]):
        raise FrameError("number of data bytes differs from the one stated")
    return _can_frame(match["id"], data)._replace(bus=match["bus"])


def _parse_yacht_devices(match: re.Match[bytes]) -> Frame:
    return _can_frame(match["id"], unhexlify(b"".join(match["data"].split())))


def _parse_actisense(match: re.Match[bytes]) -> Frame:
    source, destination = int(match["source"], 16), int(match["destination"], 16)
    data = _bytes(match["data"])
    if len(data) > MAX_MESSAGE_BYTES:
        raise FrameError(_TOO_LONG)
    return Frame(int(match["pgn"], 16), source, destination, data)


def _parse_ikonvert(match: re.Match[bytes]) -> Frame:
    try:
        data = a2b_base64(match["data"], strict_mode=True)
    except CodingError:
        raise FrameError("data are not Base64") from None
    if len(data) > MAX_MESSAGE_BYTES:
        raise FrameError(_TOO_LONG)
    return Frame(int(match["pgn"]), _address(match["source"]), _address(match["destination"]), data)


FIRST_EPOCH_SECS = 1e8  # 1973: smaller stamps of candump count from elsewhere
ENOUGH_STAMPS = 20  # that never decrease, to take them for elapsed times

CANBOAT = LineFormat(
    "canboat",
    StampKind.INSTANT,
    None,
    re.compile(
        rb"(?P<stamp>\d{4}-\d\d-\d\d[T\- ]\d\d:\d\d:\d\d(?:[.,]\d{1,9})?Z?)"
        rb",\d{1,2},(?P<pgn>\d{1,8}),(?P<source>\d{1,3}),(?P<destination>\d{1,3})"
        rb",(?P<length>\d{1,4})(?P<data>.*)"
    ),
    _parse_canboat,
)
CANDUMP = LineFormat(
    "candump",
    StampKind.INSTANT,
    False,
    re.compile(
        rb"\s*(?:\((?P<stamp>[\d.: -]{1,40})\)\s+)?(?P<bus>[A-Za-z]\w{0,15})\s+"
        rb"(?:[RT]X\s+\S\s+\S\s+)?"
        rb"(?P<id>[0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})"
        rb"(?:#(?P<packed>[0-9A-Fa-f]{0,16})"
        rb"|\s+\[(?P<length>\d)\](?P<spaced>(?:\s+[0-9A-Fa-f]{2}){0,8}))"
        rb"(?:\s+[RT]|\s+'.{0,8}')?\s*"
    ),
    _parse_candump,
)
CANDUMP_ELAPSED = LineFormat(
    "candump-elapsed", StampKind.ELAPSED, False, CANDUMP.pattern, _parse_candump
)
CANDUMP_INTERVALS = LineFormat(
    "candump-intervals", StampKind.INTERVAL, False, CANDUMP.pattern, _parse_candump
)
YACHT_DEVICES = LineFormat(
    "yacht-devices",
    StampKind.DAY_TIME,
    False,
    re.compile(
        rb"(?P<stamp>\d\d:\d\d:\d\d(?:\.\d{1,9})?)\s+[RT]\s+(?P<id>[0-9A-Fa-f]{8})"
        rb"(?P<data>(?:\s+[0-9A-Fa-f]{2}){0,8})\s*"
    ),
    _parse_yacht_devices,
)
ACTISENSE_ASCII = LineFormat(
    "actisense-ascii",
    StampKind.DAY_TIME,
    True,
    re.compile(
        rb"(?:A(?P<stamp>\d{6}(?:\.\d{1,9})?)\s+)?"
        rb"(?P<source>[0-9A-Fa-f]{2})(?P<destination>[0-9A-Fa-f]{2})[0-9A-Fa-f]\s+"
        rb"(?P<pgn>[0-9A-Fa-f]{5,6})\s+(?P<data>[0-9A-Fa-f]+)\s*"
    ),
    _parse_actisense,
)
IKONVERT = LineFormat(
    "ikonvert",
    StampKind.ELAPSED_MILLIS,
    True,
    re.compile(
        rb"!PDGY,(?P<pgn>\d{1,6}),\d,(?P<source>\d{1,3}),(?P<destination>\d{1,3})"
        rb",(?P<stamp>\d{1,9}\.\d{1,3})?,(?P<data>[A-Za-z0-9+/]*={0,2})"
    ),
    _parse_ikonvert,
)
FORMATS = {
    format_.name: format_
    for format_ in (
        CANBOAT,
        CANDUMP,
        CANDUMP_ELAPSED,
        CANDUMP_INTERVALS,
        YACHT_DEVICES,
        ACTISENSE_ASCII,
        IKONVERT,
    )
}

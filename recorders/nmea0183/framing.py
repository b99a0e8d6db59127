r"""Sentences in lines and datagrams: start, checksum, TAG block and address.

A line is ``$TTSSS,field,...*hh``: talker, sentence, fields, and the XOR of all characters between
``$`` and ``*``. In IEC 61162-450 a datagram begins with ``UdPbC\0`` and each sentence with a TAG
block ``\s:GR0001,n:12*hh\``.
"""

import re
from itertools import product
from string import hexdigits
from typing import NamedTuple

from recorders.streams.packets import END_NS, MAX_PACKET_BYTES

DATAGRAM_HEADER = b"UdPbC\0"
_PIECE = re.compile(rb"(?:\\[^\\]*\\)?[$!][^$!\\]*|[^$!]+")  # a sentence with its TAG block
_TAG_PARAMETER = re.compile(r"([a-z]):([ -~]+)")
_SOURCE = re.compile(r"[A-Za-z0-9_-]{1,15}")
_MAX_TAG_NUMBER = 10**15
_CHECKSUMS = {bytes(two): int(bytes(two), 16) for two in product(hexdigits.encode(), repeat=2)}
_SHORT = 128  # bytes of nearly all sentences
_SHIFTS = (512, 256, 128, 64, 32, 16, 8)
_LONG_SHIFTS = (16384, 8192, 4096, 2048, 1024, *_SHIFTS)  # of up to MAX_PACKET_BYTES


class FramingError(Exception):
    """A line that is no sentence; the text is the reason, the same for all lines of its kind."""


class TagBlock(NamedTuple):
    """Parameters of a TAG block.

    Attributes
    ----------
    source
        The sender (``s:``), such as ``GR0001``; empty without one.
    time_ns
        The time (``c:``), ns since 1970-01-01 UTC; None without one.
    line
        The line count (``n:``); None without one.
    """

    source: str = ""
    time_ns: int | None = None
    line: int | None = None


NO_TAG = TagBlock()


class Sentence(NamedTuple):
    """A sentence with a correct checksum.

    Attributes
    ----------
    talker
        The talker, such as ``HE``; of a proprietary sentence its whole address, such as ``PSXN``.
    formatter
        The kind, such as ``HDT``; of a proprietary sentence its whole address.
    fields
        The fields after the address.
    tag
        The TAG block before it.
    """

    talker: str
    formatter: str
    fields: list[str]
    tag: TagBlock = NO_TAG


def split_packet(data: bytes) -> list[bytes]:
    """Return the lines of a packet: usually one; of a datagram perhaps several.

    A line into which another sentence was cut is returned in parts, of which the last may be whole.
    """
    data = data.removeprefix(DATAGRAM_HEADER).strip(b"\r\n\0 \t")
    lines = data.splitlines() if b"\n" in data or b"\r" in data else [data]
    if len(lines) == 1 and data.count(b"$") + data.count(b"!") == 1:
        return lines
    return [piece for line in lines for piece in _PIECE.findall(line)]


def parse_sentence(line: bytes, *, require_checksum: bool = True) -> Sentence:
    r"""Check a line and split it into its parts.

    Parameters
    ----------
    line
        A line without its end.
    require_checksum
        Whether a sentence without a checksum is an error.

    Raises
    ------
    FramingError
        The line is no sentence, or its checksum is wrong or missing.

    Examples
    --------
    >>> parse_sentence(b"$HEHDT,218.53,T*12")
    Sentence(talker='HE', formatter='HDT', fields=['218.53', 'T'], tag=TagBlock(source='', time_ns=None, line=None))
    """  # noqa: E501
    if len(line) >= MAX_PACKET_BYTES:
        raise FramingError("line too long")
    tag = NO_TAG
    if line[:1] == b"\\":
        content, _, line = line[1:].partition(b"\\")
        tag = _parse_tag(content)
        if not line:
            raise FramingError("TAG block without a sentence")
    if line[:1] not in (b"$", b"!"):
        raise FramingError("no sentence")
    star = line.rfind(b"*")
    if star >= 0:
        _require_checksum(line[1:star], line[star + 1 :])
    elif require_checksum:
        raise FramingError("no checksum")
    text = line[1 : star if star >= 0 else None].decode("latin-1")
    if not (text.isascii() and text.isprintable()):
        raise FramingError("characters that are not printable")
    address, *fields = text.split(",")
    return Sentence(*_parse_address(address, line[:1]), fields, tag)


def tag_of(line: bytes) -> TagBlock:
    """Return the TAG block of a line with a wrong sentence; an empty one where it is wrong too."""
    try:
        return _parse_tag(line[1:].partition(b"\\")[0]) if line[:1] == b"\\" else NO_TAG
    except FramingError:
        return NO_TAG


def _parse_address(address: str, start: bytes) -> tuple[str, str]:
    """Return talker and formatter; both are the whole address if it is proprietary or of AIS."""
    if not address.isalnum():
        raise FramingError("malformed address")
    if start == b"!":
        return f"!{address}", f"!{address}"
    if address[0] == "P":
        return address, address
    if len(address) != 5:
        raise FramingError("malformed address")
    return address[:2], address[2:]


def checksum(body: bytes) -> int:
    """Return the XOR of all bytes.

    Examples
    --------
    >>> f"{checksum(b'HEHDT,218.53,T'):02X}"
    '12'
    """
    folded = int.from_bytes(body)
    for shift in _SHIFTS if len(body) <= _SHORT else _LONG_SHIFTS:
        folded ^= folded >> shift  # halves over each other, down to a byte
    return folded & 0xFF


def _require_checksum(body: bytes, digits: bytes) -> None:
    stated = _CHECKSUMS.get(digits)
    if stated is None:
        raise FramingError("malformed checksum")
    if stated != checksum(body):
        raise FramingError("wrong checksum")


def _parse_tag(content: bytes) -> TagBlock:
    """Return what a TAG block states; parameters that are not used are checked for form only."""
    body, star, digits = content.rpartition(b"*")
    if not star:
        raise FramingError("malformed TAG block")
    try:
        _require_checksum(body, digits)
        found = {}
        for part in body.decode("ascii").split(","):
            match = _TAG_PARAMETER.fullmatch(part)
            if match is None:
                raise FramingError("malformed TAG block")
            found[match[1]] = match[2]
    except (FramingError, UnicodeDecodeError) as error:
        wrong = str(error) == "wrong checksum"
        raise FramingError(
            "wrong checksum of a TAG block" if wrong else "malformed TAG block"
        ) from error
    source = found.get("s", "")
    if source and not _SOURCE.fullmatch(source):
        raise FramingError("malformed TAG block")
    time, line = _tag_number(found.get("c")), _tag_number(found.get("n"))
    return TagBlock(source, None if time is None else _epoch_ns(time), line)


def _tag_number(text: str | None) -> int | None:
    if text is None:
        return None
    if not text.isdecimal() or int(text[:16]) >= _MAX_TAG_NUMBER:
        raise FramingError("malformed TAG block")
    return int(text[:16])


def _epoch_ns(number: int) -> int:
    """Return a UNIX time in s or, where it is too large for that, in ms, as ns."""
    time_ns = number * 10**9 if number < 10**11 else number * 10**6
    if time_ns >= END_NS:
        raise FramingError("malformed TAG block")
    return time_ns

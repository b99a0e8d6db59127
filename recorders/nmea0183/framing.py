r"""Sentences in lines and datagrams: start, checksum, TAG block and address.

A line is ``$TTSSS,field,...*hh``: talker, sentence, fields, and the XOR of all characters between
``$`` and ``*``. In IEC 61162-450 a datagram begins with ``UdPbC\0`` and each sentence with a TAG
block ``\s:GR0001,n:12*hh\``.

The library marlin takes a sentence apart and checks it. What it accepts and we do not is rejected
here: characters that are not printable, text after the checksum, addresses of another length. It
does not check a TAG block, which is read here.
"""

import re
from functools import lru_cache, reduce
from operator import xor
from typing import NamedTuple

from marlin.envelope import EnvelopeError, parse

from recorders.streams.packets import END_NS, MAX_PACKET_BYTES, has_too_many, packet_lines

DATAGRAM_HEADER = b"UdPbC\0"
_PIECE = re.compile(rb"(?:\\[^\\]*\\)?[$!][^$!\\]*|[^$!]+")  # a sentence with its TAG block
_TAG_PARAMETER = re.compile(r"([a-z]):([ -~]+)")
_SOURCE = re.compile(r"[A-Za-z0-9_-]{1,15}")
_GROUP = re.compile(r"([0-9]{1,2})-([0-9]{1,2})-([0-9]{1,9})")
_HEX_BYTE = re.compile(rb"[0-9A-Fa-f]{2}")
_MAX_TAG_DIGITS = 15
_PRINTABLE = bytes(range(0x20, 0x7F))
_REASONS = {
    "missing_checksum_delimiter": "no checksum",
    "invalid_checksum_digits": "malformed checksum",
    "checksum_mismatch": "wrong checksum",
    "invalid_utf8_in_sentence_type": "characters that are not printable",
}
"""The reasons for which marlin rejects a sentence; the others concern the address."""


is_sentence = re.compile(rb"[$!][^$!\\\r\n]*\*[0-9A-Fa-f]{2}").fullmatch
"""Whether a packet is one sentence and nothing else, as most are: it needs no `split_packet`."""


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
    group
        The number of the sentence in its group, the number of sentences of it, and its code
        (``g:``); None without one.
    """

    source: str = ""
    time_ns: int | None = None
    line: int | None = None
    group: tuple[int, int, int] | None = None


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
        The fields after the address, in ASCII.
    tag
        The TAG block before it.
    """

    talker: str
    formatter: str
    fields: tuple[bytes, ...]
    tag: TagBlock = NO_TAG


def split_packet(data: bytes) -> list[bytes]:
    """Return the lines of a packet: usually one; of a datagram perhaps several.

    A line into which another sentence was cut is returned in parts, of which the last may be whole.
    """
    data = data.removeprefix(DATAGRAM_HEADER).strip(b"\r\n\0 \t")
    lines, starts = packet_lines(data), data.count(b"$") + data.count(b"!")
    if (len(lines) == 1 and starts == 1) or has_too_many(starts, data):
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
    Sentence(talker='HE', formatter='HDT', fields=(b'218.53', b'T'), tag=TagBlock(source='', time_ns=None, line=None, group=None))
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
    star = line.find(b"*")
    if star < 0 and not require_checksum:
        line += b"*%02X" % checksum(line[1:])
    elif 0 <= star != len(line) - 3:
        raise FramingError("malformed checksum")
    try:
        parsed = parse(line)
    except EnvelopeError as error:
        raise FramingError(_REASONS.get(error.variant, "malformed address")) from error
    if line.translate(None, _PRINTABLE):  # what remains without them
        raise FramingError("characters that are not printable")
    talker, formatter = _address(line[:1], parsed.talker, parsed.sentence_type)
    return Sentence(talker, formatter, parsed.fields, tag)


def tag_of(line: bytes) -> TagBlock:
    """Return the TAG block of a line with a wrong sentence; an empty one where it is wrong too."""
    try:
        return _parse_tag(line[1:].partition(b"\\")[0]) if line[:1] == b"\\" else NO_TAG
    except FramingError:
        return NO_TAG


@lru_cache(maxsize=256)
def _address(start: bytes, talker: bytes | None, kind: str) -> tuple[str, str]:
    """Return talker and formatter; both are the whole address if it is proprietary or of AIS."""
    prefix = "" if talker is None else talker.decode()
    address = prefix + kind
    if not address.isalnum():
        raise FramingError("malformed address")
    if start == b"!":
        return f"!{address}", f"!{address}"
    if talker is None:
        return address, address
    if len(kind) != 3:
        raise FramingError("malformed address")
    return prefix, kind


def checksum(body: bytes) -> int:
    """Return the XOR of all bytes.

    Examples
    --------
    >>> f"{checksum(b'HEHDT,218.53,T'):02X}"
    '12'
    """
    return reduce(xor, body, 0)


def _parse_tag(content: bytes) -> TagBlock:
    """Return what a TAG block states; parameters that are not used are checked for form only."""
    body, _, digits = content.rpartition(b"*")
    if not _HEX_BYTE.fullmatch(digits):
        raise FramingError("malformed TAG block")
    if int(digits, 16) != checksum(body):
        raise FramingError("wrong checksum of a TAG block")
    found = {}
    for part in body.decode("latin-1").split(","):
        match = _TAG_PARAMETER.fullmatch(part)
        if match is None:
            raise FramingError("malformed TAG block")
        found[match[1]] = match[2]
    source = found.get("s", "")
    if source and not _SOURCE.fullmatch(source):
        raise FramingError("malformed TAG block")
    time, line = _tag_number(found.get("c")), _tag_number(found.get("n"))
    group = _GROUP.fullmatch(found.get("g", ""))
    return TagBlock(
        source,
        None if time is None else _epoch_ns(time),
        line,
        None if group is None else (int(group[1]), int(group[2]), int(group[3])),
    )


def _tag_number(text: str | None) -> int | None:
    if text is None:
        return None
    if not text.isdecimal() or len(text) > _MAX_TAG_DIGITS:
        raise FramingError("malformed TAG block")
    return int(text)


def _epoch_ns(number: int) -> int:
    """Return a UNIX time in s or, where it is too large for that, in ms, as ns."""
    time_ns = number * 10**9 if number < 10**11 else number * 10**6
    if time_ns >= END_NS:
        raise FramingError("malformed TAG block")
    return time_ns

"""Tests of recorders.nmea0183.framing."""

from functools import reduce
from operator import xor

import pynmea2
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sentences import sentence, tagged

from recorders.nmea0183.framing import (
    DATAGRAM_HEADER,
    FramingError,
    TagBlock,
    checksum,
    is_sentence,
    parse_sentence,
    split_packet,
)
from recorders.streams.packets import MAX_PACKET_BYTES

HDT = b"$HEHDT,218.53,T*12"  # R/V Nathaniel B. Palmer


@given(st.binary(max_size=200))
def test_the_checksum_is_the_xor_of_all_bytes(body: bytes) -> None:
    assert checksum(body) == reduce(xor, body, 0)


def test_a_sentence_is_split_as_pynmea2_does() -> None:
    ours, theirs = parse_sentence(HDT), pynmea2.parse(HDT.decode(), check=True)
    assert (ours.talker, ours.formatter) == (theirs.talker, theirs.sentence_type)
    assert [field.decode() for field in ours.fields] == theirs.data


def test_a_checksum_in_small_letters_is_read() -> None:
    assert parse_sentence(b"$HEHDT,218.19,T*1c").fields[0] == b"218.19"


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"$HEHDT,218.53,T*13", "wrong checksum"),
        (b"$HEHDT,218.53,T", "no checksum"),
        (b"$HEHDT,218.53,T*", "malformed checksum"),
        (b"$HEHDT,218.53,T*1", "malformed checksum"),
        (b"$HEHDT,218.53,T*012", "malformed checksum"),
        (b"$HEHDT,218.53,T*-1", "malformed checksum"),
        (b"$HEHDT,218.53,T*G2", "malformed checksum"),
        (HDT + b"*12", "malformed checksum"),
        (HDT + b"\x1b[31m", "malformed checksum"),
        (b"HEHDT,218.53,T*12", "no sentence"),
        (b"\xff\xfe", "no sentence"),
        (sentence("HEHD,218.53,T"), "malformed address"),
        (sentence("HE-DT,218.53,T"), "malformed address"),
        (sentence(""), "malformed address"),
        (sentence("P"), "malformed address"),
        (sentence("HE,1,T"), "malformed address"),
        (sentence("HEHDT,218.53\x1b[31m,T"), "characters that are not printable"),
        (b"$HEHDT,\xe9*%02X" % checksum(b"HEHDT,\xe9"), "characters that are not printable"),
        (b"$HEH\xe9T*%02X" % checksum(b"HEH\xe9T"), "characters that are not printable"),
        (b"$" + b"x" * MAX_PACKET_BYTES, "line too long"),
        (tagged("s:GR0001", "HEHDT,1,T")[:13], "TAG block without a sentence"),
        (b"\\s:GR0001*00\\" + HDT, "wrong checksum of a TAG block"),
        (b"\\s:GR0001\\" + HDT, "malformed TAG block"),
        (tagged("s:a b", "HEHDT,1,T"), "malformed TAG block"),
        (tagged("s:../../etc", "HEHDT,1,T"), "malformed TAG block"),
        (tagged("c:1e9", "HEHDT,1,T"), "malformed TAG block"),
        (tagged("c:99999999999999", "HEHDT,1,T"), "malformed TAG block"),  # of the year 5138
        (tagged("n:" + "9" * 30, "HEHDT,1,T"), "malformed TAG block"),
        (tagged("c:" + "0" * 16 + "1401836000", "HEHDT,1,T"), "malformed TAG block"),
        (tagged("x", "HEHDT,1,T"), "malformed TAG block"),
    ],
)
def test_a_line_that_is_no_sentence_has_its_reason(line: bytes, reason: str) -> None:
    with pytest.raises(FramingError) as error:
        parse_sentence(line)
    assert str(error.value) == reason


def test_a_missing_checksum_is_accepted_on_request_but_never_a_wrong_one() -> None:
    assert parse_sentence(b"$HEHDT,1,T", require_checksum=False).fields == (b"1", b"T")
    with pytest.raises(FramingError, match="wrong checksum"):
        parse_sentence(b"$HEHDT,1,T*00", require_checksum=False)


@pytest.mark.parametrize(
    ("line", "talker", "formatter"),
    [
        (sentence("PSXN,20,1,0,0,0"), "PSXN", "PSXN"),
        (sentence("PLCJE8FC8,69A6"), "PLCJE8FC8", "PLCJE8FC8"),
        (sentence("PASHR,1"), "PASHR", "PASHR"),
        (sentence("AIVDM,1,1,,B,B3If,0", "!"), "!AIVDM", "!AIVDM"),
        (sentence("02MWV,327.6,R,1.89,N"), "02", "MWV"),
    ],
)
def test_talkers_of_proprietary_and_ais_sentences_are_their_address(
    line: bytes, talker: str, formatter: str
) -> None:
    assert parse_sentence(line)[:2] == (talker, formatter)


def test_the_parameters_of_a_tag_block_are_read() -> None:
    # the example of IEC 61162-450 in field notes: group 1-1-34, source GR0001
    assert parse_sentence(tagged("g:1-1-34,s:GR0001,n:12", "HEHDT,1,T")).tag == TagBlock(
        "GR0001", None, 12, (1, 1, 34)
    )


@pytest.mark.parametrize(
    ("text", "time_ns"),
    [("1401836000", 1_401_836_000 * 10**9), ("1401836000123", 1_401_836_000_123 * 10**6)],
)
def test_the_time_of_a_tag_block_is_in_s_or_ms(text: str, time_ns: int) -> None:
    assert parse_sentence(tagged(f"c:{text}", "HEHDT,1,T")).tag.time_ns == time_ns


def test_a_datagram_holds_several_sentences_with_tag_blocks() -> None:
    lines = [tagged("s:GR0001", "HEHDT,1,T"), tagged("s:VD0001", "VDVHW,,,,,1,N,,")]
    assert list(split_packet(DATAGRAM_HEADER + b"\r\n".join(lines) + b"\r\n")) == lines
    assert list(split_packet(DATAGRAM_HEADER + b"".join(lines))) == lines


def test_a_sentence_after_a_cut_one_in_the_same_line_is_saved() -> None:
    assert list(split_packet(b"$AGRSA,1.22," + HDT)) == [b"$AGRSA,1.22,", HDT]
    assert list(split_packet(b"x9$" + HDT)) == [b"x9", b"$", HDT]


@given(st.sampled_from([HDT, b"!AIVDM,1*00", b"$HEHDT", b"\\s:a*00\\"]), st.binary(max_size=20))
def test_a_packet_that_is_one_sentence_needs_no_division(begin: bytes, end: bytes) -> None:
    for data in (begin + end, end + begin, begin[:-3] + end + begin[-3:]):
        if is_sentence(data):
            assert split_packet(data) == [data]


@pytest.mark.parametrize("data", [b"", b"\0\0\0", b"\r\n", DATAGRAM_HEADER, b" \r\n\t"])
def test_padding_holds_no_line(data: bytes) -> None:
    assert list(split_packet(data)) == []

"""Tests of recorders.nmea0183.tag_groups: sentences of a group share its sender and its time."""

import pytest
from decoded_streams import decode_file, decode_live
from sentences import sentence, tagged

from recorders.nmea0183.framing import TagBlock
from recorders.nmea0183.sentence_stream import NMEA0183
from recorders.nmea0183.tag_groups import TagGroups, has_tag_times, tag_times
from recorders.streams.packets import NO_TIME, Packet

SECOND_NS = 10**9
HDT = sentence("HEHDT,1.0,T")


def _times(*lines: bytes) -> list[int]:
    packets = [Packet(line, NO_TIME) for line in lines]
    return [p.received_ns // SECOND_NS for batch in tag_times(iter([packets])) for p in batch]


def test_times_of_tag_blocks_hold_until_the_next() -> None:
    assert _times(HDT, tagged("c:100", "HEHDT,1,T"), HDT, tagged("c:101", "HEHDT,1,T")) == [
        100,
        100,
        101,
    ]


def test_the_sentences_of_a_group_share_its_time_whatever_stands_between_them() -> None:
    lines = [
        tagged("g:1-3-34,s:GR0001,c:100", "HEHDT,1,T"),
        tagged("g:1-2-35,s:VD0001,c:101", "VDVHW,,,,,1,N,,"),
        tagged("g:2-3-34", "HEHDT,2,T"),
        tagged("g:2-2-35", "VDVHW,,,,,2,N,,"),
        tagged("g:3-3-34", "HEHDT,3,T"),
    ]
    assert _times(*lines) == [100, 101, 100, 101, 100]


def test_the_sentences_of_a_group_share_its_sender() -> None:
    lines = [tagged("g:1-2-34,s:GR0001", "HEHDT,1,T"), tagged("g:2-2-34", "TIROT,6.0,A")]
    assert set(decode_live(NMEA0183, lines).channels) == {
        "/heading/GR0001.HE",
        "/yaw_rate/GR0001.TI",
    }


def test_a_file_of_groups_has_the_times_of_their_first_sentences() -> None:
    group = ("g:1-3-{0},s:GR0001,c:{1}", "g:2-3-{0}", "g:3-3-{0}")
    lines = [tagged(tag.format(n, 100 + n), f"HEHDT,{n},T") for n in range(1, 9) for tag in group]
    assert has_tag_times([Packet(line, NO_TIME) for line in lines])
    [heading] = decode_file(NMEA0183, lines).channels.values()
    expected = [(100 + n) * SECOND_NS for n in range(1, 9) for _ in group]
    assert heading.received_ns.tolist() == expected


@pytest.mark.parametrize(
    "second", ["g:3-3-34", "g:2-2-34", "g:2-3-35", "g:2-3", "g:2-3-34-1", "g:0-3-34"]
)
def test_a_sentence_that_does_not_follow_in_its_group_is_not_completed(second: str) -> None:
    lines = [tagged("g:1-3-34,s:GR0001,c:100", "HEHDT,1,T"), tagged(second, "HEHDT,2,T")]
    assert set(decode_live(NMEA0183, lines).channels) == {"/heading/GR0001.HE", "/heading/HE"}


def test_the_code_of_a_group_is_used_again_for_a_later_one() -> None:
    groups = TagGroups()
    groups.complete(TagBlock("A", 1, None, (1, 2, 7)))
    assert groups.complete(TagBlock("", None, None, (2, 2, 7))) == TagBlock("A", 1, None, (2, 2, 7))
    alone = TagBlock("", None, None, (2, 2, 7))  # the first one of its group was lost
    assert groups.complete(alone) == alone


def test_a_sentence_of_two_groups_with_one_code_is_given_to_neither_sender() -> None:
    lines = [
        tagged("g:1-2-34,s:GR0001", "HEHDT,1,T"),
        tagged("g:1-2-34,s:GR0002", "HEHDT,2,T"),
        tagged("g:2-2-34", "TIROT,6.0,A"),
        tagged("g:2-2-34", "TIROT,9.0,A"),
    ]
    assert set(decode_live(NMEA0183, lines).channels) == {
        "/heading/GR0001.HE",
        "/heading/GR0002.HE",
        "/yaw_rate/TI",
    }


def test_groups_that_are_never_complete_need_bounded_memory() -> None:
    groups = TagGroups()
    for code in range(10_000):
        groups.complete(TagBlock("A", code, None, (1, 2, code)))
    assert len(groups._begun) == 256
    second = TagBlock("", None, None, (2, 2, 9_999))
    assert groups.complete(second).time_ns == 9_999

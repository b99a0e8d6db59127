"""Tests of recorders.nmea2000.fast_packets, against the frames that the library makes."""

from random import Random

import pytest

pytest.importorskip("nmea2000")

from nmea2000 import _canboat

from recorders.nmea2000.canboat_library import FrameError
from recorders.nmea2000.fast_packets import FastPackets
from recorders.streams.counts import StreamCounts

INCOMPLETE = "part of an incomplete fast packet"
MESSAGE = bytes(range(1, 44))


def frames(number: int = 1, data: bytes = MESSAGE) -> list[bytes]:
    return list(_canboat.fast_packet_fragment(number, data))


def push(
    packets: list[bytes], counts: StreamCounts | None = None, source: int = 1
) -> list[bytes | None]:
    assembly = FastPackets(counts or StreamCounts())
    found = [assembly.push(129029, source, frame) for frame in packets]
    assembly.finish()
    return found


@pytest.mark.parametrize("length", [1, 6, 7, 13, 14, 43, 222, 223])
def test_the_librarys_frames_are_assembled_to_its_message(length: int) -> None:
    data = Random(length).randbytes(length)  # noqa: S311 - repeatable
    *waiting, message = push(frames(data=data))
    assert waiting == [None] * len(waiting)
    assert message == data


def test_a_message_that_lacks_a_frame_is_rejected_and_the_next_one_is_read() -> None:
    for lost in range(7):
        counts = StreamCounts()
        sent = [*frames()[:lost], *frames()[lost + 1 :], *frames(data=MESSAGE[::-1])]
        found = push(sent, counts)
        assert [message for message in found if message] == [MESSAGE[::-1]]
        assert counts.rejected == {INCOMPLETE: 6}
        assert counts.unused == {"part of 129029": 6}


def test_frames_of_two_messages_are_not_mixed() -> None:
    first, second = frames(), frames(data=MESSAGE[::-1])
    for cut in range(1, 7):
        counts = StreamCounts()
        assert not any(push([*first[1:cut], second[0], *first[cut + 1 :]], counts))
        assert counts.rejected[INCOMPLETE] == 6


def test_a_repeated_or_short_frame_makes_the_message_incomplete() -> None:
    sent = frames()
    for wrong in ([*sent[:2], *sent[1:]], [sent[0], sent[1][:7], *sent[2:]]):
        counts = StreamCounts()
        assert not any(push(wrong, counts))
        assert counts.rejected == {INCOMPLETE: len(wrong)}


def test_the_last_frame_may_be_short() -> None:
    *begun, last = frames()
    assert push([*begun, last[:3]])[-1] == MESSAGE


@pytest.mark.parametrize("frame", [b"", b"\x20", b"\x20\x00\x01", b"\x20\xe0" + bytes(6)])
def test_what_can_be_no_frame_of_a_fast_packet_is_refused(frame: bytes) -> None:
    with pytest.raises(FrameError):
        push([frame])


def test_messages_of_different_numbers_may_alternate() -> None:
    pairs = zip(frames(1), frames(2, MESSAGE[::-1]), strict=True)
    found = push([frame for pair in pairs for frame in pair])
    assert found[-2:] == [MESSAGE, MESSAGE[::-1]]

"""Tests of recorders.transports.live_stream, with a transport that fails as cables do."""

import time
from collections.abc import Callable

import pytest

from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.transports import live_stream
from recorders.transports.live_stream import LiveStream, StreamState
from shiplog.types import Event


class _Scripted:
    """A transport whose calls of `receive` follow a script of packets and exceptions."""

    address = "scripted"
    lost = 0

    def __init__(
        self, *steps: list[Packet] | Exception, opens: list[Exception] | None = None
    ) -> None:
        self._steps, self._opens = list(steps), opens or []
        self.opened = self.closed = 0

    def open(self) -> None:
        if self._opens:
            raise self._opens.pop(0)
        self.opened += 1

    def receive(self, timeout_secs: float) -> list[Packet]:
        assert timeout_secs > 0
        step = self._steps.pop(0) if self._steps else EOFError()
        if isinstance(step, Exception):
            raise step
        return step

    def close(self) -> None:
        self.closed += 1


@pytest.fixture(autouse=True)
def _short_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_stream, "FIRST_RETRY_SECS", 0.01)
    monkeypatch.setattr(live_stream, "BATCH_SECS", 0.01)


def _run(transport: _Scripted) -> tuple[list[Packet], list[Event], LiveStream]:
    stream = LiveStream(transport, ReceptionClock(), "gyro")
    packets = [packet for batch in stream.batches() for packet in batch]
    return packets, stream.take_events(), stream


def test_packets_before_and_after_a_lost_connection_are_kept_and_the_gap_is_an_event() -> None:
    one, two = Packet(b"1", 1), Packet(b"2", 2)
    transport = _Scripted([one], ConnectionResetError("cable pulled"), [two])
    packets, events, stream = _run(transport)
    assert packets == [one, two]
    assert [event.text.split(" of ")[0] for event in events] == [
        "no connection to scripted: cable pulled",
        "connected again after a gap",
    ]
    assert {event.source for event in events} == {"gyro"}
    assert transport.opened == 2
    assert transport.closed == 2
    assert stream.state is StreamState.ENDED


def test_a_source_that_cannot_be_opened_is_tried_again_and_reported_once() -> None:
    transport = _Scripted([Packet(b"1", 1)], opens=[OSError("no device"), OSError("no device")])
    packets, events, _ = _run(transport)
    assert [packet.data for packet in packets] == [b"1"]
    assert [event.text for event in events if "no device" in event.text] == [
        "no connection to scripted: no device"
    ]


def test_more_packets_than_may_wait_are_dropped_and_counted_and_the_reader_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(live_stream, "MAX_WAITING_PACKETS", 5)
    stream = LiveStream(_Scripted([Packet(b"x", n) for n in range(8)]), ReceptionClock(), "gyro")
    stream.start()
    _wait_for(lambda: stream.state is StreamState.ENDED)
    assert len(stream.take()) == 5
    assert stream.dropped == 3
    assert [event.text for event in stream.take_events()] == [
        "3 packets dropped: they came faster than they were recorded"
    ]
    assert stream.take_events() == []


def test_packets_dropped_by_the_system_are_counted_and_an_event() -> None:
    transport = _Scripted([Packet(b"1", 1)])
    stream = LiveStream(transport, ReceptionClock(), "gyro")
    transport.lost = 7
    assert [event.text for event in stream.take_events()] == [
        "7 packets dropped: they came faster than they were recorded"
    ]
    assert stream.dropped == 7


def _wait_for(condition: Callable[[], bool]) -> None:
    for _ in range(500):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("the condition did not come true within 5 s")

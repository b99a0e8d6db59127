"""Tests of recorders.transports.live_stream, with a transport that fails as cables do."""

import threading
import time
from collections.abc import Callable

import pytest

from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.transports import live_stream
from recorders.transports.live_stream import LiveStream, StreamState
from shiplog.types import Event


class _Scripted:
    """A transport whose calls of `receive` and `open` follow scripts of packets and exceptions."""

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
        "the source has ended",
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
        "the source has ended",
        "3 packets dropped: they came faster than they were recorded",
    ]
    assert stream.take_events() == []


def test_long_packets_that_wait_are_bounded_in_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_stream, "MAX_WAITING_BYTES", 100)
    long = [Packet(b"x" * 40, n) for n in range(5)]
    stream = LiveStream(_Scripted(long, [Packet(b"short", 9)]), ReceptionClock(), "gyro")
    stream.start()
    _wait_for(lambda: stream.state is StreamState.ENDED)
    assert [len(packet.data) for packet in stream.take()] == [40, 40, 5]
    assert stream.dropped == 3


@pytest.mark.parametrize("error", [RuntimeError("driver"), TypeError(), ValueError("x")])
def test_whatever_a_transport_raises_ends_no_reader_unnoticed(error: Exception) -> None:
    transport = _Scripted([Packet(b"1", 1)], error, [Packet(b"2", 2)])
    packets, events, stream = _run(transport)
    assert stream.state is StreamState.ENDED
    assert [packet.data for packet in packets] == [b"1", b"2"]
    assert type(error).__name__ in events[0].text
    assert events[1].text.startswith("connected again")


def test_an_error_while_closing_is_a_lost_connection_and_no_end() -> None:
    class BadClose(_Scripted):
        def close(self) -> None:
            super().close()
            if self.closed == 1:
                raise RuntimeError("already gone")

    transport = BadClose([Packet(b"1", 1)], OSError("pulled"), [Packet(b"2", 2)])
    packets, events, _ = _run(transport)
    assert [packet.data for packet in packets] == [b"1", b"2"]
    assert "no connection to scripted" in events[0].text


def test_the_fault_shown_is_that_of_the_last_attempt() -> None:
    faults = iter([OSError("cable pulled"), OSError("no permission")])
    last = OSError("no device")
    transport = _Scripted()
    transport.open = lambda: (_ for _ in ()).throw(next(faults, last))  # type: ignore[method-assign]
    stream = LiveStream(transport, ReceptionClock(), "gyro")
    stream.start()
    _wait_for(lambda: stream.fault == "no device")
    assert stream.state is StreamState.LOST
    assert [event.text for event in stream.take_events()] == [
        "no connection to scripted: cable pulled"
    ]
    stream.stop()


def test_a_connection_that_is_lost_at_once_is_tried_at_growing_intervals(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    waits: list[float] = []
    stream = LiveStream(_Scripted(*[OSError("closed")] * 7), ReceptionClock(), "gyro")
    monkeypatch.setattr(stream._stop, "wait", waits.append)
    stream.start()
    _wait_for(lambda: stream.state is StreamState.ENDED)
    assert waits == [0.01 * 2**n for n in range(7)]


def test_packets_dropped_by_the_system_are_counted_and_an_event() -> None:
    transport = _Scripted([Packet(b"1", 1)])
    stream = LiveStream(transport, ReceptionClock(), "gyro")
    transport.lost = 7
    assert [event.text for event in stream.take_events()] == [
        "7 packets dropped: they came faster than they were recorded"
    ]
    assert stream.dropped == 7


def test_drops_of_a_long_flood_are_few_events_that_count_all_of_them() -> None:
    transport = _Scripted()
    stream = LiveStream(transport, ReceptionClock(), "gyro")
    texts: list[str] = []
    for _ in range(100):
        transport.lost += 5
        texts += [event.text for event in stream.take_events()]
    texts += [event.text for event in stream.take_events(last=True)]
    assert [int(text.split()[0]) for text in texts] == [5, 495]
    assert stream.take_events(last=True) == []


def test_a_reader_that_is_not_connected_is_not_waited_for() -> None:
    answered = threading.Event()
    opened: list[bool] = []

    class Hanging(_Scripted):
        def open(self) -> None:
            opened.append(answered.wait(10.0))

    stream = LiveStream(Hanging(), ReceptionClock(), "gyro")
    stream.start()
    stream.stop()
    assert not opened
    answered.set()


def _wait_for(condition: Callable[[], bool]) -> None:
    for _ in range(500):
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError("the condition did not come true within 5 s")

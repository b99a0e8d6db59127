"""Tests of recorders.trial.live_source, over loopback and with clocks that are set by hand."""

import socket
import threading
import time
from collections.abc import Iterator, Sequence

import pytest
from number_format import NUMBERS

from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_options import parse_options
from recorders.trial import live_source
from recorders.trial.live_source import LiveSource
from recorders.trial.open_source import StreamRequest, open_streams
from recorders.trial.recorded_source import RecordedSource
from shiplog.types import Channel, Event, RawPackets


def _free_port() -> int:
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _request(name: str, address: str) -> StreamRequest:
    return StreamRequest(name, NUMBERS, address, parse_options(NUMBERS, {}, name), None, f"{name}.")


def _opened(
    clock: ReceptionClock, *addresses: str, marks: Sequence[Event] = ()
) -> LiveSource | RecordedSource:
    waiting = list(marks)

    def take() -> list[Event]:
        taken, waiting[:] = waiting[:], []
        return taken

    requests = [_request(f"s{n}", address) for n, address in enumerate(addresses)]
    return open_streams(requests, clock, metadata={"ship": "Neva"}, take_marks=take)


def _run(source: LiveSource | RecordedSource, port: int, lines: Sequence[bytes]) -> list[object]:
    """Record until all lines were sent and received."""
    assert isinstance(source, LiveSource)

    def send() -> None:
        time.sleep(0.2)
        with socket.socket(type=socket.SOCK_DGRAM) as sender:
            for line in lines:
                sender.sendto(line, ("127.0.0.1", port))
        time.sleep(0.2)
        source.stop()

    thread = threading.Thread(target=send)
    thread.start()
    items = [item for chunk in source.chunks() for item in chunk]
    thread.join()
    return items


@pytest.fixture(autouse=True)
def _short_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_source, "BATCH_SECS", 0.02)


def test_samples_raw_packets_and_marks_of_a_live_stream_are_recorded_until_it_is_stopped() -> None:
    port = _free_port()
    source = _opened(ReceptionClock(), f"udp://127.0.0.1:{port}", marks=[Event(5, "execute")])
    items = _run(source, port, [b"heading 1.5", b"x", b"heading 2.5"])
    values = [v for i in items if isinstance(i, Channel) for v in i.values.tolist()]
    assert values == [1.5, 2.5]
    assert {i.topic for i in items if isinstance(i, Channel)} == {"/heading/s0.N"}
    assert [d for i in items if isinstance(i, RawPackets) for d in i.data] == [
        b"heading 1.5",
        b"x",
        b"heading 2.5",
    ]
    assert Event(5, "execute") in items
    assert source.metadata["ship"] == "Neva"
    assert source.metadata["s0.rejected.not a number"] == "1"


def test_a_source_that_cannot_be_reached_does_not_hold_up_another() -> None:
    port = _free_port()
    source = _opened(ReceptionClock(), f"udp://127.0.0.1:{port}", "tcp://127.0.0.1:1")
    items = _run(source, port, [b"rpm 60"])
    assert [i.values.tolist() for i in items if isinstance(i, Channel)] == [[60.0]]
    texts = [i.text for i in items if isinstance(i, Event)]
    refused = "no connection to tcp://127.0.0.1:1: Connection refused; no server listens there"
    assert any(text.startswith(refused) for text in texts)


def test_a_jump_of_the_wall_clock_is_an_event_and_no_jump_of_the_times() -> None:
    wall = iter([10**18, *[10**18 + 3600 * 10**9] * 10_000])
    clock = ReceptionClock(lambda: next(wall), lambda: 0)
    port = _free_port()
    items = _run(_opened(clock, f"udp://127.0.0.1:{port}"), port, [b"rpm 60"])
    texts = [i.text for i in items if isinstance(i, Event)]
    assert (
        texts.count(
            "the system clock was set forward by 3600.000 s; the times of this log run on steadily"
        )
        == 1
    )
    assert [i.received_ns.tolist() for i in items if isinstance(i, Channel)] == [[10**18]]


def test_the_end_does_not_wait_for_sources_that_cannot_be_reached(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = _opened(ReceptionClock(), *["tcp://127.0.0.1:1"] * 8)
    assert isinstance(source, LiveSource)
    answered = threading.Event()
    opened: list[bool] = []
    for each in source.inputs:
        monkeypatch.setattr(each.live._transport, "open", lambda: opened.append(answered.wait(10)))
    threading.Timer(0.2, source.stop).start()
    list(source.chunks())
    assert not opened
    answered.set()


def test_the_end_of_all_sources_ends_the_recording_and_loses_no_packet(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = _opened(ReceptionClock(), "tcp://127.0.0.1:1", "tcp://127.0.0.1:1")
    assert isinstance(source, LiveSource)
    for n, each in enumerate(source.inputs):
        steps = iter([[Packet(b"rpm %d" % k, k)] for k in range(10 * n + 10)])

        def receive(_secs: float, steps: Iterator[list[Packet]] = steps) -> list[Packet]:
            packets = next(steps, None)
            if packets is None:
                raise EOFError
            return packets

        monkeypatch.setattr(each.live._transport, "open", lambda: None)
        monkeypatch.setattr(each.live._transport, "receive", receive)
    items = [item for chunk in source.chunks() for item in chunk]
    counts = {i.source: 0 for i in items if isinstance(i, Channel)}
    for item in items:
        if isinstance(item, Channel):
            counts[item.source] += len(item)
    assert counts == {"s0.N": 10, "s1.N": 20}
    assert [i.text for i in items if isinstance(i, Event)].count("the source has ended") == 2


def test_a_silent_source_yields_empty_chunks_so_that_displays_and_rotations_go_on() -> None:
    source = _opened(ReceptionClock(), f"udp://127.0.0.1:{_free_port()}")
    assert isinstance(source, LiveSource)
    chunks = source.chunks()
    assert [next(chunks) for _ in range(3)] == [(), (), ()]
    chunks.close()  # type: ignore[attr-defined]

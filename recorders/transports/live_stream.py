"""A transport read in a thread of its own, so that nothing that follows delays the reception."""

import threading
import time
from collections import deque
from collections.abc import Callable
from enum import Enum

from recorders.streams.packets import Batches, Packet
from recorders.streams.reception_clock import ReceptionClock
from shiplog.types import Event, EventLevel

from .fault_text import fault_text
from .transport import Transport

MAX_WAITING_PACKETS = 200_000  # some 20 s of the busiest ship
MAX_WAITING_BYTES = 64 << 20  # of their data: datagrams can be long
BATCH_SECS = 0.25  # between the batches of a live stream
RECEIVE_SECS = 0.2  # how long a reader waits, so that it notices the end of the recording
FIRST_RETRY_SECS, LONGEST_RETRY_SECS = 0.5, 10.0
DROP_REPORT_SECS = 10.0  # between the events of drops, so that a flood does not flood the log, too


class StreamState(Enum):
    """State of the connection of a live stream."""

    CONNECTING = "connecting"
    OPEN = "open"
    LOST = "lost"
    ENDED = "ended"


class LiveStream:
    """Packets of one transport from a reader thread; it is opened again, with back-off, when lost.

    Whatever the transport raises is a lost connection, so that the reader never ends unnoticed. The
    back-off begins anew only after a connection has lasted, so that one that is lost as soon as it
    is made fills neither the network nor the log with attempts.

    Packets that wait to be decoded are bounded in number and in bytes: what exceeds these limits is
    dropped and counted, and the transport is read on.

    Parameters
    ----------
    transport
        What to read.
    clock
        The clock of reception.
    name
        The name of the stream, as the source of its events.

    Attributes
    ----------
    state
        Whether the transport is open.
    fault
        Why the transport is not open, or was not before the end; empty where it is.
    """

    def __init__(self, transport: Transport, clock: ReceptionClock, name: str) -> None:
        self._transport, self._clock, self._name = transport, clock, name
        self._lock = threading.Lock()  # of what waits
        self._waiting: list[Packet] = []
        self._waiting_bytes = 0
        self._events: deque[Event] = deque()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reader of {name}", daemon=True)
        self._lost_ns: int | None = None
        self._reported_drops = 0
        self._next_drop_report = 0.0  # by the monotonic clock, s
        self.state = StreamState.CONNECTING
        self.fault = ""
        self._dropped = 0

    @property
    def dropped(self) -> int:
        """The number of packets dropped so far, here or by the system, because too many waited."""
        return self._dropped + self._transport.lost

    def start(self) -> None:
        """Start to read."""
        self._thread.start()

    def request_stop(self) -> None:
        """Let the reader stop by itself, without waiting for it."""
        self._stop.set()

    def stop(self) -> None:
        """Stop to read, and close the transport; what waits can still be taken.

        A reader that is not connected has nothing to add, and is not waited for.
        """
        self.request_stop()
        if self._thread.is_alive() and self.state is StreamState.OPEN:
            self._thread.join(RECEIVE_SECS + 1)

    def take(self) -> list[Packet]:
        """Return the packets received since the last call."""
        with self._lock:
            taken, self._waiting, self._waiting_bytes = self._waiting, [], 0
        return taken

    def take_events(self, *, last: bool = False) -> list[Event]:
        """Return the gaps and drops of the stream since the last call.

        Drops are reported about every `DROP_REPORT_SECS`, and the rest of them at the last call.
        """
        dropped, now_secs = self.dropped, time.monotonic()
        if dropped > self._reported_drops and (last or now_secs >= self._next_drop_report):
            count, self._reported_drops = dropped - self._reported_drops, dropped
            self._next_drop_report = now_secs + DROP_REPORT_SECS
            self._report(f"{count} packets dropped: they came faster than they were recorded")
        return [self._events.popleft() for _ in range(len(self._events))]

    def batches(self, *, until: Callable[[], bool] = lambda: False) -> Batches:
        """Yield what was received about every `BATCH_SECS`, until the source ends or `until`."""
        self.start()
        try:
            while not until():
                ended = self.state is StreamState.ENDED
                yield self.take()
                if ended:
                    return
                time.sleep(BATCH_SECS)
        finally:
            self.stop()

    def _run(self) -> None:
        """Read until the end of the recording or of the source; open again what is lost."""
        retry_secs = FIRST_RETRY_SECS
        while not self._stop.is_set():
            began = time.monotonic()
            try:
                self._connect_and_read()
            except EOFError:
                self._report("the source has ended", EventLevel.INFO)
                self.state = StreamState.ENDED
                return
            except Exception as error:  # noqa: BLE001 - a reader that ends would go unnoticed
                self._set_lost(error)
            if time.monotonic() - began > LONGEST_RETRY_SECS:
                retry_secs = FIRST_RETRY_SECS
            self._stop.wait(retry_secs)
            retry_secs = min(2 * retry_secs, LONGEST_RETRY_SECS)

    def _connect_and_read(self) -> None:
        """Read from the transport until it fails or ends, or the recording ends; then close it."""
        try:
            self._transport.open()
            self._set_open()
            while not self._stop.is_set():
                self._keep(self._transport.receive(RECEIVE_SECS))
        finally:
            self._transport.close()

    def _keep(self, packets: list[Packet]) -> None:
        """Let packets wait, as many as there is room for, and count the others."""
        kept = 0
        with self._lock:
            room = MAX_WAITING_PACKETS - len(self._waiting)
            for packet in packets[:room]:
                if self._waiting_bytes + len(packet.data) > MAX_WAITING_BYTES:
                    break
                self._waiting_bytes += len(packet.data)
                kept += 1
            self._waiting += packets[:kept]
        self._dropped += len(packets) - kept

    def _set_open(self) -> None:
        self.state, self.fault = StreamState.OPEN, ""
        if self._lost_ns is not None:
            secs = (self._clock.now_ns() - self._lost_ns) * 1e-9
            self._lost_ns = None
            self._report(f"connected again after a gap of {secs:.1f} s", EventLevel.INFO)

    def _set_lost(self, error: Exception) -> None:
        """Keep why there is no connection, and report a loss once."""
        self.state = StreamState.LOST
        self.fault = fault_text(error, self._transport.address)
        if self._lost_ns is None:
            self._lost_ns = self._clock.now_ns()
            self._report(f"no connection to {self._transport.address}: {self.fault}")

    def _report(self, text: str, level: EventLevel = EventLevel.WARNING) -> None:
        self._events.append(Event(self._clock.now_ns(), text, self._name, level))

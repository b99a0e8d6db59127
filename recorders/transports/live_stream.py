"""A transport read in a thread of its own, so that nothing that follows delays the reception."""

import threading
import time
from collections import deque
from collections.abc import Callable
from enum import Enum

from recorders.streams.packets import Batches, Packet
from recorders.streams.reception_clock import ReceptionClock
from shiplog.types import Event, EventLevel

from .transport import Transport

MAX_WAITING_PACKETS = 200_000  # some 20 s of the busiest ship, and 50 MB
BATCH_SECS = 0.25  # between the batches of a live stream
RECEIVE_SECS = 0.2  # how long a reader waits, so that it notices the end of the recording
FIRST_RETRY_SECS, LONGEST_RETRY_SECS = 0.5, 10.0


class StreamState(Enum):
    """State of the connection of a live stream."""

    CONNECTING = "connecting"
    OPEN = "open"
    LOST = "lost"
    ENDED = "ended"


class LiveStream:
    """Packets of one transport from a reader thread; it is opened again, with back-off, when lost.

    Packets that wait to be decoded are bounded in number: what exceeds `MAX_WAITING_PACKETS` is
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
        self._waiting: deque[Packet] = deque()
        self._events: deque[Event] = deque()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reader of {name}", daemon=True)
        self._reported_drops = 0
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

    def stop(self) -> None:
        """Stop to read, and close the transport; what waits can still be taken."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(2 * RECEIVE_SECS + 5)

    def take(self) -> list[Packet]:
        """Return the packets received since the last call."""
        # popleft by the number that wait is safe beside the reader, which only appends
        return [self._waiting.popleft() for _ in range(len(self._waiting))]

    def take_events(self) -> list[Event]:
        """Return the gaps and drops of the stream since the last call."""
        dropped = self.dropped
        if dropped > self._reported_drops:
            count, self._reported_drops = dropped - self._reported_drops, dropped
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
        retry_secs, lost_ns = FIRST_RETRY_SECS, None
        while not self._stop.is_set():
            try:
                self._transport.open()
                self._set_open(lost_ns)
                lost_ns, retry_secs = None, FIRST_RETRY_SECS
                self._read()
            except EOFError:
                break
            except OSError as error:
                lost_ns = lost_ns or self._set_lost(error)
            finally:
                self._transport.close()
            self._stop.wait(retry_secs)
            retry_secs = min(2 * retry_secs, LONGEST_RETRY_SECS)
        self.state = StreamState.ENDED

    def _read(self) -> None:
        while not self._stop.is_set():
            packets = self._transport.receive(RECEIVE_SECS)
            room = MAX_WAITING_PACKETS - len(self._waiting)
            self._waiting.extend(packets[:room] if room < len(packets) else packets)
            self._dropped += max(0, len(packets) - room)

    def _set_open(self, lost_ns: int | None) -> None:
        self.state, self.fault = StreamState.OPEN, ""
        if lost_ns is not None:
            secs = (self._clock.now_ns() - lost_ns) * 1e-9
            self._report(f"connected again after a gap of {secs:.1f} s", EventLevel.INFO)

    def _set_lost(self, error: OSError) -> int:
        """Report the loss, and return its time, ns."""
        self.state = StreamState.LOST
        self.fault = error.strerror or str(error) or type(error).__name__
        self._report(f"no connection to {self._transport.address}: {self.fault}")
        return self._clock.now_ns()

    def _report(self, text: str, level: EventLevel = EventLevel.WARNING) -> None:
        self._events.append(Event(self._clock.now_ns(), text, self._name, level))

"""Live streams joined to one source of samples."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from recorders.source import Recordable
from recorders.streams.packets import Batches
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_source import StreamSource
from recorders.transports.live_stream import BATCH_SECS, LiveStream, StreamState
from shiplog.types import Event, EventLevel

from .status import TrialStatus


def waiting_packets(live: LiveStream) -> Batches:
    """Yield what waits in a live stream, each time it is asked for; it never ends by itself."""
    while True:
        yield live.take()


@dataclass
class LiveInput:
    """One live stream of a trial.

    Attributes
    ----------
    live
        The reader of its transport.
    stream
        The stream made of `waiting_packets` of that reader.
    """

    live: LiveStream
    stream: StreamSource


@dataclass
class LiveSource:
    """Live streams as one `recorders.source.Source`.

    Attributes
    ----------
    inputs
        The streams.
    clock
        The clock of reception.
    trial_metadata
        Text about the trial, by key.
    vessel_toml
        The text of the vessel file to keep in the log, or None.
    take_marks
        Returns the events that a person has marked since the last call.
    flush_secs
        How often what was received is yielded, s.
    """

    inputs: Sequence[LiveInput]
    clock: ReceptionClock
    trial_metadata: Mapping[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    take_marks: Callable[[], Sequence[Event]] = tuple
    flush_secs: float = BATCH_SECS
    status: TrialStatus = field(init=False)
    # no threading.Event: a signal handler that sets one can wait for itself for ever
    _stopped: bool = field(default=False, init=False, repr=False)

    def __post_init__(self) -> None:
        self.status = TrialStatus(self.clock.now_ns())

    @property
    def dropped(self) -> int:
        """The number of packets dropped so far, of all streams."""
        return sum(each.live.dropped for each in self.inputs)

    @property
    def metadata(self) -> Mapping[str, str]:
        """The trial's metadata, and the metadata of each stream by its name."""
        streams = {
            f"{each.stream.name}.{key}": text
            for each in self.inputs
            for key, text in each.stream.metadata.items()
        }
        dropped = {
            f"{each.stream.name}.dropped": str(each.live.dropped)
            for each in self.inputs
            if each.live.dropped
        }
        return dict(self.trial_metadata) | streams | dropped

    def stop(self) -> None:
        """End the recording at the next batch; what was received until then is yielded."""
        self._stopped = True

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield what was received about every `flush_secs`, until `stop` or the end of all.

        A chunk is empty where nothing was received, so that a display and a rotation go on.
        """
        steps = [each.stream.steps() for each in self.inputs]
        for each in self.inputs:
            each.live.start()
        try:
            while not self._stopped and not self._all_ended():
                self._wait()
                yield self._step(steps)
        finally:
            for each in self.inputs:  # all at once: a reader may take a while to end
                each.live.request_stop()
            for each in self.inputs:
                each.live.stop()
        if items := self._step(steps, last=True):
            yield items

    def _wait(self) -> None:
        """Wait for the next batch, or until `stop`."""
        end = time.monotonic() + self.flush_secs
        while not self._stopped and (rest := end - time.monotonic()) > 0:
            time.sleep(min(rest, BATCH_SECS))

    def _all_ended(self) -> bool:
        return all(each.live.state is StreamState.ENDED for each in self.inputs)

    def _step(
        self, steps: Sequence[Iterator[tuple[Recordable, ...]]], *, last: bool = False
    ) -> tuple[Recordable, ...]:
        """Return what all streams have received since the last step, and what happened."""
        items: list[Recordable] = []
        for each, stream_steps in zip(self.inputs, steps, strict=True):
            items += next(stream_steps, ())
            items += each.live.take_events(last=last)
            items += each.stream.finish() if last else ()
        items += self.take_marks()
        self.status.add(items)
        now_ns = self.clock.now_ns()
        items += [*self._wall_clock_events(now_ns), *self.status.alarms(now_ns)]
        return tuple(items)

    def _wall_clock_events(self, now_ns: int) -> list[Event]:
        jump_secs = self.clock.wall_clock_jump_ns() * 1e-9
        if not jump_secs:
            return []
        way = "forward" if jump_secs > 0 else "back"
        text = (
            f"the system clock was set {way} by {abs(jump_secs):.3f} s; "
            "the times of this log run on steadily"
        )
        return [Event(now_ns, text, "recorder", EventLevel.WARNING)]

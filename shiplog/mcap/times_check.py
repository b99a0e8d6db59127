"""Check whether the times of a file need no repair, in bounded memory."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from shiplog.types import TimeArray, is_sorted

from .contents import McapContents, SampleBlock
from .forward_steps import MIN_FORWARD_NS
from .still_clocks import stands_still
from .unset_times import are_set

END_SAMPLES = 5  # at each end of a block; a step has at least three samples beside it
MAX_LAG_CHANGE = MIN_FORWARD_NS // 2  # ns; a smaller one is no step of a sensor's clock


@dataclass(frozen=True)
class _LastSamples:
    """The last samples of a topic so far: its times, and the median of its lag at the end, ns.

    With the number of all samples so far, and the first time of measurement.
    """

    received_ns: int
    measured_ns: int
    lag: int
    samples: int
    first_measured_ns: int


@dataclass
class TimesCheck:
    """The times of a file so far, of which `need_repair` states whether they are right as recorded.

    Whatever `build_trial_log` changes in the times of a whole file is detected: times that are not
    set or impossible, times that run back within a topic, and a lasting change of the time from
    measurement to reception. Times that run back need no repair where only their order is another
    one, but this shows only in all of them together.
    """

    first_ns: int = 2**63 - 1
    last_ns: int = -(2**63)
    is_steady: bool = True
    _last: dict[str, _LastSamples] = field(default_factory=dict)

    @property
    def last_received_ns(self) -> int | None:
        """The last time of reception, ns, where the times need no repair; None without samples."""
        return max((last.received_ns for last in self._last.values()), default=None)

    def need_repair(self) -> bool:
        """Whether some of the times so far may have to be changed or dropped."""
        is_empty = self.first_ns > self.last_ns
        return not (self.is_steady and (is_empty or are_set(self.first_ns, self.last_ns)))

    def any_stood_still(self) -> bool:
        """Whether all samples so far of some topic have one time; to be asked at the end."""
        return any(
            stands_still(last.samples, last.first_measured_ns, last.measured_ns)
            for last in self._last.values()
        )

    def add(self, blocks: Mapping[int, Sequence[SampleBlock]], contents: McapContents) -> None:
        """Check the next samples.

        Parameters
        ----------
        blocks
            The samples by channel id, in the order of the file.
        contents
            Has the descriptions of the channels.
        """
        by_topic: dict[str, list[SampleBlock]] = {}
        for channel_id, parts in blocks.items():
            by_topic.setdefault(contents.channels[channel_id].topic, []).extend(parts)
        for topic, parts in by_topic.items():
            if len(parts) > 1:
                self._add(topic, *_in_file_order(parts))
            elif parts:
                self._add(topic, parts[0].received, parts[0].measured)

    def _add(self, topic: str, received: TimeArray, measured: TimeArray) -> None:
        if not len(received):
            return
        for times in (received, measured):
            self.first_ns = min(self.first_ns, int(times.min()))
            self.last_ns = max(self.last_ns, int(times.max()))
        self.is_steady = self.is_steady and is_sorted(received) and is_sorted(measured)
        first = _median(measured[:END_SAMPLES] - received[:END_SAMPLES])
        last = _median(measured[-END_SAMPLES:] - received[-END_SAMPLES:])
        changes = [last - first]
        if (before := self._last.get(topic)) is not None:
            changes.append(first - before.lag)
            self.is_steady &= int(received[0]) >= before.received_ns
            self.is_steady &= int(measured[0]) >= before.measured_ns
        self.is_steady &= max(map(abs, changes)) < MAX_LAG_CHANGE
        first_ns = int(measured[0]) if before is None else before.first_measured_ns
        samples = len(received) + (0 if before is None else before.samples)
        self._last[topic] = _LastSamples(
            int(received[-1]), int(measured[-1]), last, samples, first_ns
        )


def _median(values: TimeArray) -> int:
    """Return the upper median of a few values, faster than `np.median`."""
    return int(np.sort(values)[len(values) // 2])


def _in_file_order(blocks: Sequence[SampleBlock]) -> tuple[TimeArray, TimeArray]:
    """Return the times of reception and measurement of a topic's blocks, joined."""
    positions = np.concatenate([(b.number << 32) + b.offsets for b in blocks])
    order = np.argsort(positions, kind="stable")
    received = np.concatenate([b.received for b in blocks])[order]
    return received, np.concatenate([b.measured for b in blocks])[order]

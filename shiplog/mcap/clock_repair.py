"""Repair of the times of a file's messages: impossible times dropped, steps of a clock removed."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import LogError
from shiplog.types import FloatArray, TimeArray, is_sorted

from .clock_steps import (
    ChannelTimes,
    ClockStep,
    continued_times,
    steps_back,
)
from .forward_steps import returned_steps
from .sensor_clocks import LAG_SAMPLES, without_steps

MAX_DISTANCE_NS = 365 * 86_400 * 10**9  # of a time from the median of the log
MAX_DROPPED_SHARE = 0.05  # of a channel's samples; more are another clock
MAX_DROPPED_SAMPLES = 3  # of a channel, whatever its length
_SECOND_NS = 1e9


@dataclass(frozen=True, eq=False)
class MessageColumns:
    """The messages of one channel in the order of the file.

    Attributes
    ----------
    topic
        The topic, for messages.
    positions
        (n,) places in the file, increasing, common to all channels.
    received_ns, measured_ns
        (n,) times, ns. Those that 64 bits cannot hold are negative.
    values
        (n, k) values in the units of the file.
    """

    topic: str
    positions: NDArray[np.int64]
    received_ns: TimeArray
    measured_ns: TimeArray
    values: FloatArray

    def take(self, rows: NDArray[np.bool_]) -> "MessageColumns":
        """Return the columns with the selected messages only."""
        return MessageColumns(
            self.topic,
            self.positions[rows],
            self.received_ns[rows],
            self.measured_ns[rows],
            self.values[rows],
        )


def drop_impossible_times(
    columns: Mapping[int, MessageColumns],
) -> tuple[dict[int, MessageColumns], list[str]]:
    """Drop single messages whose time cannot be that of their sample.

    Times before 1970 or after 2262 are dropped. Times more than a year from the median of the log
    are dropped where they are few; where they are many, another clock is reported.

    Parameters
    ----------
    columns
        The messages by channel id.

    Returns
    -------
    columns, warnings
        The remaining messages, and what was dropped.
    """
    medians = [int(np.median(c.received_ns)) for c in columns.values() if len(c.received_ns)]
    if not medians:
        return dict(columns), []
    median = int(np.median(medians))
    kept, warnings = {}, []
    for id_, channel in columns.items():
        possible, warning = _possible_rows(channel, median)
        kept[id_] = channel if possible is None else channel.take(possible)
        warnings += warning
    return kept, warnings


@dataclass(frozen=True)
class MixedTimes:
    """A span in which samples from before and after a step of a clock have the same times.

    Attributes
    ----------
    start_ns, end_ns
        The span in times of measurement, both included, ns since 1970-01-01 UTC.
    message
        The cause and the remedy, in one line.
    """

    start_ns: int
    end_ns: int
    message: str


@dataclass(frozen=True)
class ClockRepair:
    """The messages of a file with repaired times.

    Attributes
    ----------
    columns
        The messages by channel id, with times that go on at the sampling rate.
    warnings
        What was repaired.
    mixed
        The steps that were not repaired, since the right times are not known.
    """

    columns: dict[int, MessageColumns]
    warnings: list[str]
    mixed: list[MixedTimes]


def repair_clock_steps(file: str, columns: Mapping[int, MessageColumns]) -> ClockRepair:
    """Remove the steps of the recorder's and the sensors' clocks.

    A step back in some channels only, and one at a restart of the recorder, after a pause of
    unknown length, are not removed; nor is a step forward that no step back returns.

    Parameters
    ----------
    file
        The name of the file, for messages.
    columns
        The messages by channel id.
    """
    channels = dict(columns)
    mixed, warnings = [], []
    if not _in_order_of_reception(channels.values()):
        times = _times_by_topic(channels.values())
        pairs = returned_steps(times)
        returned = {step.position for _, step in pairs}
        back = [step for step in steps_back(times) if step.position not in returned]
        refused = [s for s in back if s.steady_names or _is_restart(s, channels.values())]
        back = [step for step in back if step not in refused]
        warnings += [_step_warning(step, channels.values()) for step in back]
        warnings += [_pair_warning(*pair, channels.values()) for pair in pairs]
        steps = sorted(
            [*back, *(step for pair in pairs for step in pair)], key=lambda step: step.position
        )
        channels = {id_: _continued(channel, steps) for id_, channel in channels.items()}
        mixed = [_mixed_times(file, step, channels.values()) for step in refused]
    for id_, c in channels.items():
        measured, warning = without_steps(c.topic, c.measured_ns, c.received_ns)
        channels[id_] = replace(c, measured_ns=measured) if warning else c
        warnings += warning
    return ClockRepair(channels, warnings, mixed)


def refuse_mixed_times(mixed: Collection[MixedTimes], span_ns: tuple[int, int]) -> None:
    """Refuse a part of a log in which the samples from before and after a step are mixed.

    Parameters
    ----------
    mixed
        The steps of clocks in the log that were not repaired.
    span_ns
        The first and the last time of measurement of the part that is used, ns.

    Raises
    ------
    LogError
        The part includes such a span.
    """
    for span in mixed_times_in(mixed, span_ns):
        raise LogError(span.message)


def mixed_times_in(mixed: Collection[MixedTimes], span_ns: tuple[int, int]) -> list[MixedTimes]:
    """Return the spans of mixed times that a part of a log includes; `span_ns` is its span."""
    return [s for s in mixed if span_ns[0] <= s.end_ns and span_ns[1] >= s.start_ns]


def max_faulty_times(count: int) -> float:
    """Return how many of a channel's times may be faulty one by one; more are another clock."""
    return max(MAX_DROPPED_SHARE * count, MAX_DROPPED_SAMPLES)


def _possible_rows(
    channel: MessageColumns, median: int
) -> tuple[NDArray[np.bool_] | None, list[str]]:
    """Return the rows with possible times, None for all, and the warnings."""
    received, measured = channel.received_ns, channel.measured_ns
    if not len(received) or max(_distance(received, median), _distance(measured, median)) < (
        MAX_DISTANCE_NS
    ):
        return None, []
    limits = median - MAX_DISTANCE_NS, median + MAX_DISTANCE_NS
    outside = (received < 0) | (measured < 0)
    far = ~outside & (_beyond(received, limits) | _beyond(measured, limits))
    warnings = []
    if outside.any():
        warnings.append(
            f"{channel.topic}: {outside.sum()} of {len(outside)} samples have a time before 1970 "
            "or after 2262 and were dropped; the clock had rolled over or was not set: check the "
            "program that wrote the file"
        )
    if 0 < far.sum() <= max_faulty_times(len(received)):
        times = np.where(_beyond(received, limits), received, measured)[far]
        warnings.append(
            f"{channel.topic}: {far.sum()} of {len(far)} samples have a time more than a year from "
            f"the median of the log, such as {_date(int(times[0]))}, and were dropped; the clock "
            "was not set: check the sensor and the recorder"
        )
        return ~(outside | far), warnings
    if far.any():
        times = np.where(_beyond(measured, limits), measured, received)[far]
        warnings.append(
            f"{channel.topic}: {far.sum()} of {len(far)} samples have times from "
            f"{_date(int(times.min()))} to {_date(int(times.max()))}, the median of the log is "
            f"{_date(median)}; its clock was not set, or the week number of GPS rolled over "
            "(1024 weeks): correct the times in a table of the log"
        )
    return ~outside if outside.any() else None, warnings


def _distance(times: TimeArray, median: int) -> int:
    """Return the greatest distance from the median, ns; a time before 1970 is beyond any limit."""
    if times.min() < 0:
        return MAX_DISTANCE_NS
    return max(abs(int(times.min()) - median), abs(int(times.max()) - median))


def _beyond(times: TimeArray, limits: tuple[int, int]) -> NDArray[np.bool_]:
    return (times < max(limits[0], 0)) | (times > min(limits[1], 2**63 - 1))


def _times_by_topic(channels: Collection[MessageColumns]) -> list[ChannelTimes]:
    """Return the times of reception of each topic; a restarted recorder gives it a second id."""
    by_topic: dict[str, list[MessageColumns]] = {}
    for channel in channels:
        if len(channel.positions):
            by_topic.setdefault(channel.topic, []).append(channel)
    times = []
    for topic, parts in by_topic.items():
        positions = np.concatenate([part.positions for part in parts])
        received = np.concatenate([part.received_ns for part in parts])
        order = np.argsort(positions, kind="stable")
        times.append(ChannelTimes(topic, positions[order], received[order]))
    return times


def _in_order_of_reception(channels: Collection[MessageColumns]) -> bool:
    """Whether each topic's times of reception increase in the order of the file."""
    topics = {channel.topic for channel in channels if len(channel.positions)}
    ids = sum(1 for channel in channels if len(channel.positions))
    times: Iterable[TimeArray] = (
        (channel.received_ns for channel in channels)
        if ids == len(topics)
        else (channel.times_ns for channel in _times_by_topic(channels))
    )
    return all(map(is_sorted, times))


def _is_restart(step: ClockStep, channels: Collection[MessageColumns]) -> bool:
    """Whether the channels of a step have other ids after it than before."""
    return not any(
        channel.positions[0] < step.position <= channel.positions[-1]
        for channel in channels
        if channel.topic in step.names and len(channel.positions)
    )


def _mixed_times(file: str, step: ClockStep, channels: Collection[MessageColumns]) -> MixedTimes:
    """Return the span that a step makes unusable, with its cause and the parts that are good."""
    stepped = [c for c in channels if c.topic in step.names and len(c.positions)]
    before = [c.measured_ns[c.positions < step.position] for c in stepped]
    after = [c.measured_ns[c.positions >= step.position] for c in stepped]
    before_ns, after_ns = (
        (min(int(t.min()) for t in times if len(t)), max(int(t.max()) for t in times if len(t)))
        for times in (before, after)
    )
    start, end = max(before_ns[0], after_ns[0]), min(before_ns[1], after_ns[1])
    if end < start:  # no times occur twice: only both parts together are wrong
        start, end = end + 1, start - 1
    at_secs = (step.before_ns - _start_ns(stepped)) / _SECOND_NS
    size = f"{round(-step.size_ns / _SECOND_NS, 3):.12g}"
    cause = (
        f"the times of {', '.join(step.names)} run back by {size} s in the order of the "
        f"file, {at_secs:.6g} s after the start, those of {', '.join(step.steady_names)} do not; "
        "one of several clocks was set"
        if step.steady_names
        else f"the recorder was restarted {at_secs:.6g} s after the start and its times run back "
        f"by {size} s there; its pause is unknown"
    )
    return MixedTimes(
        start,
        end,
        f"{cause}: use one part, --to {_instant(start)} or --from "
        f"{_instant(end + 1_000_000)}: {file}",
    )


def _step_warning(step: ClockStep, channels: Collection[MessageColumns]) -> str:
    start = _start_ns(channels)
    return (
        f"times: the clock of the recorder was set back by {-step.size_ns / _SECOND_NS:.3f} s, "
        f"{(step.before_ns - start) / _SECOND_NS:.1f} s after the start, in the order of the file "
        f"({len(step.names)} channels: {', '.join(step.names)}); all later times were increased by "
        "this, so that the sampling goes on: compare the times with a clock of the ship if they "
        "matter"
    )


def _pair_warning(forward: ClockStep, back: ClockStep, channels: Collection[MessageColumns]) -> str:
    start = _start_ns(channels)
    is_ahead = forward.position < back.position
    first, last = (forward, back) if is_ahead else (back, forward)
    return (
        f"times: the clock of the recorder was set {'forward' if is_ahead else 'back'} by "
        f"{forward.size_ns / _SECOND_NS:.3f} s, {(first.before_ns - start) / _SECOND_NS:.1f} s "
        f"after the start, and {'back' if is_ahead else 'forward'} by the same "
        f"{abs(last.before_ns - first.after_ns) / _SECOND_NS:.1f} s later, in the order of the "
        f"file; the times in between were {'decreased' if is_ahead else 'increased'} by this: "
        "compare the times with a clock of the ship if they matter"
    )


def _continued(channel: MessageColumns, steps: Sequence[ClockStep]) -> MessageColumns:
    """Return a channel without the steps, in its measured times too where these have them."""
    received, measured = channel.received_ns, channel.measured_ns
    lag = measured - received
    rows = [int(np.searchsorted(channel.positions, step.position)) for step in steps]
    ends = [0, *rows, len(measured)]
    for number, (row, step) in enumerate(zip(rows, steps, strict=True)):
        before = lag[max(row - LAG_SAMPLES, ends[number]) : row]
        after = lag[row : min(row + LAG_SAMPLES, ends[number + 2])]
        change = float(np.median(after) - np.median(before)) if len(before) and len(after) else 0.0
        if row < len(measured) and abs(change) < 0.5 * abs(step.size_ns):
            measured = measured.copy()
            measured[row:] -= step.size_ns
    received = continued_times(ChannelTimes("", channel.positions, received), steps)
    return replace(channel, received_ns=received, measured_ns=measured)


def _start_ns(channels: Collection[MessageColumns]) -> int:
    """Return the time of the first message in the file, ns."""
    first = min((c for c in channels if len(c.positions)), key=lambda c: int(c.positions[0]))
    return int(first.received_ns[0])


def _date(time_ns: int) -> str:
    return str(np.datetime64(time_ns, "ns").astype("M8[s]"))


def _instant(time_ns: int) -> str:
    return f"{np.datetime64(time_ns, 'ns').astype('M8[ms]')}Z"

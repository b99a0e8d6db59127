"""Repair of the times of a file's messages: impossible times dropped, steps of a clock removed."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import LogError
from shiplog.types import FloatArray, TimeArray, is_sorted

from .clock_steps import (
    ChannelTimes,
    ClockStep,
    backward_rows,
    common_steps,
    continued_times,
    is_steady,
    pause_rows,
    sampling_interval,
    steps_back,
)

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


def repair_clock_steps(
    file: str, columns: Mapping[int, MessageColumns]
) -> tuple[dict[int, MessageColumns], int, list[str]]:
    """Remove the steps of the recorder's and the sensors' clocks.

    Parameters
    ----------
    file
        The name of the file, for messages.
    columns
        The messages by channel id.

    Returns
    -------
    columns, change_ns, warnings
        The messages with times that go on at the sampling rate, the sum of the removed steps of
        the recorder's clock in ns, and what was done.

    Raises
    ------
    LogError
        The clock was set back in some channels only, so that the right times are not known.
    """
    channels = dict(columns)
    change, warnings = 0, []
    if not all(is_sorted(c.received_ns) for c in channels.values()):
        steps = _received_steps(file, channels.values())
        warnings += [_step_warning(step, channels.values()) for step in steps]
        change = sum(step.size_ns for step in steps)
        channels = {id_: _continued(channel, steps) for id_, channel in channels.items()}
    for id_, channel in channels.items():
        channels[id_], warning = _repair_measured(channel)
        warnings += warning
    return channels, change, warnings


def pause_warnings(channels: Collection[MessageColumns]) -> list[str]:
    """Report gaps in all channels at once: a pause of the recorder, or its clock set forward.

    Parameters
    ----------
    channels
        The messages with repaired times.
    """
    times = [ChannelTimes(c.topic, c.positions, c.received_ns) for c in channels]
    times = [channel for channel in times if is_steady(channel)]
    rows = [pause_rows(channel.times_ns) for channel in times]
    if len(times) < 2 or not all(rows):
        return []
    return [
        f"times: all channels have no samples for {step.size_ns / _SECOND_NS:.1f} s, "
        f"{(step.before_ns - int(min(c.times_ns[0] for c in times))) / _SECOND_NS:.1f} s after the "
        "start; the recorder paused, or its clock was set forward: times were not changed; if the "
        "clock was set, evaluate the parts before and after separately"
        for step in common_steps(times, rows)
        if len(step.names) == len(times)
    ]


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
    few = max(MAX_DROPPED_SHARE * len(received), MAX_DROPPED_SAMPLES)
    warnings = []
    if outside.any():
        warnings.append(
            f"{channel.topic}: {outside.sum()} of {len(outside)} samples have a time before 1970 "
            "or after 2262 and were dropped; the clock had rolled over or was not set: check the "
            "program that wrote the file"
        )
    if 0 < far.sum() <= few:
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


def _received_steps(file: str, channels: Collection[MessageColumns]) -> list[ClockStep]:
    """Return the steps back of the recorder's clock; refuse those of some channels only."""
    times = [
        ChannelTimes(c.topic, c.positions, c.received_ns) for c in channels if len(c.positions)
    ]
    steps = steps_back(times)
    for step in steps:
        if step.steady_names:
            start = min(int(c.times_ns[0]) for c in times)
            raise LogError(
                f"the times of {', '.join(step.names)} run back by "
                f"{-step.size_ns / _SECOND_NS:.3g} s in the order of the file, "
                f"{(step.before_ns - start) / _SECOND_NS:.6g} s after the start, those of "
                f"{', '.join(step.steady_names)} do not; one of several clocks was set: use the "
                f"part before {_instant(step.after_ns)}, or set --from after "
                f"{_instant(step.before_ns)}: {file}"
            )
    return steps


def _step_warning(step: ClockStep, channels: Collection[MessageColumns]) -> str:
    start = min(int(c.received_ns[0]) for c in channels if len(c.received_ns))
    return (
        f"times: the clock of the recorder was set back by {-step.size_ns / _SECOND_NS:.3f} s, "
        f"{(step.before_ns - start) / _SECOND_NS:.1f} s after the start, in the order of the file "
        f"({len(step.names)} channels: {', '.join(step.names)}); all later times were increased by "
        "this, so that the sampling goes on: compare the times with a clock of the ship if they "
        "matter"
    )


def _continued(channel: MessageColumns, steps: Sequence[ClockStep]) -> MessageColumns:
    """Return a channel without the steps, in its measured times too where these have them."""
    received, measured = channel.received_ns, channel.measured_ns
    for step in steps:
        row = int(np.searchsorted(channel.positions, step.position))
        if row < len(measured):
            lag = measured - received
            before, after = lag[max(row - 32, 0) : row], lag[row : row + 32]
            change = float(np.median(after) - np.median(before)) if len(before) else 0.0
            if abs(change) < 0.5 * abs(step.size_ns):
                measured = measured.copy()
                measured[row:] -= step.size_ns
        received = continued_times(ChannelTimes("", channel.positions, received), [step])
    return replace(channel, received_ns=received, measured_ns=measured)


def _repair_measured(channel: MessageColumns) -> tuple[MessageColumns, list[str]]:
    """Remove steps back of the sensor's clock, against the steady times of reception."""
    measured = channel.measured_ns
    if is_sorted(measured) or not is_sorted(channel.received_ns):
        return channel, []
    warnings = []
    for row in backward_rows(measured):
        lag = measured - channel.received_ns
        before, after = lag[max(row - 32, 0) : row], lag[row : row + 32]
        size = round(float(np.median(after) - np.median(before)))
        interval, _ = sampling_interval(channel.received_ns)
        if size >= -interval:
            continue
        measured = measured.copy()
        if abs(np.median(after)) < abs(np.median(before)):
            measured[:row] += size
            part = "earlier"
        else:
            measured[row:] -= size
            part = "later"
        warnings.append(
            f"{channel.topic}: the clock of the sensor was set back by {-size / _SECOND_NS:.3f} s, "
            f"{(channel.received_ns[row] - channel.received_ns[0]) / _SECOND_NS:.1f} s after its "
            f"start, the times of reception go on; its {part} times were shifted by this: check "
            "the sensor's clock"
        )
    return replace(channel, measured_ns=measured), warnings


def _date(time_ns: int) -> str:
    return str(np.datetime64(time_ns, "ns").astype("M8[s]"))


def _instant(time_ns: int) -> str:
    return f"{np.datetime64(time_ns, 'ns').astype('M8[ms]')}Z"

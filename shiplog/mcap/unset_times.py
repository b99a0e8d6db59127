"""Times that were not set: one of a message's two times is used for both, or the log is shifted."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shiplog.types import TimeArray

from .clock_repair import MAX_DISTANCE_NS, MessageColumns, max_faulty_times


def are_set(first_ns: int, last_ns: int) -> bool:
    """Whether a log with times within these bounds has none to replace, to shift or to drop.

    Whether times are replaced or dropped depends on their share in the whole log and its median.
    Where this is true, no part of the log has such times either.

    Examples
    --------
    >>> are_set(0, 600 * 10**9), are_set(-30 * 10**9, 570 * 10**9)
    (True, False)
    """
    start = 0 if last_ns <= MAX_DISTANCE_NS else 1  # in a log with dates, zero is an unset time
    return first_ns >= start and last_ns - first_ns < MAX_DISTANCE_NS


def replace_unset_times(
    columns: Mapping[int, MessageColumns],
) -> tuple[dict[int, MessageColumns], list[str]]:
    """Replace times of zero or before 1970 where these are many.

    In a log with dates, the time of reception is used for the time of measurement, or the reverse.
    A log of a clock since its start with times below zero is shifted to zero as a whole.

    Parameters
    ----------
    columns
        The messages by channel id.

    Returns
    -------
    columns, warnings
        The messages, and what was replaced.
    """
    filled = [c for c in columns.values() if len(c.received_ns)]
    if all(min(int(c.received_ns.min()), int(c.measured_ns.min())) > 0 for c in filled):
        return dict(columns), []
    if any(
        max(np.median(c.received_ns), np.median(c.measured_ns)) > MAX_DISTANCE_NS for c in filled
    ):
        replaced = {id_: _with_set_times(channel) for id_, channel in columns.items()}
        return (
            {id_: channel for id_, (channel, _) in replaced.items()},
            [warning for _, warnings in replaced.values() for warning in warnings],
        )
    return _shifted_to_zero(columns)


def _with_set_times(channel: MessageColumns) -> tuple[MessageColumns, list[str]]:
    """Use the time of reception where that of measurement was not set, or the reverse."""
    received, measured = channel.received_ns, channel.measured_ns
    if _are_many_unset(measured) and not _are_many_unset(received):
        unset, replaced, used = measured <= 0, "measurement", "reception"
        channel = replace(channel, measured_ns=np.where(unset, received, measured))
    elif _are_many_unset(received) and not _are_many_unset(measured):
        unset, replaced, used = received <= 0, "reception", "measurement"
        channel = replace(channel, received_ns=np.where(unset, measured, received))
    else:
        return channel, []
    warning = (
        f"{channel.topic}: the time of {replaced} of {unset.sum()} of {len(unset)} samples was not "
        f"set (zero or before 1970); their time of {used} is used for it: set both times in the "
        "program that wrote the file"
    )
    return channel, [warning]


def _shifted_to_zero(
    columns: Mapping[int, MessageColumns],
) -> tuple[dict[int, MessageColumns], list[str]]:
    """Shift a log whose times are not dates, and many below zero, to begin at zero."""
    filled = [c for c in columns.values() if len(c.received_ns)]
    times = [t for c in filled for t in (c.received_ns, c.measured_ns)]
    if not any(int((t < 0).sum()) > max_faulty_times(len(t)) for t in times):
        return dict(columns), []
    start = min(int(t[t > -MAX_DISTANCE_NS].min(initial=0)) for t in times)
    warning = (
        f"times: the log has times before 1970, from {start * 1e-9:.3f} s on, as of a clock that "
        "was not set; all times were shifted so that the log begins at zero, and its dates have no "
        "meaning: record with a clock in UTC if they matter"
    )
    return {
        id_: replace(
            c, received_ns=_shift(c.received_ns, start), measured_ns=_shift(c.measured_ns, start)
        )
        for id_, c in columns.items()
    }, [warning]


def _shift(times: TimeArray, start: int) -> TimeArray:
    """Return times minus a start; impossible ones far before it stay below zero."""
    return np.where(times > -MAX_DISTANCE_NS, times - start, times)


def _are_many_unset(times: TimeArray) -> bool:
    return int((times <= 0).sum()) > max_faulty_times(len(times))

"""Clocks that stood still: all samples of a channel have one time."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shiplog.types import TimeArray
from shiplog.units import utc_text

from .clock_repair import MessageColumns

MIN_SAMPLES = 100  # fewer may have come at once
MIN_RECEPTION_NS = 1_000_000_000  # over which the others came, for their times to be used


def stands_still(samples: int, first_ns: int, last_ns: int) -> bool:
    """Whether that many samples with times within these bounds are of a clock that stood still.

    Examples
    --------
    >>> stands_still(2000, 5, 5), stands_still(20, 5, 5), stands_still(2000, 5, 6)
    (True, False, False)
    """
    return samples >= MIN_SAMPLES and first_ns == last_ns


def replace_still_times(
    columns: Mapping[int, MessageColumns],
) -> tuple[dict[int, MessageColumns], list[str]]:
    """Use the times of reception of a channel whose times of measurement are all the same.

    Where those of reception are the same, too, nothing can be done.

    Parameters
    ----------
    columns
        The messages by channel id.

    Returns
    -------
    columns, warnings
        The messages, and what was replaced or found.
    """
    result, warnings = dict(columns), []
    timeless: dict[str, list[str]] = {}  # topics by what is reported of them
    for id_, channel in columns.items():
        if not _are_still(channel.measured_ns):
            continue
        at = f"have one time of measurement, {utc_text(int(channel.measured_ns[0]) * 1e-9)}"
        if _are_still(channel.received_ns):
            timeless.setdefault(at, []).append(channel.topic)
        if int(np.ptp(channel.received_ns)) < MIN_RECEPTION_NS:
            continue
        result[id_] = replace(channel, measured_ns=channel.received_ns)
        warnings.append(
            f"{channel.topic}: all {len(channel.measured_ns)} samples {at}; their times of "
            "reception are used for it: set both times in the program that wrote the file"
        )
    warnings += [
        f"{', '.join(topics)}: all samples {at}, and of reception, as of a clock that stood still; "
        "nothing that depends on the time can be computed from them: record them again"
        for at, topics in timeless.items()
    ]
    return result, warnings


def _are_still(times: TimeArray) -> bool:
    return bool(len(times)) and stands_still(len(times), int(times.min()), int(times.max()))

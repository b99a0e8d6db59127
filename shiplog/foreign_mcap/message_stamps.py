"""Times of measurement in messages: stamps of ROS and protobuf, texts, and numbers."""

import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import numpy as np

from shiplog.errors import LayoutError
from shiplog.layouts.mcap_layout import MESSAGE_TIMES
from shiplog.units import UNITS

from .field_values import Getter, field_getter, optional_value

DEFAULT_STAMPS = ("header.stamp", "timestamp", "stamp")  # the first that a message has is used
_SECONDS = ("sec", "secs", "seconds")
_NANOSECONDS = ("nanosec", "nsec", "nsecs", "nanos", "nanoseconds")
_IMPOSSIBLE_NS = -1  # of a time that 64 bits cannot hold: it is dropped as other impossible times


def find_stamp(message: object) -> str:
    """Return the path of the time of measurement in a message, or ``publish_time``.

    A number is not used: its unit and its zero are not known.

    Examples
    --------
    >>> find_stamp({"timestamp": {"sec": 5, "nsec": 0}, "value": 1.0})
    'timestamp'
    >>> find_stamp({"timestamp": 5.0})
    'publish_time'
    """
    for path in DEFAULT_STAMPS:
        value = optional_value(message, path)
        if value is not None and not isinstance(value, int | float):
            return path
    return MESSAGE_TIMES[0]


def numeric_stamp(message: object) -> str:
    """Return the path of a time that is a number, which is not used; empty where there is none."""
    values = ((path, optional_value(message, path)) for path in DEFAULT_STAMPS)
    return next((path for path, value in values if isinstance(value, int | float)), "")


def stamp_getter(path: str, unit: str) -> Getter:
    """Return a function that gives the time of a message in ns since 1970.

    Parameters
    ----------
    path
        Path of the time.
    unit
        Unit of a time that is a number; empty where it is none.
    """
    find = field_getter(path)
    return lambda message: stamp_ns(find(message), path, unit)


def stamp_ns(value: object, path: str, unit: str = "") -> int:
    """Return a stamp in ns since 1970-01-01 UTC; 0, which means not set, where it is absent.

    Raises
    ------
    LayoutError
        It is no time, a number without unit, or a text without time zone.

    Examples
    --------
    >>> stamp_ns({"sec": 2, "nanosec": 5}, "stamp"), stamp_ns(1500, "t", "ms")
    (2000000005, 1500000000)
    >>> stamp_ns("1970-01-01T00:00:01.000000001Z", "timestamp")
    1000000001
    """
    if value is None:
        return 0
    if isinstance(value, int | float | np.number):
        return _number_ns(value, path, unit)
    if isinstance(value, str):
        return _text_ns(value, path)
    parts = [_part(value, names) for names in (_SECONDS, _NANOSECONDS)]
    if parts[0] is None:
        raise LayoutError(f"the field {path!r} is no time; state another stamp")
    return _within(int(parts[0]) * 10**9 + int(parts[1] or 0))


def _number_ns(value: float | np.number[Any], path: str, unit: str) -> int:
    if not unit:
        raise LayoutError(f"the time {path!r} is the number {value}; state time.unit")
    factor = UNITS[unit][1] * 1e9
    if isinstance(value, int) and factor >= 1:
        return _within(value * round(factor))
    return _within(round(float(value) * factor)) if np.isfinite(value) else _IMPOSSIBLE_NS


def _text_ns(text: str, path: str) -> int:
    match = re.fullmatch(r"(.+?)(?:\.(\d{1,9})\d*)?(Z|[+-]\d\d:?\d\d)", text.strip())
    try:
        if match is None:
            raise ValueError
        instant = datetime.fromisoformat(match[1] + match[3])
    except ValueError:
        raise LayoutError(
            f"the time {path!r} is {text!r:.40}; readable are times with their zone, such as "
            "2026-03-29T00:55:00Z"
        ) from None
    return _within(round(instant.timestamp()) * 10**9 + int((match[2] or "0").ljust(9, "0")))


def _part(value: object, names: tuple[str, ...]) -> Any:  # noqa: ANN401
    """Return the field that has one of the names; None where there is none."""
    for name in names:
        found = value.get(name) if isinstance(value, Mapping) else getattr(value, name, None)
        if isinstance(found, int | float) and np.isfinite(found):
            return found
    return None


def _within(time_ns: int) -> int:
    return time_ns if abs(time_ns) < 2**63 else _IMPOSSIBLE_NS

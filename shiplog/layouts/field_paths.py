"""Paths of fields in messages, such as `twist.linear.x` or `data[3]`."""

import re

_STEP = re.compile(r"([^.\[\]]+)|\[(\d{1,6})\]")
_PATH = re.compile(r"[^.\[\]]+(\[\d{1,6}\])*(\.[^.\[\]]+(\[\d{1,6}\])*)*")


def parse_path(path: str) -> tuple[str | int, ...] | None:
    """Return the names and the numbers of elements along a path; None if it is none.

    Examples
    --------
    >>> parse_path("pose.covariance[0]")
    ('pose', 'covariance', 0)
    >>> parse_path("pose..x") is None
    True
    """
    if not _PATH.fullmatch(path):
        return None
    return tuple(int(index) if index else name for name, index in _STEP.findall(path))

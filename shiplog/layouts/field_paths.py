"""Paths of fields in messages, such as `twist.linear.x`, `data[3]` or `state."gyro.rate"`."""

import re

# without surrogates, which a layout cannot have
_NAME = r'[^.\[\]"\ud800-\udfff]+|"[^"\ud800-\udfff]+"'
_STEP = re.compile(rf"({_NAME})|\[(\d{{1,6}})\]")
_PART = rf"(?:{_NAME})(?:\[\d{{1,6}}\])*"
_PATH = re.compile(rf"{_PART}(?:\.{_PART})*")


def parse_path(path: str) -> tuple[str | int, ...] | None:
    """Return the names and the numbers of elements along a path; None if it is none.

    Examples
    --------
    >>> parse_path("pose.covariance[0]"), parse_path('state."gyro.rate"')
    (('pose', 'covariance', 0), ('state', 'gyro.rate'))
    >>> parse_path("pose..x") is None
    True
    """
    if not _PATH.fullmatch(path):
        return None
    return tuple(int(index) if index else name.strip('"') for name, index in _STEP.findall(path))


def path_name(name: str) -> str:
    """Return a name as it stands in a path, quoted where needed; empty where no path can have it.

    Examples
    --------
    >>> path_name("linear"), path_name("gyro.rate"), path_name('12"')
    ('linear', '"gyro.rate"', '')
    """
    if re.search(r"[.\[\]]", name):
        name = f'"{name}"'
    return name if re.fullmatch(_NAME, name) else ""

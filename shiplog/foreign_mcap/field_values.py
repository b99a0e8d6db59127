"""Values of fields in decoded messages, by their paths, and the paths that a message has."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from shiplog.errors import LayoutError
from shiplog.layouts.field_paths import parse_path, path_name
from shiplog.units import did_you_mean

MAX_LISTED_ELEMENTS = 4  # of an array, in a list of paths
MAX_LISTED_PATHS = 400
_MAX_DEPTH = 12
Getter = Callable[[Any], Any]  # of a message: the value of a field; None where it is absent


def field_getter(path: str) -> Getter:
    """Return a function that finds a field in a message.

    The function returns None where the message does not have the field: a key of JSON, an optional
    field of protobuf, or an element of a shorter array. It raises `AttributeError` where no message
    of the type can have it.

    Examples
    --------
    >>> field_getter("pose.xyz[1]")({"pose": {"xyz": [1.0, 2.0]}})
    2.0
    """
    steps = parse_path(path) or ()

    def value(message: Any) -> Any:  # noqa: ANN401 - of any type of message
        for step in steps:
            message = _element(message, step) if isinstance(step, int) else _field(message, step)
            if message is None:
                return None
        return message

    return value


def optional_value(message: object, path: str) -> Any:  # noqa: ANN401 - of any type of message
    """Return the value of a field, None where the message cannot have it, or is None itself."""
    try:
        return field_getter(path)(message)
    except AttributeError:
        return None


def number(value: object, path: str) -> float:
    """Return a value as a number; NaN where the field is absent.

    Raises
    ------
    LayoutError
        It is no number.

    Examples
    --------
    >>> number(None, "speed"), number(3, "speed")
    (nan, 3.0)
    """
    if value is None:
        return np.nan
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return np.inf
    if isinstance(value, str | bool | bytes):
        raise LayoutError(f"the field {path!r} has {value!r:.40}, which is not a number")
    inner = field_paths(value)
    hint = f"; name one of its fields, such as {f'{path}.{inner[0]}'!r}" if inner else ""
    raise LayoutError(f"the field {path!r} is no number{hint}")


def field_paths(message: object) -> list[str]:
    """Return the paths of all numbers in a message, of arrays those of the first elements.

    Examples
    --------
    >>> field_paths({"a": {"b": 1.0}, "c": [2, 3], "d": "text"})
    ['a.b', 'c[0]', 'c[1]']
    """
    paths: list[str] = []
    for path in _walk(message, "", 0):
        paths.append(path)
        if len(paths) >= MAX_LISTED_PATHS:
            break
    return paths


def missing_field_text(path: str, paths: Sequence[str]) -> str:
    """Return the error for a path that messages do not have, with the nearest that they have.

    Examples
    --------
    >>> missing_field_text("angular.z", ["angular_velocity.z", "linear.x"])
    "no field 'angular.z'; did you mean 'angular_velocity.z'?"
    """
    near = did_you_mean(path, paths)
    if not near:
        last = path.rpartition(".")[2]
        near = did_you_mean(last, [each.rpartition(".")[2] for each in paths])
        same = [each for each in paths if near and f"{each.rpartition('.')[2]!r}" in near]
        near = f"; did you mean {same[0]!r}?" if same else ""
    listed = "" if near or not paths else f"; there are {', '.join(paths[:12])}"
    return f"no field {path!r}{near}{listed}"


def _field(value: Any, name: str) -> Any:  # noqa: ANN401
    """Return a named field; None where it is absent."""
    if isinstance(value, dict):
        return value.get(name)
    descriptor = getattr(value, "DESCRIPTOR", None)
    if descriptor is None:
        return getattr(value, name)
    field = descriptor.fields_by_name.get(name)
    if field is None:
        raise AttributeError(name)
    if field.has_presence and not value.HasField(name):
        return None
    return getattr(value, name)


def _element(value: Any, index: int) -> Any:  # noqa: ANN401
    """Return an element of an array; None where the array is shorter."""
    if isinstance(value, str | bytes | Mapping) or not hasattr(value, "__len__"):
        raise AttributeError(f"[{index}]")
    return value[index] if index < len(value) else None


def _walk(value: Any, path: str, depth: int) -> Iterator[str]:  # noqa: ANN401
    """Yield the paths of the numbers in a value, which may be of any type of message."""
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        if path:
            yield path
    elif depth < _MAX_DEPTH and not isinstance(value, str | bytes):
        for name, inner in _parts(value):
            joined = name if name.startswith("[") or not path else f".{name}"
            yield from _walk(inner, path + joined, depth + 1)


def _parts(value: Any) -> Iterator[tuple[str, Any]]:  # noqa: ANN401
    """Yield the names and the values of what a value is made of."""
    if isinstance(value, Mapping):
        named = ((path_name(str(name)), inner) for name, inner in value.items())
        yield from ((name, inner) for name, inner in named if name)
    elif is_dataclass(value):
        yield from ((each.name, getattr(value, each.name)) for each in fields(value))
    elif hasattr(value, "DESCRIPTOR"):
        yield from ((each.name, getattr(value, each.name)) for each in value.DESCRIPTOR.fields)
    elif hasattr(value, "__len__") and hasattr(value, "__getitem__"):
        yield from ((f"[{i}]", value[i]) for i in range(min(len(value), MAX_LISTED_ELEMENTS)))

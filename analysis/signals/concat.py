"""Chunks of a result put together: whatever its arrays, one after the other."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np

from shiplog.types import Signals, concatenate_signals

T = TypeVar("T")


def concatenate(chunks: Sequence[T]) -> T:
    """Consecutive chunks of one kind of dataclass, one at least, as one.

    Arrays are put together along their first axis, dataclasses within likewise; all else is as in
    the first chunk.
    """
    first = chunks[0]
    if isinstance(first, Signals):
        return concatenate_signals(chunks)  # type: ignore[arg-type,return-value]
    parts: dict[str, Any] = {}
    for field in fields(first):  # type: ignore[arg-type]
        values = [getattr(chunk, field.name) for chunk in chunks]
        if isinstance(values[0], np.ndarray):
            parts[field.name] = np.concatenate(values)
        elif is_dataclass(values[0]):
            parts[field.name] = concatenate(values)
    return replace(first, **parts)  # type: ignore[type-var]

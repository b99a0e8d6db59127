"""Concatenation of consecutive chunks of a result."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np

from shiplog.types import Signals, concatenate_signals

T = TypeVar("T")


def concatenate(chunks: Sequence[T]) -> T:
    """Concatenate consecutive chunks of one dataclass.

    Parameters
    ----------
    chunks
        At least one chunk, in order of time, all of the same class.

    Returns
    -------
    T
        A dataclass whose arrays are concatenated along their first axis, as are those of nested
        dataclasses. All other fields are those of the first chunk.
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

"""Slabs of a result put together: whatever its arrays, one after the other."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np

from shiplog.types import Signals, joined

T = TypeVar("T")


def stacked(slabs: Sequence[T]) -> T:
    """Consecutive slabs of one kind of dataclass, one at least, as one.

    Arrays are put together along their first axis, dataclasses within likewise; all else is as in
    the first slab.
    """
    first = slabs[0]
    if isinstance(first, Signals):
        return joined(slabs)  # type: ignore[arg-type,return-value]
    parts: dict[str, Any] = {}
    for field in fields(first):  # type: ignore[arg-type]
        values = [getattr(slab, field.name) for slab in slabs]
        if isinstance(values[0], np.ndarray):
            parts[field.name] = np.concatenate(values)
        elif is_dataclass(values[0]):
            parts[field.name] = stacked(values)
    return replace(first, **parts)  # type: ignore[type-var]

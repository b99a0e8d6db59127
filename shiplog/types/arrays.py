"""Read-only arrays and mappings, of which the data types are made."""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FloatArray = NDArray[np.floating[Any]]
TimeArray = NDArray[np.int64]

K = TypeVar("K")
V_co = TypeVar("V_co", covariant=True)


def read_only(array: ArrayLike, dtype: type[Any]) -> NDArray[Any]:
    """Return a read-only view of an array; the caller's own array stays writeable.

    Parameters
    ----------
    array
        An array, or what numpy makes one of. It is copied only where `dtype` requires it.
    dtype
        The type of the elements of the view.

    Examples
    --------
    >>> view = read_only([1, 2], np.float64)
    >>> view.flags.writeable
    False
    """
    view = np.asarray(array, dtype=dtype).view()
    view.flags.writeable = False
    return view


def is_sorted(times: TimeArray | FloatArray) -> bool:
    """Whether no element of an array (n,) is less than the one before it.

    Examples
    --------
    >>> is_sorted(np.array([1, 2, 2])), is_sorted(np.array([2, 1]))
    (True, False)
    """
    return bool(np.all(times[1:] >= times[:-1]))


class ReadOnlyMapping(Mapping[K, V_co]):
    """A mapping that cannot be changed, and that can be pickled and deep-copied.

    It holds its own copy of the items, so that later changes of the original do not reach it.

    Examples
    --------
    >>> ReadOnlyMapping({"ship": "KVLCC2"})["ship"]
    'KVLCC2'
    """

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[K, V_co]) -> None:
        self._items = dict(items)

    def __getitem__(self, key: K) -> V_co:
        return self._items[key]

    def __iter__(self) -> Iterator[K]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return repr(self._items)


def constructor_arguments(instance: "DataclassInstance") -> tuple[Any, ...]:
    """Return the values of a dataclass's fields, in the order of its constructor.

    A class whose `__reduce__` returns them is pickled and copied by its constructor.
    """
    return tuple(getattr(instance, each.name) for each in fields(instance))

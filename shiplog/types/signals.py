"""Signals: channels on one uniform clock."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .arrays import FloatArray, ReadOnlyMapping, TimeArray, constructor_arguments, read_only


@dataclass(frozen=True, eq=False)
class Signals:
    """Channels on one uniform clock, or a chunk of them.

    As with a pandas DataFrame, `len` is the number of samples, while iteration and ``in`` go by
    the channel names. ``signals["rudder"]`` is an array (n,).

    Attributes
    ----------
    start_ns
        The start of the clock, ns since 1970-01-01 UTC.
    dt_secs
        The time step, s.
    values
        The samples (n,) by channel name. NaN means not measured.
    first
        The number of the chunk's first sample, counted from the start of the clock. Sample k
        of the chunk is at `start_ns` + (`first` + k) · `dt_secs`.

    Examples
    --------
    >>> signals = Signals(0, 0.5, {"speed": np.array([5.0, 5.1, 5.2])})
    >>> len(signals), list(signals), "rudder" in signals
    (3, ['speed'], False)
    >>> signals.time_secs
    array([0. , 0.5, 1. ])
    """

    start_ns: int
    dt_secs: float
    values: Mapping[str, FloatArray]
    first: int = 0

    def __post_init__(self) -> None:
        views = {name: read_only(values, np.float64) for name, values in self.values.items()}
        object.__setattr__(self, "values", ReadOnlyMapping(views))

    def __reduce__(self) -> tuple[type["Signals"], tuple[Any, ...]]:
        """Pickle and copy by the constructor, which makes the arrays read-only."""
        return type(self), constructor_arguments(self)

    def __getitem__(self, name: str) -> FloatArray:
        """Return the samples of a channel, (n,)."""
        return self.values[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is a channel of that name."""
        return name in self.values

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the channels."""
        return iter(self.values)

    def __len__(self) -> int:
        """Return the number of samples, the same in all channels."""
        return len(next(iter(self.values.values()), ()))

    @property
    def time_secs(self) -> FloatArray:
        """The time of each sample since the start of the clock, (n,), s."""
        return np.arange(self.first, self.first + len(self)) * self.dt_secs

    @property
    def timestamps_ns(self) -> TimeArray:
        """The time of each sample, (n,), ns since 1970-01-01 UTC."""
        return self.start_ns + np.round(self.time_secs * 1e9).astype(np.int64)

    def part(self, start: int, stop: int) -> "Signals":
        """Return the samples `start` to `stop` - 1 of these, without copying them."""
        values = {name: array[start:stop] for name, array in self.values.items()}
        return replace(self, values=values, first=self.first + start)


def concatenate_signals(chunks: Iterable[Signals]) -> Signals:
    """Join consecutive chunks of signals, at least one.

    Examples
    --------
    >>> signals = Signals(0, 0.5, {"speed": np.arange(3.0)})
    >>> concatenate_signals([signals.part(0, 2), signals.part(2, 3)])["speed"]
    array([0., 1., 2.])
    """
    parts = list(chunks)
    values = {name: np.concatenate([part[name] for part in parts]) for name in parts[0].values}
    return replace(parts[0], values=values)

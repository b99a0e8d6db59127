"""Channel: the samples of one quantity from one source."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray, ReadOnlyMapping, TimeArray, constructor_arguments, read_only


@dataclass(frozen=True, eq=False)
class Channel:
    """The samples of one quantity from one source, in the order in which they were received.

    Attributes
    ----------
    name
        The quantity, such as ``yaw_rate``; `shiplog.units.CATALOGUE` lists the known ones.
    source
        The sensor or program it comes from, such as ``gyro``.
    unit
        The unit of the values: SI and radians, but rpm for the propeller.
    measured_ns
        (n,) times of measurement, ns since 1970-01-01 UTC.
    received_ns
        (n,) times of reception, ns since 1970-01-01 UTC.
    values
        (n,), or (n, k) where `fields` names k components. NaN means not measured.
    fields
        The names of the components, such as ``("north", "east")``; empty for a scalar.
    metadata
        Further text about the channel, by key.

    Raises
    ------
    ValueError
        The shapes of times, values and fields do not agree.

    Examples
    --------
    >>> times = np.array([0, 100_000_000])
    >>> Channel("rudder", "feedback", "rad", times, times, np.array([0.0, 0.1]))
    Channel(/rudder/feedback [rad], 2 samples)
    """

    name: str
    source: str
    unit: str
    measured_ns: TimeArray
    received_ns: TimeArray
    values: FloatArray
    fields: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "measured_ns", read_only(self.measured_ns, np.int64))
        object.__setattr__(self, "received_ns", read_only(self.received_ns, np.int64))
        object.__setattr__(self, "values", read_only(self.values, np.float64))
        object.__setattr__(self, "metadata", ReadOnlyMapping(self.metadata))
        shape = (len(self.measured_ns), len(self.fields)) if self.fields else self.measured_ns.shape
        if self.values.shape != shape or self.received_ns.shape != self.measured_ns.shape:
            raise ValueError(
                f"{self.topic}: values {self.values.shape}, measured_ns {self.measured_ns.shape}"
                f" and received_ns {self.received_ns.shape} do not fit fields {self.fields}"
            )

    def __reduce__(self) -> tuple[type["Channel"], tuple[Any, ...]]:
        """Pickle and copy by the constructor, which makes the arrays read-only."""
        return type(self), constructor_arguments(self)

    @property
    def topic(self) -> str:
        """The topic in the MCAP file, such as ``/yaw_rate/gyro``: one per quantity and source."""
        return f"/{self.name}/{self.source}"

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """The topic and the fields, which together are unique within a log."""
        return self.topic, self.fields

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.measured_ns)

    def take(self, rows: slice | NDArray[np.intp]) -> "Channel":
        """Return the channel with the selected samples only.

        Parameters
        ----------
        rows
            A slice, or an index array (m,), as numpy takes it.
        """
        return replace(
            self,
            measured_ns=self.measured_ns[rows],
            received_ns=self.received_ns[rows],
            values=self.values[rows],
        )

    def part(self, start: int, stop: int) -> "Channel":
        """Return the samples with the numbers `start` to `stop` - 1, without copying them."""
        return self.take(slice(start, stop))

    def __repr__(self) -> str:
        return f"Channel({self.topic} [{self.unit}], {len(self)} samples)"


def concatenate_channels(parts: Sequence[Channel]) -> Channel:
    """Join consecutive parts of one channel.

    Parameters
    ----------
    parts
        At least one part. Name, source, unit, fields and metadata are those of the first.
    """
    if len(parts) == 1:
        return parts[0]
    return replace(
        parts[0],
        measured_ns=np.concatenate([part.measured_ns for part in parts]),
        received_ns=np.concatenate([part.received_ns for part in parts]),
        values=np.concatenate([part.values for part in parts]),
    )

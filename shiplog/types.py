"""What a trial is: channels of samples, and the same on one clock."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import LogError
from .units import did_you_mean

FloatArray = NDArray[np.floating[Any]]
TimeArray = NDArray[np.int64]


def frozen(array: ArrayLike, dtype: type[Any]) -> NDArray[Any]:
    """A read-only view; the caller's own array stays as writeable as it was."""
    view = np.asarray(array, dtype=dtype).view()
    view.flags.writeable = False
    return view


@dataclass(frozen=True, eq=False)
class Channel:
    """The samples of one quantity from one source, in the order in which they were received.

    `values` is (n,), or (n, k) where `fields` names k components. NaN means not measured.
    `measured_ns` and `received_ns` are (n,), nanoseconds since 1970-01-01 UTC.
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
        object.__setattr__(self, "measured_ns", frozen(self.measured_ns, np.int64))
        object.__setattr__(self, "received_ns", frozen(self.received_ns, np.int64))
        object.__setattr__(self, "values", frozen(self.values, np.float64))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))
        shape = (len(self.measured_ns), len(self.fields)) if self.fields else self.measured_ns.shape
        if self.values.shape != shape or self.received_ns.shape != self.measured_ns.shape:
            raise ValueError(
                f"{self.topic}: values {self.values.shape}, measured_ns {self.measured_ns.shape}"
                f" and received_ns {self.received_ns.shape} do not fit fields {self.fields}"
            )

    @property
    def topic(self) -> str:
        """`/yaw_rate/gyro`: one topic per quantity and source."""
        return f"/{self.name}/{self.source}"

    def __len__(self) -> int:
        """The number of samples."""
        return len(self.measured_ns)

    def __repr__(self) -> str:
        """What it is, not all that it holds."""
        return f"Channel({self.topic} [{self.unit}], {len(self)} samples)"


@dataclass(frozen=True, eq=False)
class TrialLog:
    """A recorded trial, as it was: each channel with its own times.

    `log["yaw_rate"]` is the first source of that quantity in the file, `log["yaw_rate/gyro"]`
    the one asked for.
    """

    name: str
    channels: tuple[Channel, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    warnings: tuple[str, ...] = ()  # what reading it met: an unfinished file, foreign topics
    data_lost: bool = False  # whether a part of the file could not be read

    def __post_init__(self) -> None:
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))
        topics = [(channel.topic, channel.fields) for channel in self.channels]
        if len(set(topics)) < len(topics):
            raise ValueError(f"{self.name}: two channels of one topic; merge them: {topics}")

    def __getitem__(self, key: str) -> Channel:
        """The channel of that name, or of that name and source; `LogError` where there is none."""
        found = self.get(key)
        if found is None:
            has = sorted({channel.name for channel in self.channels})
            raise LogError(
                f"no channel {key!r} in {self.name}; it has {', '.join(has) or 'none'}"
                f"{did_you_mean(key, has)}"
            )
        return found

    def get(self, key: str) -> Channel | None:
        """As `log[key]`, with None where there is no such channel."""
        name, _, source = key.strip("/").partition("/")
        for channel in self.channels:
            if channel.name == name and source in ("", channel.source):
                return channel
        return None

    def __contains__(self, key: str) -> bool:
        """Whether there is such a channel."""
        return self.get(key) is not None

    def __iter__(self) -> Iterator[Channel]:
        """The channels in the order of the file."""
        return iter(self.channels)

    def preferring(self, sources: Mapping[str, str]) -> "TrialLog":
        """The same log with one source only for each name given, the one given.

        Raises `LogError` where there is no such channel.
        """
        preferred = [self[f"{name}/{source}"] for name, source in sources.items()]
        others = [channel for channel in self.channels if channel.name not in sources]
        return replace(self, channels=(*preferred, *others))

    @property
    def span_ns(self) -> tuple[int, int]:
        """The first and the last instant at which anything was measured; (0, 0) if nothing was."""
        times = [c.measured_ns for c in self.channels if len(c)]
        if not times:
            return (0, 0)
        return min(int(t.min()) for t in times), max(int(t.max()) for t in times)

    @property
    def duration_secs(self) -> float:
        """From the first measurement to the last."""
        start, end = self.span_ns
        return (end - start) * 1e-9


@dataclass(frozen=True, eq=False)
class Signals:
    """Channels on one uniform clock: sample k was at `start_ns` + k·dt. NaN: not measured."""

    start_ns: int
    dt_secs: float
    values: Mapping[str, FloatArray]  # each (n,)

    def __post_init__(self) -> None:
        views = {name: frozen(values, np.float64) for name, values in self.values.items()}
        object.__setattr__(self, "values", MappingProxyType(views))

    def __getitem__(self, name: str) -> FloatArray:
        """The values of a channel, (n,)."""
        return self.values[name]

    def __contains__(self, name: str) -> bool:
        """Whether the channel is there."""
        return name in self.values

    def __len__(self) -> int:
        """The number of samples."""
        return len(next(iter(self.values.values())))

    @property
    def time_secs(self) -> FloatArray:
        """(n,) seconds since the clock's start."""
        return np.arange(len(self)) * self.dt_secs

    @property
    def stamps_ns(self) -> TimeArray:
        """(n,) nanoseconds since 1970-01-01 UTC."""
        return self.start_ns + np.round(self.time_secs * 1e9).astype(np.int64)

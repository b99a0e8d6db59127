"""What a trial is: channels of samples, and the same on one clock."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import LogError
from .units import did_you_mean

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

CHUNK_SAMPLES = 1 << 16  # of the fastest channel, about: what fits the processor's cache

FloatArray = NDArray[np.floating[Any]]
TimeArray = NDArray[np.int64]


def read_only(array: ArrayLike, dtype: type[Any]) -> NDArray[Any]:
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
        object.__setattr__(self, "measured_ns", read_only(self.measured_ns, np.int64))
        object.__setattr__(self, "received_ns", read_only(self.received_ns, np.int64))
        object.__setattr__(self, "values", read_only(self.values, np.float64))
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

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """What no two channels of a log share: the topic, and what it holds."""
        return self.topic, self.fields

    def take(self, rows: slice | NDArray[np.intp]) -> "Channel":
        """The same channel with some of its samples."""
        return replace(
            self,
            measured_ns=self.measured_ns[rows],
            received_ns=self.received_ns[rows],
            values=self.values[rows],
        )

    def part(self, start: int, stop: int) -> "Channel":
        """Its samples from `start` to before `stop`."""
        return self.take(slice(start, stop))

    def __repr__(self) -> str:
        """What it is, not all that it holds."""
        return f"Channel({self.topic} [{self.unit}], {len(self)} samples)"


class Named(Protocol):
    """What is of one quantity from one source."""

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def source(self) -> str: ...  # noqa: D102


C_co = TypeVar("C_co", bound=Named, covariant=True)


class ChannelsByName(Generic[C_co]):
    """Channels, or what is said of them, found by name.

    `log["yaw_rate"]` is the first source of that quantity in the file, `log["yaw_rate/gyro"]`
    the one asked for.
    """

    name: str
    channels: tuple[C_co, ...]

    def __getitem__(self, key: str) -> C_co:
        """The channel of that name, or of that name and source; `LogError` where there is none."""
        found = self.get(key)
        if found is None:
            name, _, source = key.strip("/").partition("/")
            sources = [channel.source for channel in self.channels if channel.name == name]
            if sources:
                raise LogError(
                    f"no source {source!r} of {name!r} in {self.name}; it has {', '.join(sources)}"
                )
            has = sorted({channel.name for channel in self.channels})
            raise LogError(
                f"no channel {key!r} in {self.name}; it has {', '.join(has) or 'none'}"
                f"{did_you_mean(key, has)}"
            )
        return found

    def get(self, key: str) -> C_co | None:
        """As `log[key]`, with None where there is no such channel."""
        name, _, source = key.strip("/").partition("/")
        for channel in self.channels:
            if channel.name == name and source in ("", channel.source):
                return channel
        return None

    def __contains__(self, key: str) -> bool:
        """Whether there is such a channel."""
        return self.get(key) is not None

    def __iter__(self) -> Iterator[C_co]:
        """The channels in the order of the file."""
        return iter(self.channels)


class Log(Protocol):
    """A trial that can be gone through, as often as it takes, whether or not memory holds it.

    What it says of itself is complete once it was gone through.
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def metadata(self) -> Mapping[str, str]: ...  # noqa: D102

    @property
    def vessel_toml(self) -> str | None: ...  # noqa: D102

    @property
    def warnings(self) -> tuple[str, ...]: ...  # noqa: D102

    @property
    def data_lost(self) -> bool: ...  # noqa: D102

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """The samples in chunks, those of each topic in the order in which they were received."""

    def select_sources(self, sources: Mapping[str, str]) -> Self:
        """The same log with one source only for each name given, the one given."""


@dataclass(frozen=True, eq=False)
class TrialLog(ChannelsByName[Channel]):
    """A recorded trial, as it was: each channel with its own times."""

    name: str
    channels: tuple[Channel, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    warnings: tuple[str, ...] = ()  # what reading it met: an unfinished file, foreign topics
    data_lost: bool = False  # whether a part of the file could not be read

    def __post_init__(self) -> None:
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))
        topics = [channel.key for channel in self.channels]
        if len(set(topics)) < len(topics):
            raise ValueError(f"{self.name}: two channels of one topic; merge them: {topics}")

    def select_sources(self, sources: Mapping[str, str]) -> "TrialLog":
        """The same log with one source only for each name given, the one given.

        Raises `LogError` where there is no such channel.
        """
        preferred = [self[f"{name}/{source}"] for name, source in sources.items()]
        others = [channel for channel in self.channels if channel.name not in sources]
        return replace(self, channels=(*preferred, *others))

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """The samples in chunks of some hours, each channel cut at the same times of reception."""
        leader = max(self.channels, key=len, default=None)
        times = [] if leader is None else leader.received_ns[CHUNK_SAMPLES::CHUNK_SAMPLES].tolist()
        if not all(is_sorted(c.received_ns) and is_sorted(c.measured_ns) for c in self.channels):
            times = []  # in no order: one chunk
        cuts = [[0, *np.searchsorted(c.received_ns, times), len(c)] for c in self.channels]
        for number in range(len(times) + 1):
            yield tuple(
                channel.part(ends[number], ends[number + 1])
                for channel, ends in zip(self.channels, cuts, strict=True)
            )

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

    def to_pandas(
        self, dt_secs: float | None = None, *, display_units: bool = False
    ) -> "pd.DataFrame":
        """Convert the trial to a wide data frame: one row per instant of a uniform clock.

        Every channel with at least two valid samples is resampled, as `resample` does it; NaN means
        not measured. `shiplog.tables.table.to_frame` gives the long form instead, which keeps
        every sample.

        Parameters
        ----------
        dt_secs
            Step of the clock in s; by default the sampling interval of the fastest channel.
        display_units
            Use `deg`, `deg/s` and `kn` instead of SI and radians, with the unit in the name of
            each column, such as `speed [kn]`.

        Returns
        -------
        pandas.DataFrame
            Columns by quantity, such as `yaw_rate` and `position_north`; a second source of a
            quantity as `yaw_rate/mems`. The index has the time in UTC, `attrs["units"]` the unit
            of each column.

        Examples
        --------
        >>> import shiplog
        >>> frame = shiplog.read("sample_data/zigzag_20_20.mcap").to_pandas(dt_secs=1.0)
        >>> frame["speed"].shape
        (601,)
        """
        from .tables.wide import to_wide_frame  # noqa: PLC0415 - tables imports this module

        return to_wide_frame(self, dt_secs, display_units=display_units)

    def to_xarray(self, dt_secs: float | None = None) -> "xr.Dataset":
        """Convert the trial to an xarray dataset on a uniform clock, in SI units and radians.

        The variables are the columns of `to_pandas`, each with its unit in `attrs["units"]`; the
        coordinate `time` is in UTC. Needs the package xarray (`pip install 'shiplog[xarray]'`).
        """
        from .tables.wide import to_dataset  # noqa: PLC0415 - tables imports this module

        return to_dataset(self, dt_secs)


def is_sorted(times: TimeArray | FloatArray) -> bool:
    """Whether none is less than the one before it."""
    return bool(np.all(times[1:] >= times[:-1]))


def concatenate_channels(parts: Sequence[Channel]) -> Channel:
    """Parts of a channel, one at least, one after the other."""
    if len(parts) == 1:
        return parts[0]
    return replace(
        parts[0],
        measured_ns=np.concatenate([part.measured_ns for part in parts]),
        received_ns=np.concatenate([part.received_ns for part in parts]),
        values=np.concatenate([part.values for part in parts]),
    )


@dataclass(frozen=True, eq=False)
class Signals:
    """Channels on one uniform clock, or a chunk of them. NaN: not measured.

    Sample k was at `start_ns` + (first + k)·dt.
    """

    start_ns: int
    dt_secs: float
    values: Mapping[str, FloatArray]  # each (n,)
    first: int = 0  # the number of the chunk's first sample

    def __post_init__(self) -> None:
        views = {name: read_only(values, np.float64) for name, values in self.values.items()}
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
        return np.arange(self.first, self.first + len(self)) * self.dt_secs

    @property
    def timestamps_ns(self) -> TimeArray:
        """(n,) nanoseconds since 1970-01-01 UTC."""
        return self.start_ns + np.round(self.time_secs * 1e9).astype(np.int64)

    def part(self, start: int, stop: int) -> "Signals":
        """The samples from `start` to before `stop`, counted within these."""
        values = {name: array[start:stop] for name, array in self.values.items()}
        return replace(self, values=values, first=self.first + start)


def concatenate_signals(chunks: Iterable[Signals]) -> Signals:
    """Consecutive chunks, one at least, as one."""
    parts = list(chunks)
    values = {name: np.concatenate([part[name] for part in parts]) for name in parts[0].values}
    return replace(parts[0], values=values)

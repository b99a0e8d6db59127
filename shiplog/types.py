"""Data types of a trial: channels, logs, and signals on one uniform clock.

A `Channel` holds the samples of one sensor with their own times. A `TrialLog` holds the channels of
a trial in memory; `Log` is the interface that it shares with `shiplog.LogFile`, a log read from its
file chunk by chunk. `Signals` are channels resampled to one clock.

All are immutable: their arrays are read-only views and their mappings reject assignment. All can be
pickled and deep-copied, and the copies are read-only too.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import LogError
from .units import did_you_mean

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from _typeshed import DataclassInstance

CHUNK_SAMPLES = 1 << 16  # of the longest channel in a chunk of a `TrialLog`: fits the CPU cache

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
        return type(self), _constructor_arguments(self)

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


class NamedChannel(Protocol):
    """Anything about one quantity from one source: a channel, or statistics of it."""

    @property
    def name(self) -> str:
        """The quantity."""

    @property
    def source(self) -> str:
        """The sensor or program it comes from."""


C_co = TypeVar("C_co", bound=NamedChannel, covariant=True)


class ChannelsByName(Generic[C_co]):
    """A collection of channels, or of something about each of them, indexed by name.

    ``log["yaw_rate"]`` is the first source of that quantity in the file, ``log["yaw_rate/gyro"]``
    the source named. Iteration yields the channels in the order of the file and `len` counts
    them; ``in`` accepts a name, a name with its source, and a channel.

    Attributes
    ----------
    name
        The name of the log, for messages.
    channels
        The channels in the order of the file.
    """

    name: str
    channels: tuple[C_co, ...]

    def __getitem__(self, key: str) -> C_co:
        """Return the channel of a name, or of a name and a source.

        Raises
        ------
        LogError
            There is no such channel; the message lists those that the log has.
        """
        found = self.get(key)
        if found is None:
            raise LogError(self._no_channel(key))
        return found

    def get(self, key: str) -> C_co | None:
        """Return ``log[key]``, or None if there is no such channel."""
        name, _, source = key.strip("/").partition("/")
        for channel in self.channels:
            if channel.name == name and source in ("", channel.source):
                return channel
        return None

    def _no_channel(self, key: str) -> str:
        name, _, source = key.strip("/").partition("/")
        sources = [channel.source for channel in self.channels if channel.name == name]
        if sources:
            return f"no source {source!r} of {name!r} in {self.name}; it has {', '.join(sources)}"
        names = sorted({channel.name for channel in self.channels})
        return (
            f"no channel {key!r} in {self.name}; it has {', '.join(names) or 'none'}"
            f"{did_you_mean(key, names)}"
        )

    def __contains__(self, key: object) -> bool:
        """Whether a name, a name with its source, or a channel is in the log."""
        if isinstance(key, str):
            return self.get(key) is not None
        return any(channel is key for channel in self.channels)

    def __iter__(self) -> Iterator[C_co]:
        """Iterate over the channels in the order of the file."""
        return iter(self.channels)

    def __len__(self) -> int:
        """Return the number of channels."""
        return len(self.channels)


class Log(Protocol):
    """The interface of a log, whether it is in memory (`TrialLog`) or in its file (`LogFile`).

    Of a log in its file, `warnings` and `data_lost` are complete after a first pass over `chunks`.
    """

    @property
    def name(self) -> str:
        """The name of the file."""

    @property
    def metadata(self) -> Mapping[str, str]:
        """Text about the trial, by key."""

    @property
    def vessel_toml(self) -> str | None:
        """The attached vessel file."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Problems met in reading the file."""

    @property
    def data_lost(self) -> bool:
        """Whether a part of the file could not be read."""

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Iterate over the samples in chunks, each topic in the order of reception.

        Each call is one pass over the log; a log allows any number of them.
        """

    def select_sources(self, sources: Mapping[str, str]) -> Self:
        """Return the log with a single source for each of the names given.

        Parameters
        ----------
        sources
            The source to keep, by channel name.

        Raises
        ------
        LogError
            The log has no such channel.
        """


@dataclass(frozen=True, eq=False)
class TrialLog(ChannelsByName[Channel]):
    """A recorded trial in memory: its channels, each with its own times.

    ``log["rudder"]`` is a channel, iteration yields the channels, `len` counts them, and ``in``
    accepts a name, a name with its source, and a channel.

    Attributes
    ----------
    name
        The name of the file.
    channels
        The channels in the order of the file; no two have the same topic and fields.
    metadata
        Text about the trial, by key.
    vessel_toml
        The attached vessel file, or None.
    warnings
        Problems met in reading the file: an unfinished file, damage, topics of other programs.
    data_lost
        Whether a part of the file could not be read.

    Examples
    --------
    >>> import shiplog
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
    >>> sorted(channel.name for channel in log)
    ['heading', 'position', 'rpm', 'rudder', 'speed', 'yaw_rate']
    >>> "rudder" in log, len(log)
    (True, 6)
    """

    name: str
    channels: tuple[Channel, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    warnings: tuple[str, ...] = ()
    data_lost: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "metadata", ReadOnlyMapping(self.metadata))
        topics = [channel.key for channel in self.channels]
        if len(set(topics)) < len(topics):
            raise ValueError(f"{self.name}: two channels of one topic; merge them: {topics}")

    def select_sources(self, sources: Mapping[str, str]) -> "TrialLog":
        """Return the log with a single source for each of the names given.

        Parameters
        ----------
        sources
            The source to keep, by channel name.

        Raises
        ------
        LogError
            The log has no such channel.
        """
        selected = [self[f"{name}/{source}"] for name, source in sources.items()]
        others = [channel for channel in self.channels if channel.name not in sources]
        return replace(self, channels=(*selected, *others))

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Iterate over the samples in chunks, all channels cut at the same times of reception.

        A chunk has all channels; some may be empty. Its longest channel has about 65,000 samples
        (`CHUNK_SAMPLES`). A log whose times run backwards comes in one chunk.
        """
        longest = max(self.channels, key=len, default=None)
        times = (
            [] if longest is None else longest.received_ns[CHUNK_SAMPLES::CHUNK_SAMPLES].tolist()
        )
        if not all(is_sorted(c.received_ns) and is_sorted(c.measured_ns) for c in self.channels):
            times = []
        cuts = [[0, *np.searchsorted(c.received_ns, times), len(c)] for c in self.channels]
        for number in range(len(times) + 1):
            yield tuple(
                channel.part(ends[number], ends[number + 1])
                for channel, ends in zip(self.channels, cuts, strict=True)
            )

    @property
    def span_ns(self) -> tuple[int, int]:
        """The first and the last time of measurement, ns; (0, 0) for a log without samples."""
        times = [c.measured_ns for c in self.channels if len(c)]
        if not times:
            return (0, 0)
        return min(int(t.min()) for t in times), max(int(t.max()) for t in times)

    @property
    def duration_secs(self) -> float:
        """The time from the first measurement to the last, s."""
        start, end = self.span_ns
        return (end - start) * 1e-9

    def to_pandas(
        self, dt_secs: float | None = None, *, display_units: bool = False
    ) -> "pd.DataFrame":
        """Convert the trial to a wide data frame: one row per instant of a uniform clock.

        Every channel with at least two valid samples is resampled, as `resample` does it; NaN means
        not measured. `shiplog.tables.long_form.to_frame` gives the long form instead, which keeps
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
        return type(self), _constructor_arguments(self)

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


def _constructor_arguments(instance: "DataclassInstance") -> tuple[Any, ...]:
    return tuple(getattr(instance, each.name) for each in fields(instance))

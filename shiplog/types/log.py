"""A log in memory: the channels of a trial, each with its own times."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays import ReadOnlyMapping, is_sorted
from .channel import Channel
from .channels_by_name import ChannelsByName
from .event import Event
from .inputs_in_force import inputs_in_force, with_inputs_in_force
from .time_cut import empty_cut_error, resolve_cut

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

CHUNK_SAMPLES = 1 << 16  # of the longest channel in a chunk of a `TrialLog`: fits the CPU cache


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
    events
        What happened during the trial, in the order of time.

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
    events: tuple[Event, ...] = ()

    def __post_init__(self) -> None:
        events = tuple(sorted(self.events, key=lambda event: event.time_ns))
        object.__setattr__(self, "events", events)
        object.__setattr__(self, "metadata", ReadOnlyMapping(self.metadata))
        topics = [channel.key for channel in self.channels]
        if len(set(topics)) < len(topics):
            raise ValueError(f"{self.name}: two channels of one topic; merge them: {topics}")

    def select_sources(self, sources: Mapping[str, str]) -> "TrialLog":
        """Return the log with a single source for each of the names given; see `Log`."""
        selected = [self[f"{name}/{source}"] for name, source in sources.items()]
        others = [channel for channel in self.channels if channel.name not in sources]
        return replace(self, channels=(*selected, *others))

    def between(
        self, start: float | str | None = None, end: float | str | None = None
    ) -> "TrialLog":
        """Return the part of the log that was measured between two times.

        Parameters
        ----------
        start, end
            The bounds: the part has the samples from `start` on and before `end`. A number is in
            s: since the log's start, or, if negative, before its end. A text is a time in ISO
            8601, such as ``2026-05-01T12:04:30Z``, or a time of day, such as ``12:04:30``; in UTC
            where it states no time zone. None is no bound.

        Returns
        -------
        log
            The part. Its name and its metadata ``cut`` state the bounds. A rudder angle or rpm
            that is in force at `start` is repeated there if it has no sample within a second.

        Raises
        ------
        UsageError
            A bound cannot be read, or no sample is between them.

        Examples
        --------
        >>> import shiplog
        >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
        >>> log.between(120, -30).name
        'zigzag_20_20.mcap (120 to 570 s)'
        """
        if start is None and end is None:
            return self
        cut = resolve_cut(start, end, self.span_ns, self.name)
        channels = tuple(map(cut.apply, self.channels))
        if not any(map(len, channels)):
            raise empty_cut_error(start, end, self.span_ns, self.name)
        samples = inputs_in_force([self.channels], cut.start_ns)
        channels = with_inputs_in_force(channels, samples)
        metadata = {**self.metadata, "cut": cut.text(self.name)}
        name = cut.name_of_part(self.name)
        events = cut.events_within(self.events)
        return replace(self, name=name, channels=channels, metadata=metadata, events=events)

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
        frame: pd.DataFrame = _wide().to_wide_frame(self, dt_secs, display_units=display_units)
        return frame

    def to_xarray(self, dt_secs: float | None = None) -> "xr.Dataset":
        """Convert the trial to an xarray dataset on a uniform clock, in SI units and radians.

        The variables are the columns of `to_pandas`, each with its unit in `attrs["units"]`; the
        coordinate `time` is in UTC. Needs the package xarray (`pip install 'shiplog[xarray]'`).
        """
        dataset: xr.Dataset = _wide().to_dataset(self, dt_secs)
        return dataset


def _wide() -> Any:  # noqa: ANN401 - a module
    """Load the conversion to wide tables by its name: the data types depend on no format."""
    return import_module("shiplog.tables.wide")

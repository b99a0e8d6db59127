"""Buffer of decoded samples and events, taken out as channels."""

from dataclasses import dataclass, field

import numpy as np

from shiplog.types import Channel, Event, EventLevel
from shiplog.units import CATALOGUE, GEOGRAPHIC

STREAM_KEY = "stream"  # of a channel's metadata: the stream from which it was decoded
MAX_TOPICS = 256  # sources come from the wire; a ship has far fewer


@dataclass
class _Column:
    """The samples of one topic that were not yet taken."""

    name: str
    source: str
    unit: str
    fields: tuple[str, ...]
    metadata: dict[str, str]
    measured_ns: list[int] = field(default_factory=list)
    received_ns: list[int] = field(default_factory=list)
    values: list[float | tuple[float, float, float]] = field(default_factory=list)

    def take(self) -> Channel:
        measured_ns, received_ns, values = self.measured_ns, self.received_ns, self.values
        self.measured_ns, self.received_ns, self.values = [], [], []
        return Channel(
            self.name,
            self.source,
            self.unit,
            np.array(measured_ns, np.int64),
            np.array(received_ns, np.int64),
            np.array(values, np.float64),
            self.fields,
            self.metadata,
        )


class SampleBuffer:
    """Samples by topic, in the order in which they are added.

    Parameters
    ----------
    prefix
        Put before the source of each topic, such as ``gyro.``, so that two streams with the same
        talker have topics of their own.
    stream
        The name of the stream, for the metadata of each topic; none where it is empty.

    Examples
    --------
    >>> buffer = SampleBuffer()
    >>> buffer.add("heading", "HE", 3.5, received_ns=0)
    True
    >>> buffer.take()
    (Channel(/heading/HE [rad], 1 samples),)
    """

    def __init__(self, prefix: str = "", stream: str = "") -> None:
        self._prefix, self._stream = prefix, stream
        self._columns: dict[tuple[str, str], _Column] = {}
        self._events: list[Event] = []

    def add(
        self, name: str, source: str, value: float, received_ns: int, measured_ns: int | None = None
    ) -> bool:
        """Add a sample of a scalar.

        Parameters
        ----------
        name
            A channel of `shiplog.units.CATALOGUE`.
        source
            The sensor: a talker, or an address.
        value
            The value, in the unit of the catalogue; NaN means not measured.
        received_ns, measured_ns
            Times, ns since 1970-01-01 UTC. A sample without its own time of measurement was
            measured when it was received.

        Returns
        -------
        added
            False where there are `MAX_TOPICS` topics already and this would be another one.
        """
        column = self._columns.get((name, source)) or self._new_column(name, source, ())
        if column is None:
            return False
        column.measured_ns.append(received_ns if measured_ns is None else measured_ns)
        column.received_ns.append(received_ns)
        column.values.append(value)
        return True

    def add_position(
        self,
        source: str,
        fix: tuple[float, float, float],
        received_ns: int,
        measured_ns: int | None = None,
    ) -> bool:
        """Add a fix: latitude and longitude in deg, altitude in m (NaN where unknown)."""
        column = self._columns.get(("position", source)) or self._new_column(
            "position", source, GEOGRAPHIC
        )
        if column is None:
            return False
        column.measured_ns.append(received_ns if measured_ns is None else measured_ns)
        column.received_ns.append(received_ns)
        column.values.append(fix)
        return True

    def add_event(
        self, time_ns: int, text: str, source: str, level: EventLevel = EventLevel.WARNING
    ) -> None:
        """Add an event of the stream itself, such as a corrected date."""
        self._events.append(Event(time_ns, text, source, level))

    def describe(self, name: str, source: str, **metadata: str) -> None:
        """Set metadata of a topic; they are written with its first sample."""
        column = self._columns.get((name, source)) or self._new_column(
            name, source, GEOGRAPHIC if name == "position" else ()
        )
        if column is not None:
            column.metadata.update(metadata)

    def take(self) -> tuple[Channel | Event, ...]:
        """Return what was added since the last call, one channel per topic, and the events."""
        events, self._events = self._events, []
        channels = [column.take() for column in self._columns.values() if column.values]
        return (*channels, *events)

    def _new_column(self, name: str, source: str, fields: tuple[str, ...]) -> _Column | None:
        if len(self._columns) >= MAX_TOPICS:
            return None
        unit = "deg" if fields else CATALOGUE[name].unit  # an altitude is in m
        metadata = {STREAM_KEY: self._stream} if self._stream else {}
        column = _Column(name, self._prefix + source, unit, fields, metadata)
        self._columns[name, source] = column
        return column

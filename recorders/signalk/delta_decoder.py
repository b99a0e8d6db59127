"""Decoder of Signal K deltas."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from functools import partial
from math import isfinite, nan
from typing import Any, NamedTuple

from recorders.streams.counts import StreamCounts
from recorders.streams.gnss_clock import GnssClock, Utc
from recorders.streams.packets import END_NS, MAX_PACKET_BYTES, Packet, packet_lines
from recorders.streams.sample_buffer import SampleBuffer
from shiplog.tables.printed_times import DAY_NS

from .signalk_paths import OF_RECEIVERS, find_target

MAX_SOURCE_LENGTH = 64
MAX_PATH_LENGTH = 80
MAX_CONTEXTS = 64  # of ships, own and others; names come from the wire
_TIME = "navigation.datetime"
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_NO_NAME = re.compile(r"[^A-Za-z0-9._-]+")  # what no part of a topic should hold


class _Update(NamedTuple):
    """The source of an update, and its times, ns: of reception, and as a receiver states it."""

    source: str
    received_ns: int
    gnss_ns: int | None


class DeltaError(ValueError):
    """A part of a delta that is rejected; the text is the reason, from a fixed set."""


class DeltaDecoder:
    """Samples of the values of the own ship.

    Parameters
    ----------
    own_ship
        The context of the own ship, such as ``vessels.urn:mrn:imo:mmsi:230029970``; by default that
        of the server's greeting, and ``vessels.self``.
    own_times
        Whether the times of the updates are those of measurement, as in a file without other time
        stamps; if not, these are the times of reception, the clock that all sources share.
    gnss_time
        Whether the time of measurement of a GNSS receiver's samples is the receiver's own.
    """

    def __init__(
        self, own_ship: str | None = None, *, own_times: bool = False, gnss_time: bool = False
    ) -> None:
        self._own_ships = {"vessels.self"} | ({own_ship} if own_ship else set())
        self._own_times = own_times
        self._counts = StreamCounts()
        self._clock = GnssClock(
            self._counts.warn, is_applied=gnss_time, received_is_known=not own_times
        )
        self._other_ships: set[str] = set()

    @property
    def counts(self) -> StreamCounts:
        """What was decoded, skipped and rejected so far, by path."""
        return self._counts

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        """Decode lines with one delta each."""
        for packet in batch:
            for line in packet_lines(packet.data):
                try:
                    self._add_delta(parse_delta(line), packet.received_ns, samples)
                except DeltaError as error:
                    self._counts.reject(str(error))

    def finish(self, samples: SampleBuffer) -> None:
        """Report the latencies of the receivers; warn where no delta was of the own ship."""
        del samples
        self._clock.finish()
        for key, text in self._clock.notes():
            self._counts.note(key, text)
        if self._other_ships and not self._counts.accepted:
            names = ", ".join(sorted(self._other_ships)[:3])
            self._counts.warn(
                f"no delta is of the own ship; state which of these it is by --self: {names}"
            )

    def _add_delta(self, delta: Mapping[str, Any], received_ns: int, samples: SampleBuffer) -> None:
        if "updates" not in delta:
            own_ship = delta.get("self")  # in the greeting of a server
            if isinstance(own_ship, str) and len(self._own_ships) < MAX_CONTEXTS:
                self._own_ships |= {own_ship, f"vessels.{own_ship}"}
            self._counts.skip("no delta")
            return
        context = delta.get("context", "vessels.self")
        if not isinstance(context, str):
            raise DeltaError("context is no text")
        if context not in self._own_ships:
            if len(self._other_ships) < MAX_CONTEXTS:
                self._other_ships.add(context[:MAX_PATH_LENGTH])
            self._counts.skip("delta of another ship")
            return
        updates = _list(delta["updates"])
        if not updates:
            self._counts.skip("delta without a value")
        for update in updates:
            try:
                self._add_update(update, received_ns, samples)
            except DeltaError as error:
                self._counts.reject(str(error))

    def _add_update(self, update: object, received_ns: int, samples: SampleBuffer) -> None:
        """Add the values of one source; each is counted, and an update without any."""
        if not isinstance(update, dict):
            raise DeltaError("update is no object")
        source = source_name(update)
        measured_ns = received_ns
        if self._own_times and "timestamp" in update:
            measured_ns = instant_ns(update["timestamp"])
        values = _list(update.get("values", []))
        if not values:
            self._counts.skip("update without a value")
        gnss_ns = self._gnss_time_ns(values, source, measured_ns)
        origin = _Update(source, received_ns, gnss_ns)
        for pair in values:
            add = partial(self._take_value, pair, origin, samples)
            path = pair.get("path") if isinstance(pair, dict) else None
            if isinstance(path, str) and path in OF_RECEIVERS:
                self._clock.write_measured(source, path, (measured_ns, gnss_ns), add)
            else:
                add(measured_ns)

    def _gnss_time_ns(self, values: Sequence[Any], source: str, received_ns: int) -> int | None:
        """Return the time that a receiver states in an update, with its week corrected."""
        stated = [v.get("value") for v in values if isinstance(v, dict) and v.get("path") == _TIME]
        try:
            day, clock_ns = divmod(instant_ns(stated[0]), DAY_NS)
        except (DeltaError, IndexError):
            return None
        return self._clock.set_time(source, f" {_TIME}", Utc(clock_ns, day), received_ns)

    def _take_value(
        self, pair: object, update: _Update, samples: SampleBuffer, measured_ns: int
    ) -> None:
        """Add the samples of a path and its value, or count why there are none."""
        try:
            self._add_value(pair, update, samples, measured_ns)
        except DeltaError as error:
            self._counts.reject(str(error))

    def _add_value(
        self, pair: object, update: _Update, samples: SampleBuffer, measured_ns: int
    ) -> None:
        """Add the samples of a path and its value."""
        if not isinstance(pair, dict) or not isinstance(path := pair.get("path"), str):
            raise DeltaError("value without a path")
        value = pair.get("value")
        source, times = update.source, (update.received_ns, measured_ns)
        added = 0
        if path == "navigation.position":
            fix = _fix(value)
            added += fix is not None and samples.add_position(source, fix, *times)
        elif path == _TIME:
            stated_ns = None if value is None else instant_ns(value)
            if stated_ns is not None:
                secs = (update.gnss_ns or stated_ns) * 1e-9
                added += samples.add("gnss_time", source, secs, *times)
        else:
            for target, number in list(_numbers(path, value)):  # all of them, or none
                name = f"{source}.{target.part}" if target.part else source
                added += samples.add(target.channel, name, number, *times)
        kind = _printable(path)
        if added:
            self._counts.accept(kind)
        else:
            self._counts.skip(kind)


def parse_delta(line: bytes) -> Mapping[str, Any]:
    """Return the object of a line of JSON.

    Raises
    ------
    DeltaError
        The line holds none.
    """
    if len(line) >= MAX_PACKET_BYTES:
        raise DeltaError(f"line of more than {MAX_PACKET_BYTES} bytes")
    try:
        delta = json.loads(line)
    except (ValueError, RecursionError):
        raise DeltaError("line is no JSON") from None
    if not isinstance(delta, dict):
        raise DeltaError("line is no JSON object")
    return delta


def instant_ns(text: object) -> int:
    """Return the instant of a time stamp, ns since 1970-01-01 UTC.

    Raises
    ------
    DeltaError
        It is no date and time with a zone, or not of the years 1970 to 2261.
    """
    try:
        instant = datetime.fromisoformat(text) if isinstance(text, str) else None
    except ValueError:
        instant = None
    if instant is None or instant.tzinfo is None:
        raise DeltaError("time stamp is no date and time with a zone")
    time_ns = (instant - _EPOCH) // timedelta(microseconds=1) * 1000
    if not 0 <= time_ns < END_NS:
        raise DeltaError("time stamp outside of the years 1970 to 2261")
    return time_ns


def source_name(update: Mapping[str, Any]) -> str:
    """Return the name of the source of an update, fit for a topic.

    Examples
    --------
    >>> source_name({"$source": "n2k.204"})
    'n2k.204'
    >>> source_name({"source": {"label": "gyro", "talker": "HE"}})
    'gyro.HE'
    """
    name = update.get("$source")
    source = update.get("source")
    if not isinstance(name, str) and isinstance(source, dict):
        parts = (source.get(key) for key in ("label", "src", "talker"))
        name = ".".join(str(part) for part in parts if isinstance(part, str | int))
    clean = _NO_NAME.sub("_", name if isinstance(name, str) else "").strip("._")
    return clean[:MAX_SOURCE_LENGTH] or "signalk"


def _numbers(path: str, value: object) -> Iterator[tuple[Any, float]]:
    """Yield the channels of a path with their values in the catalogue's units.

    These may be the values of an object.
    """
    items = value.items() if isinstance(value, dict) else [("", value)]
    for key, item in items:
        target = find_target(f"{path}.{key}" if key else path)
        if target is not None and item is not None:
            yield target, _finite(_number(item) * target.factor + target.offset)


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DeltaError("value is no number")
    try:
        number = float(value)
    except OverflowError:
        number = nan
    return _finite(number)


def _finite(number: float) -> float:
    if not isfinite(number):
        raise DeltaError("value is no finite number")
    return number


def _fix(value: object) -> tuple[float, float, float] | None:
    """Return latitude and longitude in deg and altitude in m of a position."""
    if value is None:
        return None
    if not isinstance(value, dict):
        raise DeltaError("position is no object")
    latitude, longitude = value.get("latitude"), value.get("longitude")
    if latitude is None or longitude is None:
        return None
    north, east = _number(latitude), _number(longitude)
    if abs(north) > 90 or abs(east) > 180:
        raise DeltaError("position outside of the globe")
    altitude = value.get("altitude")
    return north, east, nan if altitude is None else _number(altitude)


def _list(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise DeltaError("updates or values are no list")
    return value


def _printable(path: str) -> str:
    """Return a path from the wire as a terminal may show it."""
    return _NO_NAME.sub("_", path)[:MAX_PATH_LENGTH] or "empty path"

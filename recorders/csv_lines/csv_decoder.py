"""Decoder of lines of separated values, as the description of their device states."""

import re
from collections.abc import Mapping, Sequence
from functools import reduce
from math import degrees, isfinite, nan
from operator import xor

from recorders.streams.counts import StreamCounts
from recorders.streams.packets import Packet, packet_lines
from recorders.streams.sample_buffer import SampleBuffer
from shiplog.layouts.layout import DEGREES_MINUTES, HEMISPHERES, Column
from shiplog.units import CATALOGUE, conversion_factor

from .device import Device, LineKind

_NO_NAME = re.compile(r"[^A-Za-z0-9$._-]+")
_NO_FRAMING = dict.fromkeys((0, 2, 3))  # NUL, and STX and ETX around what a checksum covers
_MAX_NAME = 16  # characters of a first field, as it is counted
_HEMISPHERE_SIGNS = {"N": 1.0, "E": 1.0, "S": -1.0, "W": -1.0}


class FieldError(ValueError):
    """A line that is rejected; the text is the reason, from a fixed set."""


class CsvDecoder:
    """Samples of the lines of one device.

    Parameters
    ----------
    device
        The kinds of its lines.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._counts = StreamCounts()
        self._factors = {
            (kind.begins, role): column.sign * conversion_factor(column.unit, CATALOGUE[name].unit)
            for kind in device.kinds.values()
            for role, column in kind.columns.items()
            if (name := role.partition(".")[0]) in CATALOGUE
        }

    @property
    def counts(self) -> StreamCounts:
        """What was decoded, skipped and rejected so far, by the first field of the lines."""
        return self._counts

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        """Decode lines; a datagram may hold several."""
        for packet in batch:
            for line in packet_lines(packet.data):
                try:
                    self._add_line(line.decode("ascii"), packet.received_ns, samples)
                except UnicodeDecodeError:
                    self._counts.reject("characters that are not ASCII")
                except FieldError as error:
                    self._counts.reject(str(error))

    def finish(self, samples: SampleBuffer) -> None:
        """Do nothing: a line waits for no other."""

    def _add_line(self, line: str, received_ns: int, samples: SampleBuffer) -> None:
        line = line.translate(_NO_FRAMING).strip()
        fields = [field.strip() for field in line.split(self._device.delimiter)]
        name = fields[0] if fields else ""
        kind = self._device.kinds.get(name) or self._device.kinds.get("")
        shown = _NO_NAME.sub("_", name)[:_MAX_NAME] or "empty line"
        if kind is None:
            self._counts.skip(shown)
            return
        _check(kind, fields, line, self._device.delimiter)
        values = {
            role: _number(fields, column, self._factors.get((kind.begins, role), 1.0))
            for role, column in kind.columns.items()
            if role.partition(".")[0] not in HEMISPHERES
        }
        fixes = [(name, _fix(kind, name, values, fields)) for name in kind.receivers]
        added = 0
        for role, value in values.items():
            channel, _, part = role.partition(".")
            if value is not None and channel in CATALOGUE:
                added += samples.add(channel, _source(kind, part), value, received_ns)
        for part, fix in fixes:
            if fix is not None:
                added += samples.add_position(_source(kind, part), fix, received_ns)
        if added:
            self._counts.accept(kind.begins or "line")
        else:
            self._counts.skip(f"{kind.begins or 'line'} without a value")


def _check(kind: LineKind, fields: Sequence[str], line: str, delimiter: str | None) -> None:
    """Check what the description demands of a line."""
    if kind.fields is not None and len(fields) != kind.fields:
        raise FieldError("wrong number of fields")
    if kind.checksum and not _has_checksum(line, delimiter or " "):
        raise FieldError("wrong checksum")
    for place, text in kind.where.items():
        if place > len(fields) or fields[place - 1] != text:
            raise FieldError("unit or status is not that of a valid line")


def _has_checksum(line: str, delimiter: str) -> bool:
    _, _, rest = line.partition(delimiter)
    text, separator, digits = rest.rpartition(delimiter)
    checksum = reduce(xor, (text + separator).encode(), 0)
    return re.fullmatch("[0-9A-Fa-f]{2}", digits) is not None and int(digits, 16) == checksum


def _number(fields: Sequence[str], column: Column, factor: float) -> float | None:
    """Return the number in a column times a factor, or None where it is empty or NaN."""
    place = int(column.place)
    if place > len(fields):
        raise FieldError("too few fields")
    text = fields[place - 1]
    if not text or text.lower() == "nan":
        return None
    try:
        number = nan if "_" in text else float(text) * factor
    except ValueError:
        number = nan
    if not isfinite(number):
        raise FieldError("field is no number")
    return number


def _source(kind: LineKind, part: str) -> str:
    return f"{kind.source}.{part}" if part else kind.source


def _fix(
    kind: LineKind, receiver: str, values: Mapping[str, float | None], fields: Sequence[str]
) -> tuple[float, float, float] | None:
    """Return latitude and longitude in deg and altitude in m, where the line has them."""
    suffix = f".{receiver}" if receiver else ""
    latitude, longitude = values[f"latitude{suffix}"], values[f"longitude{suffix}"]
    if latitude is None or longitude is None:
        return None
    unit = kind.columns[f"latitude{suffix}"].unit
    north = _degrees(latitude, unit) * _hemisphere(kind, f"north_south{suffix}", "NS", fields)
    east = _degrees(longitude, unit) * _hemisphere(kind, f"east_west{suffix}", "EW", fields)
    if abs(north) > 90 or abs(east) > 180:
        raise FieldError("position outside of the globe")
    altitude = values.get(f"altitude{suffix}")
    return north, east, nan if altitude is None else altitude


def _degrees(value: float, unit: str) -> float:
    if unit != DEGREES_MINUTES:
        return degrees(value * conversion_factor(unit, "rad"))
    whole = abs(value) // 100
    minutes = abs(value) - 100 * whole
    if minutes >= 60:
        raise FieldError("position with 60 minutes or more")
    return (whole + minutes / 60) * (-1 if value < 0 else 1)


def _hemisphere(kind: LineKind, role: str, letters: str, fields: Sequence[str]) -> float:
    column = kind.columns.get(role)
    if column is None:
        return 1.0
    place = int(column.place)
    letter = fields[place - 1] if place <= len(fields) else ""
    if letter not in tuple(letters):
        raise FieldError("hemisphere is no letter N, S, E or W")
    return _HEMISPHERE_SIGNS[letter]

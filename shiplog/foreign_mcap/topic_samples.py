"""Samples of the channels of one topic, from its messages."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from mcap import records
from numpy.typing import NDArray

from shiplog.errors import LayoutError
from shiplog.layouts.mcap_layout import MESSAGE_TIMES, QUATERNION, FieldChannel
from shiplog.mcap.contents import KeptMessages, SampleBlock
from shiplog.types import TimeArray

from .field_conversion import ConvertedFields, convert_fields, read_paths
from .field_values import (
    Getter,
    field_getter,
    field_paths,
    missing_field_text,
    number,
    optional_value,
)
from .message_decoders import MessageError, message_decoder
from .message_stamps import find_stamp, numeric_stamp, stamp_getter

# by the type of a message: the field, the one beside it that is negative where it was not measured
NOT_MEASURED: Mapping[str, tuple[tuple[str, str], ...]] = {
    "sensor_msgs/Imu": (
        ("orientation", "orientation_covariance[0]"),
        ("angular_velocity", "angular_velocity_covariance[0]"),
        ("linear_acceleration", "linear_acceleration_covariance[0]"),
    ),
    "sensor_msgs/NavSatFix": (("", "status.status"),),
}
MIN_IDENTITIES = 10  # quaternions without rotation that are no measurement


def short_type(name: str) -> str:
    """Return the name of a type without the `msg` in its middle, which ROS 2 has and ROS 1 not."""
    return name.replace("/msg/", "/")


@dataclass(eq=False)
class FieldReader:
    """The fields of one channel, and what was found in them so far.

    Attributes
    ----------
    channel
        Its description.
    getters, paths
        Getters and paths of its numbers.
    present
        Whether each was found in a message.
    guard
        Path of the field that is negative where the channel was not measured; empty for none.
    error
        Why it cannot be read; empty so far.
    dropped
        The numbers of values not measured, by cause.
    values
        The number of values so far, measured or not.
    identities
        The number of quaternions without rotation.
    """

    channel: FieldChannel
    getters: Sequence[Getter]
    paths: tuple[str, ...]
    present: list[bool]
    guard: str = ""
    error: str = ""
    dropped: Counter[str] = field(default_factory=Counter)
    values: int = 0
    identities: int = 0

    def numbers(self, message: object) -> list[float]:
        """Return the numbers of a message; NaN where absent."""
        guard = optional_value(message, self.guard) if self.guard else None
        if guard is not None and number(guard, self.guard) < 0:
            self.dropped[f"{self.guard} below 0"] += 1
            self.present = [True] * len(self.paths)
            return [np.nan] * len(self.paths)
        row = []
        for i, (getter, path) in enumerate(zip(self.getters, self.paths, strict=True)):
            value = getter(message)
            self.present[i] |= value is not None
            row.append(number(value, path))
        return row


class TopicSamples:
    """The samples of the channels of one topic with messages of one type.

    Parameters
    ----------
    record, schema
        The records that describe the messages.
    channels
        The channels that are read from them.
    stamp_unit
        Unit of times that are numbers.

    Attributes
    ----------
    topic
        The topic.
    total, failed
        The numbers of messages, and of those that cannot be decoded.

    Raises
    ------
    LogError
        The messages cannot be decoded.
    """

    def __init__(
        self,
        record: records.Channel,
        schema: records.Schema | None,
        channels: Sequence[FieldChannel],
        stamp_unit: str,
    ) -> None:
        self.topic = record.topic
        self.total, self.failed = 0, 0
        self._failure, self._numeric_stamp = "", ""
        self._decode = message_decoder(record, schema)
        self._stamp_unit = stamp_unit
        self._sample: object = None  # the first message
        self._stamps: dict[str, str] = {}  # by the stamp that the layout states: its path
        self._stamp_error = ""
        guards = NOT_MEASURED.get(short_type(schema.name), ()) if schema else ()
        self._readers = [_field_reader(channel, guards) for channel in channels]

    def add(self, kept: KeptMessages) -> list[tuple[FieldChannel, ConvertedFields, SampleBlock]]:
        """Return the samples in further messages, by channel."""
        self.total += len(kept.messages)
        messages, rows = [], []
        for row, data in enumerate(kept.messages):
            try:
                messages.append(self._decode(data))
                rows.append(row)
            except MessageError as error:
                self.failed += 1
                self._failure = self._failure or str(error)
        if not messages:
            return []
        if self._sample is None:
            self._sample = messages[0]
        at = np.array(rows)
        decoded = KeptMessages(
            kept.received[at], kept.measured[at], kept.messages, kept.number, kept.offsets[at]
        )
        samples = []
        for reader in self._readers:
            if not reader.error and not self._stamp_error:
                samples += self._samples(reader, messages, decoded)
        return samples

    def errors(self) -> list[str]:
        """Return why channels cannot be read, after all messages."""
        texts = [self._stamp_error] if self._stamp_error else []
        paths = field_paths(self._sample)
        for reader in self._readers:
            label = reader.channel.label
            missing = [path for path, found in zip(reader.paths, reader.present, strict=True)
                       if not found and self._sample is not None]  # fmt: skip
            if reader.error:
                texts.append(f"{label}: {reader.error}")
            elif not self._stamp_error:
                texts += [f"{label}: {missing_field_text(path, paths)}" for path in missing]
        return [f"{text} (of {self.topic})" for text in texts]

    def damage(self) -> list[str]:
        """Return the warning about messages that could not be decoded."""
        if not self.failed:
            return []
        lost = f"{self.failed} of {self.total} messages could not be decoded and were dropped"
        return [f"{self.topic}: {lost} ({self._failure:.120})"]

    def warnings(self) -> list[str]:
        """Return what was not measured, after all messages."""
        texts = []
        if self._numeric_stamp:
            texts.append(
                f"{self.topic}: the times are those of publication; its field "
                f"{self._numeric_stamp!r} is a number: if it is a time, state it with its unit in "
                "[time]"
            )
        for reader in self._readers:
            label, total = reader.channel.label, reader.values
            for cause, count in (+reader.dropped).items():
                texts.append(
                    f"{self.topic}: {count} of {total} values of {label} were not measured "
                    f"({cause}) and were dropped"
                )
            if reader.identities == total >= MIN_IDENTITIES:
                texts.append(
                    f"{self.topic}: the orientation is without rotation in all {total} messages, "
                    f"as of a sensor that does not measure it; remove [{label}]"
                )
        return texts

    def _samples(
        self, reader: FieldReader, messages: Sequence[object], decoded: KeptMessages
    ) -> list[tuple[FieldChannel, ConvertedFields, SampleBlock]]:
        """Return the samples of one channel; an error is kept in its reader."""
        measured = self._measured(reader.channel, messages, decoded)
        if measured is None:
            return []
        guarded = sum(reader.dropped.values())
        try:
            raw = np.array([reader.numbers(message) for message in messages])
        except AttributeError:
            reader.error = _missing_text(reader, self._sample)
            return []
        except LayoutError as error:
            reader.error = str(error)
            return []
        guarded = sum(reader.dropped.values()) - guarded
        reader.values += len(raw)
        is_orientation = reader.channel.units[0] == QUATERNION
        if is_orientation:
            reader.identities += int(np.count_nonzero((raw == [0.0, 0.0, 0.0, 1.0]).all(axis=1)))
        samples = []
        for converted in convert_fields(reader.channel, raw):
            good = _measured_rows(converted)
            block = SampleBlock(
                decoded.received[good],
                measured[good],
                converted.values[good],
                decoded.number,
                decoded.offsets[good],
            )
            samples.append((reader.channel, converted, block))
            if converted.name != "course_over_ground" or reader.channel.name != "velocity":
                cause = "no unit quaternion" if is_orientation else "absent, NaN or infinite"
                reader.dropped[cause] += int(np.count_nonzero(~good)) - guarded
        return samples

    def _measured(
        self, channel: FieldChannel, messages: Sequence[object], decoded: KeptMessages
    ) -> TimeArray | None:
        """Return the times of measurement (n,), ns; None where they cannot be read."""
        stated = channel.choice.stamp
        if stated not in self._stamps:
            self._stamps[stated] = stated or find_stamp(self._sample)
            if not stated and self._stamps[stated] == MESSAGE_TIMES[0]:
                self._numeric_stamp = numeric_stamp(self._sample)
        path = self._stamps[stated]
        if path in MESSAGE_TIMES:
            return decoded.measured if path == MESSAGE_TIMES[0] else decoded.received
        get = stamp_getter(path, self._stamp_unit)
        try:
            return np.array([get(message) for message in messages], np.int64)
        except AttributeError:
            self._stamp_error = f"stamp: {missing_field_text(path, field_paths(self._sample))}"
        except LayoutError as error:
            self._stamp_error = str(error)
        return None


def _field_reader(channel: FieldChannel, guards: Sequence[tuple[str, str]]) -> FieldReader:
    paths = read_paths(channel)
    guard = next((path for prefix, path in guards if channel.paths[0].startswith(prefix)), "")
    return FieldReader(
        channel, [field_getter(p) for p in paths], paths, [False] * len(paths), guard
    )


def _missing_text(reader: FieldReader, message: object) -> str:
    """Return the error for the first path that messages of the type cannot have."""
    for getter, path in zip(reader.getters, reader.paths, strict=True):
        try:
            getter(message)
        except AttributeError:
            return missing_field_text(path, field_paths(message))
    return f"messages without the fields {', '.join(reader.paths)}"


def _measured_rows(converted: ConvertedFields) -> NDArray[np.bool_]:
    """Return which rows were measured, (n,); of a position without altitude only that is NaN."""
    values = converted.values
    if converted.components:
        values[np.isinf(values)] = np.nan
        values = values[:, :2]
    measured: NDArray[np.bool_] = np.all(np.isfinite(values), axis=1)
    return measured

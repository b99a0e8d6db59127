"""Decoder of NMEA 0183: from lines and datagrams to samples of channels."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from math import isnan
from typing import NamedTuple

from recorders.streams.counts import MAX_KINDS, StreamCounts
from recorders.streams.gnss_clock import GnssClock, Utc
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import MAX_TOPICS, SampleBuffer

from .environment_sentences import ENVIRONMENT
from .framing import (
    FramingError,
    TagBlock,
    is_sentence,
    parse_sentence,
    split_packet,
    tag_of,
)
from .navigation_sentences import NAVIGATION
from .sentence_values import Fields, Values
from .steering_sentences import STEERING
from .tag_groups import TagGroups
from .transducer_sentences import TRANSDUCERS, MotionUnit
from .twin_devices import CHECKED, TwinDevices
from .utc_fields import UTC_READERS

FieldDecoder = Callable[[Fields], Values]
_USUAL_TIME = "ZDA"  # other sentences' times of a talker have a source of their own
_LINES = 999  # a TAG block counts them from 1 to here, then from 1 again


@dataclass(frozen=True)
class DecodingOptions:
    """How sentences are decoded.

    Attributes
    ----------
    require_checksum
        Whether a sentence without a checksum is rejected.
    gnss_time
        Whether the time of measurement of a GNSS receiver's samples is the receiver's own.
    received_is_known
        Whether the times of the packets are those of reception, rather than derived from the
        sentences.
    """

    require_checksum: bool = True
    gnss_time: bool = False
    received_is_known: bool = True


class _Kind(NamedTuple):
    """How the sentences of one talker and formatter are decoded.

    Attributes
    ----------
    name
        The name under which they are counted.
    decode
        Decodes their fields; None where they are not decoded.
    read_utc
        Reads the time in them; None where they bear none.
    """

    name: str
    decode: FieldDecoder | None
    read_utc: Callable[[Fields], Utc | None] | None


class SentenceDecoder:
    """Decodes NMEA 0183 sentences; a `recorders.streams.decoder.Decoder`.

    Parameters
    ----------
    options
        How sentences are decoded.
    counts
        Counts of the stream, which earlier stages may have begun.

    Attributes
    ----------
    counts
        What was decoded, skipped and rejected so far.

    Examples
    --------
    >>> decoder, samples = SentenceDecoder(), SampleBuffer()
    >>> decoder.decode([Packet(b"$TIROT,-6.0,A*10", 10**18)], samples)
    >>> samples.take()[0]
    Channel(/yaw_rate/TI [rad/s], 1 samples)
    """

    def __init__(
        self, options: DecodingOptions | None = None, counts: StreamCounts | None = None
    ) -> None:
        self.counts = StreamCounts() if counts is None else counts
        self._options = options or DecodingOptions()
        self._decoders: Mapping[str, FieldDecoder] = (
            STEERING | NAVIGATION | ENVIRONMENT | TRANSDUCERS | {"PSXN": MotionUnit().decode}
        )
        self._kind = lru_cache(maxsize=MAX_KINDS)(self._find_kind)
        self._clock = GnssClock(
            self.counts.warn,
            is_applied=self._options.gnss_time,
            received_is_known=self._options.received_is_known,
            in_bursts=True,
            clock_kinds=("ZDA",),
        )
        self._twins = TwinDevices()
        self._groups = TagGroups()
        self._lines: dict[str, int] = {}  # the last line count by sender

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        """Decode a batch of lines or datagrams."""
        for data, received_ns, _ in batch:
            if is_sentence(data):
                self._decode_line(data, received_ns, samples)
                continue
            for line in split_packet(data) or [b""]:  # an empty datagram is counted
                self._decode_line(line, received_ns, samples)

    def finish(self, samples: SampleBuffer) -> None:  # noqa: ARG002 - of the protocol
        """Report the latencies of the receivers."""
        self._clock.finish()
        for text in self._twins.findings():
            self.counts.warn(text)
        for key, text in self._clock.notes():
            self.counts.note(key, text)

    def _decode_line(self, line: bytes, received_ns: int, samples: SampleBuffer) -> None:
        try:
            talker, formatter, fields, tag = parse_sentence(
                line, require_checksum=self._options.require_checksum
            )
        except FramingError as error:
            self.counts.reject(str(error))
            self._count_lost_lines(tag_of(line))
            return
        if tag.group is not None:
            tag = self._groups.complete(tag)
        kind = self._kind(talker, formatter)
        if tag.line is not None:
            self._count_lost_lines(tag)
        if kind.decode is None and kind.read_utc is None:
            self.counts.skip(kind.name)
            return
        source = f"{tag.source}.{talker}" if tag.source else talker
        time_ns = None
        try:
            values = kind.decode(fields) if kind.decode else ()
            if kind.read_utc is not None and (utc := kind.read_utc(fields)) is not None:
                time_ns = self._set_time((source, formatter), utc, received_ns, samples)
        except ValueError:
            self.counts.reject(f"malformed field of {formatter}")
            return
        if not values and time_ns is None:
            self.counts.skip(f"{kind.name} without a value")
            return
        self.counts.accept(kind.name)
        if self._options.gnss_time:
            add = partial(self._add, samples, (source, kind.name), values, received_ns)
            self._clock.write_measured(source, formatter, (received_ns, time_ns), add)
        else:
            self._add(samples, (source, kind.name), values, received_ns, received_ns)

    def _find_kind(self, talker: str, formatter: str) -> _Kind:
        """Return how sentences with this address are decoded."""
        name = talker if talker == formatter else talker + formatter
        decode = self._decoders.get(name) or self._decoders.get(formatter)
        return _Kind(name, decode, UTC_READERS.get(formatter))

    def _set_time(
        self,
        source_and_formatter: tuple[str, str],
        utc: Utc,
        received_ns: int,
        samples: SampleBuffer,
    ) -> int | None:
        """Return the time in a sentence, ns; one with a date is a sample of ``gnss_time``."""
        source, formatter = source_and_formatter
        time_ns = self._clock.set_time(source, formatter, utc, received_ns)
        if time_ns is not None and utc.day is not None:
            name = source if formatter == _USUAL_TIME else f"{source}.{formatter}"
            samples.add("gnss_time", name, time_ns * 1e-9, received_ns)
        return time_ns

    def _count_lost_lines(self, tag: TagBlock) -> None:
        """Count the lines that are missing between two line counts of a sender."""
        sender, line = tag.source, tag.line
        if line is None:
            return
        last = self._lines.get(sender)
        if last is None and len(self._lines) >= MAX_TOPICS:
            return
        self._lines[sender] = line
        if last is not None and line not in (last, 1) and (lost := (line - last - 1) % _LINES):
            self.counts.reject("lost before reception (TAG line counts)", lost)

    def _add(
        self,
        samples: SampleBuffer,
        source_and_kind: tuple[str, str],
        values: Values,
        received_ns: int,
        measured_ns: int,
    ) -> None:
        """Add the values of a sentence; flag it where one of them is invalid."""
        source, kind = source_and_kind
        valid = True
        for channel, value, suffix in values:
            topic = f"{source}.{suffix}" if suffix else source
            if isinstance(value, tuple):
                samples.add_position(topic, value, received_ns, measured_ns)
                valid &= not isnan(value[0])
            elif not samples.add(channel, topic, value, received_ns, measured_ns):
                continue  # one topic too many
            elif isnan(value):
                valid = False
            elif channel in CHECKED:
                self._twins.add(channel, topic, value)
        if not valid:
            self.counts.flag(kind)

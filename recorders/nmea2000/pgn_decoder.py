"""Decoder of NMEA 2000: frames, assembled to messages where they are parts, to samples."""

from collections.abc import Sequence
from functools import partial

from recorders.streams.counts import StreamCounts
from recorders.streams.gnss_clock import GnssClock, Utc
from recorders.streams.packets import Packet, packet_lines
from recorders.streams.sample_buffer import SampleBuffer

from .canboat_library import FrameError, fields, is_fast
from .fast_packets import FastPackets
from .line_formats import FRAME_BYTES, Frame, LineFormat, is_assembled, matching_format
from .pgns import DAY_SECS, READINGS, Reading

FAST_PGNS = frozenset(pgn for pgn in READINGS if is_fast(pgn))
ADDRESS_CLAIM = 60928
NULL_ADDRESS = 254  # of devices that have found no address
_OF_RECEIVERS = (129025, 129026, 129029)  # a gateway sends other sensors from the same address
_CLOCKS = (" 126992", " 129033")  # time without a fix


class PgnDecoder:
    """Samples of the messages that hold a channel; the source is the address of their sender.

    Only fast packets of these messages are assembled, so that what a hostile bus can make wait is
    bounded: 8 messages of 223 bytes for each address and PGN. Each line is counted once: of the
    frames of a fast packet the last one as the message, the others as parts of it.

    Parameters
    ----------
    line_format
        The format of the lines; None to take that of the first line which is of one.
    gnss_time
        Whether the time of measurement of a GNSS receiver's samples is the receiver's own.

    Attributes
    ----------
    line_format
        The format of the lines, or None while it is not known.
    """

    def __init__(self, line_format: LineFormat | None = None, *, gnss_time: bool = False) -> None:
        self._counts = StreamCounts()
        self.line_format = line_format
        self._assembled = line_format is not None and bool(line_format.assembled)
        self._fast_packets = FastPackets(self._counts)
        self._clock = GnssClock(self._warn, is_applied=gnss_time, clock_kinds=_CLOCKS)
        self._kinds: dict[tuple[int, int], str] = {}
        self._names: dict[int, bytes] = {}  # the NAMEs of devices by address (ISO 11783-5)
        self._bus: bytes | None = None
        self._has_other_bus = False

    @property
    def counts(self) -> StreamCounts:
        """What was decoded, skipped and rejected so far."""
        return self._counts

    def set_format(self, line_format: LineFormat, lines: Sequence[bytes]) -> None:
        """Set the format, and whether a line holds a whole message, from the first lines."""
        self.line_format = line_format
        self._assembled = (
            is_assembled(lines) if line_format.assembled is None else line_format.assembled
        )

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        """Decode lines; a datagram may hold several."""
        for packet in batch:
            for line in packet_lines(packet.data):
                self._decode_line(line, packet.received_ns, samples)

    def finish(self, samples: SampleBuffer) -> None:
        """Report the latencies of the receivers; reject the messages that are not complete."""
        del samples
        self._fast_packets.finish()
        self._clock.finish()
        for key, text in self._clock.notes():
            self._counts.note(key, text)

    def _decode_line(self, line: bytes, received_ns: int, samples: SampleBuffer) -> None:
        line_format = self.line_format
        if line_format is None:
            line_format = matching_format([line])
            if line_format is None:
                self._count_unknown(line)
                return
            self.set_format(line_format, [line])
        try:
            frame = line_format.frame(line)
            if frame is None:
                self._counts.skip("comment or status")
            elif not self._is_of_our_bus(frame, received_ns):
                self._counts.reject("frame of another bus")
            elif frame.pgn not in READINGS:
                self._counts.skip(str(frame.pgn))
                if frame.pgn == ADDRESS_CLAIM:
                    self._check_claim(frame, received_ns)
            elif (data := self._message(frame)) is not None:
                self._add(frame, data, received_ns, samples)
        except FrameError as error:
            self._counts.reject(str(error))

    def _count_unknown(self, line: bytes) -> None:
        """Count a line before the first one of a known format."""
        if line.startswith(b"#") or not line.strip():
            self._counts.skip("comment or status")
        else:
            self._counts.reject("line of no known format")

    def _is_of_our_bus(self, frame: Frame, received_ns: int) -> bool:
        """Whether a frame is of the bus of the first one: addresses repeat on another."""
        if self._bus is None:
            self._bus = frame.bus
        if frame.bus == self._bus:
            return True
        if not self._has_other_bus:
            self._has_other_bus = True
            self._counts.warn(
                f"frames of {frame.bus.decode()} beside those of {self._bus.decode()} are not "
                "recorded, as their addresses may be the same; record each bus apart",
                received_ns,
            )
        return False

    def _check_claim(self, frame: Frame, received_ns: int) -> None:
        """Warn where an address is claimed by another device than before."""
        if frame.source >= NULL_ADDRESS:
            return
        name = self._names.setdefault(frame.source, frame.data)
        if name != frame.data:
            self._names[frame.source] = frame.data
            self._warn(f"{frame.source} is that of another device from here on", received_ns)

    def _message(self, frame: Frame) -> bytes | None:
        """Return the data of the whole message, or None where frames of it are still missing."""
        if frame.pgn not in FAST_PGNS:
            return frame.data
        if len(frame.data) > FRAME_BYTES:
            self._assembled = True
        if self._assembled:
            return frame.data
        return self._fast_packets.push(frame.pgn, frame.source, frame.data)

    def _add(self, frame: Frame, data: bytes, received_ns: int, samples: SampleBuffer) -> None:
        """Add the samples of a message, those of a receiver as soon as their time is known."""
        values = fields(frame.pgn, data)
        readings = READINGS[frame.pgn](values) if values else []
        time_ns = self._gnss_time_ns(frame, readings, received_ns)
        if time_ns is not None:
            readings = [
                reading._replace(value=time_ns * 1e-9)
                if reading.channel == "gnss_time"
                else reading
                for reading in readings
            ]
        write = partial(self._write, frame, readings, samples, received_ns)
        if frame.pgn in _OF_RECEIVERS:
            self._clock.write_measured(
                str(frame.source), str(frame.pgn), (received_ns, time_ns), write
            )
        else:
            write(received_ns)

    def _write(
        self,
        frame: Frame,
        readings: Sequence[Reading],
        samples: SampleBuffer,
        received_ns: int,
        measured_ns: int,
    ) -> None:
        """Write what a message measures, and count the message."""
        added = 0
        for channel, value, part in readings:
            source = f"{frame.source}.{part}" if part else str(frame.source)
            if value is None:
                continue
            if isinstance(value, tuple):
                added += samples.add_position(source, value, received_ns, measured_ns)
            elif channel == "gnss_time":  # against its time of reception it shows the latency
                added += samples.add(channel, source, value, received_ns)
            else:
                added += samples.add(channel, source, value, received_ns, measured_ns)
        if added:
            self._counts.accept(self._kind(frame))
        else:
            self._counts.skip(f"{frame.pgn} without a value")

    def _gnss_time_ns(
        self, frame: Frame, readings: Sequence[Reading], received_ns: int
    ) -> int | None:
        """Return the time that a receiver states, ns, with a rollover of its week corrected."""
        secs = next((r.value for r in readings if r.channel == "gnss_time"), None)
        if not isinstance(secs, float):
            return None
        days, clock_secs = divmod(secs, DAY_SECS)
        utc = Utc(round(clock_secs * 1e4) * 10**5, int(days))  # in units of 0.1 ms
        return self._clock.set_time(str(frame.source), f" {frame.pgn}", utc, received_ns)

    def _warn(self, text: str, time_ns: int | None) -> None:
        """Keep a warning about a receiver, whose address it begins with."""
        self._counts.warn(f"address {text}", time_ns)

    def _kind(self, frame: Frame) -> str:
        """Return the text by which the messages of one sender and PGN are counted."""
        key = frame.source, frame.pgn
        if key not in self._kinds:
            self._kinds[key] = f"{frame.pgn} of {frame.source}"
        return self._kinds[key]

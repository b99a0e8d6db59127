"""A torquemeter that sends lines of a time, revolutions and torque, such as T12.5 N80 Q950."""

import argparse
import re
from collections.abc import Iterator, Sequence

from recorders.streams.counts import StreamCounts
from recorders.streams.format import OpenedFile, StreamFormat
from recorders.streams.packets import Batches, Packet
from recorders.streams.sample_buffer import SampleBuffer
from shiplog import UsageError

NUMBER = r"\d{1,9}\.?\d{0,6}"  # bounded: a long row of digits is infinite
LINE = re.compile(f"T({NUMBER}) N(-?{NUMBER}) Q(-?{NUMBER})".encode())  # s, rpm, kNm


class TorquemeterDecoder:
    """Decodes lines to the channels `rpm` and `torque`."""

    def __init__(self, shaft: str) -> None:
        self.counts = StreamCounts()
        self._shaft = shaft

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        for packet in batch:
            match = LINE.fullmatch(packet.data.strip())
            if match is None:
                self.counts.reject("not a line of the torquemeter")
                continue
            samples.add("rpm", self._shaft, float(match[2]), packet.received_ns)
            samples.add("torque", self._shaft, 1000 * float(match[3]), packet.received_ns)
            self.counts.accept("N Q")

    def finish(self, samples: SampleBuffer) -> None:
        """Add nothing: no line waits for a later one."""


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--shaft", default="shaft", help="the name of the shaft, as the source")


def _decoder(options: argparse.Namespace) -> TorquemeterDecoder:
    if not options.shaft.isalnum():
        raise UsageError(f"--shaft is a name of letters and digits, not {options.shaft!r}")
    return TorquemeterDecoder(options.shaft)


def _open_file(batches: Batches, options: argparse.Namespace) -> OpenedFile:
    return OpenedFile(_timed(batches), _decoder(options))


def _timed(batches: Batches) -> Iterator[list[Packet]]:
    """Give each line of a file its own time; a wrong line has that of the line before."""
    time_ns = 0
    for batch in batches:
        timed = []
        for packet in batch:
            match = LINE.match(packet.data)
            time_ns = round(float(match[1]) * 1e9) if match else time_ns
            timed.append(packet._replace(received_ns=time_ns))
        yield timed


TORQUEMETER = StreamFormat(
    "torquemeter", "lines of a torquemeter", _decoder, _open_file, configure=_configure
)

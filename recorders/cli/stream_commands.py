"""What `record` does with streams: one stream of a format, or all sources of a trial file."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path

from recorders.record import Recording, growing_file, record
from recorders.streams.format import StreamFormat
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_source import StreamSource
from recorders.trial.live_source import LiveSource
from recorders.trial.marks import MarkListener
from recorders.trial.open_source import (
    StreamRequest,
    open_streams,
    trial_metadata,
    trial_requests,
)
from recorders.trial.recorded_source import RecordedSource
from recorders.trial.stream_tables import stream_tables
from recorders.trial.trial_file import load_trial_file
from recorders.trial.undecoded import why_undecoded
from shiplog.cli.console import print_line, print_tables, print_warnings, progress
from shiplog.files import is_device
from shiplog.interrupts import stopped_by_signals
from shiplog.types import Event

from .live_display import MarkKey, Shown, live_display
from .output_options import RecordingOutput, recording_output


def configure_stream(parser: argparse.ArgumentParser, stream_format: StreamFormat) -> None:
    """Add the arguments of ``record FORMAT ADDRESS``."""
    from recorders.transports.address import FORMS

    parser.add_argument("address", metavar="ADDRESS", help=f"a file, or {FORMS}")
    parser.add_argument(
        "--raw",
        action=argparse.BooleanOptionalAction,
        help="record the packets beside the samples (default: of live sources only)",
    )
    parser.add_argument(
        "--pace",
        type=_factor,
        metavar="FACTOR",
        help="read a file FACTOR times as fast as it was received (default: as fast as possible)",
    )
    parser.add_argument("--vessel", metavar="FILE", help="the vessel file to keep in the log")
    stream_format.configure(parser)


def record_stream(
    arguments: argparse.Namespace, stream_format: StreamFormat, output: RecordingOutput
) -> Recording:
    """Record one stream of a format."""
    request = StreamRequest(
        stream_format.name,
        stream_format,
        arguments.address,
        arguments,
        arguments.raw,
        pace=arguments.pace,
    )
    return _record([request], output, {}, arguments.vessel)


def record_trial(arguments: argparse.Namespace) -> Recording:
    """Record the sources of a trial file."""
    trial = load_trial_file(arguments.trial)
    output = recording_output(arguments, trial)
    return _record(trial_requests(trial), output, trial_metadata(trial), trial.vessel)


def _record(
    requests: Sequence[StreamRequest],
    output: RecordingOutput,
    metadata: dict[str, str],
    vessel: str | None,
) -> Recording:
    vessel_toml = _vessel_text(vessel)
    clock = ReceptionClock()
    marks = _Marks(clock)
    source = open_streams(
        requests, clock, metadata=metadata, vessel_toml=vessel_toml, take_marks=marks.take
    )
    if isinstance(source, LiveSource):
        source.flush_secs = output.flush_secs
    with _shown(source, output, marks) as on_chunk:
        recording = record(
            source,
            output.log,
            rotation=output.rotation,
            overwrites=not isinstance(source, LiveSource),  # a trial is not repeated for a log
            sync_secs=output.sync_secs,
            on_chunk=on_chunk,
        )
    streams = _streams(source)
    print_tables(stream_tables(streams), to_stderr=is_device(output.log))
    print_warnings([text for stream in streams for text in stream.decoder.counts.warnings])
    if isinstance(source, LiveSource):
        print_warnings(
            [
                f"no sample could be decoded from {stream.name}: {why_undecoded(counts)}"
                for stream in streams
                if not (counts := stream.decoder.counts).accepted
            ]
        )
    return replace(recording, dropped=source.dropped if isinstance(source, LiveSource) else 0)


class _Marks:
    """Marks of a live recording, from its own terminal and from others."""

    def __init__(self, clock: ReceptionClock) -> None:
        self._clock = clock
        self._listener: MarkListener | None = None
        self.key = MarkKey(clock.now_ns)

    def take(self) -> list[Event]:
        """Return the marks since the last call."""
        return [*self.key.take(), *(self._listener.take() if self._listener else ())]

    @contextmanager
    def listening(self, log: Path) -> Iterator[None]:
        """Take marks within the block.

        Where there is no place for marks from other terminals, the recording goes on without.
        """
        try:
            self._listener = MarkListener(log, self._clock)
        except OSError as error:
            reason = error.strerror or error
            print_warnings([f"`shiplog mark` cannot reach this recording ({reason}); use the key"])
        try:
            with self.key.listening():
                yield
        finally:
            if self._listener is not None:
                self._listener.close()


@contextmanager
def _shown(
    source: LiveSource | RecordedSource, output: RecordingOutput, marks: _Marks
) -> Iterator[Callable[[int], None]]:
    """Show the status of a live source, which signals end, or the progress of a recorded one."""
    if isinstance(source, LiveSource):
        log = output.log
        shown = Shown(source, log, partial(growing_file, log, output.rotation))
        with (
            marks.listening(log),
            stopped_by_signals(source.stop),
            live_display(shown) as on_chunk,
        ):
            print_line(f"recording to {log}; Ctrl-C ends it", to_stderr=True)
            yield on_chunk
    else:
        with progress() as on_progress:
            yield lambda samples: on_progress(f"decode: {samples} samples")


def _streams(source: LiveSource | RecordedSource) -> list[StreamSource]:
    if isinstance(source, LiveSource):
        return [each.stream for each in source.inputs]
    return list(source.streams)


def _factor(text: str) -> float:
    value = float(text)
    if not 0 < value < inf:
        raise argparse.ArgumentTypeError(f"{text} is no positive number")
    return value


def _vessel_text(vessel: str | None) -> str | None:
    if vessel is None:
        return None
    from shiplog.vessel.vessel_parser import load_vessel

    return load_vessel(vessel)[1]

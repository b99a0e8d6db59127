"""Dry run of a recording: listen for a while, and report what is heard and what is missing."""

import argparse
import threading
from collections.abc import Sequence

from recorders.streams.format import StreamFormat
from recorders.streams.reception_clock import ReceptionClock
from recorders.trial.live_source import LiveInput, LiveSource
from recorders.trial.open_source import (
    StreamRequest,
    open_streams,
    trial_requests,
)
from recorders.trial.stream_tables import stream_tables
from recorders.trial.trial_file import load_trial_file
from recorders.trial.undecoded import why_undecoded
from shiplog.cli.console import print_line, print_tables
from shiplog.cli.verb import ExitCode
from shiplog.errors import UsageError
from shiplog.interrupts import stopped_by_signals
from shiplog.text_table import TextTable

from .live_display import rate_in_words, value_in_words


def listen_to_trial(path: str, secs: float) -> ExitCode:
    """Listen to the sources of a trial file; fails where a needed channel is missing."""
    return _listen(trial_requests(load_trial_file(path)), secs)


def listen_to_stream(
    arguments: argparse.Namespace, stream_format: StreamFormat, secs: float
) -> ExitCode:
    """Listen to one stream; fails where a needed channel is missing."""
    request = StreamRequest(stream_format.name, stream_format, arguments.address, arguments)
    return _listen([request], secs)


def _listen(requests: Sequence[StreamRequest], secs: float) -> ExitCode:
    source = open_streams(requests, ReceptionClock())
    if not isinstance(source, LiveSource):
        raise UsageError("--dry-run listens to live sources; of a file, record it and see its info")
    print_line(f"listening for {secs:.0f} s", to_stderr=True)
    timer = threading.Timer(secs, source.stop)
    timer.daemon = True  # a second Ctrl-C ends the process at once
    timer.start()
    with stopped_by_signals(source.stop):
        for _ in source.chunks():
            pass
    timer.cancel()
    channels = _channel_table(source)
    print_tables([_state_table(source), *([channels] if channels.rows else [])])
    print_tables(stream_tables(each.stream for each in source.inputs))
    silent = [each.stream for each in source.inputs if not _heard(each)]
    missing = source.status.missing
    for stream in silent:
        print_line(f"nothing decoded from {stream.name}: {why_undecoded(stream.decoder.counts)}")
    if missing:
        print_line(f"missing for a replay: {', '.join(missing)}")
    else:
        print_line("all channels that a replay needs are heard")
    return ExitCode.FAILURE if silent or missing else ExitCode.OK


def _heard(each: LiveInput) -> int:
    """Return the number of packets that were decoded."""
    return sum(each.stream.decoder.counts.accepted.values())


def _state_table(source: LiveSource) -> TextTable:
    rows = []
    for each in source.inputs:
        counts = each.stream.decoder.counts
        rows.append(
            (
                each.stream.name,
                str(_heard(each)),
                str(sum(counts.unused.values())),
                str(sum(counts.rejected.values())),
                f"{each.stream.origin}: {each.live.fault or 'open'}",
            )
        )
    columns = ("stream", "decoded", "not used", "rejected", "address and state")
    return TextTable("Streams", columns, tuple(rows), has_prose=True)


def _channel_table(source: LiveSource) -> TextTable:
    rows = tuple(
        (channel.topic, rate_in_words(channel), value_in_words(channel), str(channel.samples))
        for channel in source.status.channels
    )
    return TextTable("Channels", ("channel", "rate", "last value", "samples"), rows)

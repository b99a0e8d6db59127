"""Sources opened as a command line or a trial file describes them."""

import argparse
import os
import re
import stat
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from recorders.streams.format import StreamFormat
from recorders.streams.line_files import peek, read_lines
from recorders.streams.pace import paced
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_options import options_text
from recorders.streams.stream_source import StreamSource
from recorders.transports.address import is_live, open_transport
from recorders.transports.live_stream import LiveStream
from recorders.transports.transport import Transport
from shiplog.errors import LogError, ShiplogError, UsageError
from shiplog.types import Event

from .conditions import condition_metadata
from .live_source import LiveInput, LiveSource, waiting_packets
from .recorded_source import RecordedSource
from .trial_file import SourceEntry, TrialFile


@dataclass(frozen=True)
class StreamRequest:
    """One stream that is to be recorded.

    Attributes
    ----------
    name
        Its name, for its raw topic and its events.
    format
        The format of its packets.
    address
        The address of a live transport, or the path of a file; ``-`` is the standard input.
    options
        The parsed options of the format.
    keep_raw
        Whether to record the packets; None for live streams only.
    prefix
        Put before the source of its topics.
    pace
        How many times faster than it was received a recorded stream is let through; None for as
        fast as possible.
    """

    name: str
    format: StreamFormat
    address: str
    options: argparse.Namespace
    keep_raw: bool | None = None
    prefix: str = ""
    pace: float | None = None


def open_streams(
    requests: Sequence[StreamRequest],
    clock: ReceptionClock,
    *,
    metadata: dict[str, str] | None = None,
    vessel_toml: str | None = None,
    take_marks: Callable[[], Sequence[Event]] = tuple,
) -> LiveSource | RecordedSource:
    """Open streams, all of them live or all recorded, as one source.

    Parameters
    ----------
    requests
        At least one stream.
    clock
        The clock of reception of live streams.
    metadata
        Text about the trial, by key.
    vessel_toml
        The text of the vessel file to keep in the log, or None.
    take_marks
        Returns the events that a person has marked in a live recording since the last call.

    Raises
    ------
    UsageError
        An address is wrong, live and recorded streams are mixed, or two streams read the standard
        input.
    LogError
        A file is missing.
    """
    transports = _transports(requests, clock)
    live = [transport for transport in transports if transport is not None]
    if live and len(live) < len(requests):
        files = [r.address for r, t in zip(requests, transports, strict=True) if t is None]
        raise UsageError(
            f"live and recorded sources in one recording have no common time; record the files "
            f"apart: {', '.join(files)}"
        )
    if live:
        inputs = [_live(r, t, clock) for r, t in zip(requests, live, strict=True)]
        return LiveSource(inputs, clock, metadata or {}, vessel_toml, take_marks)
    return RecordedSource([_recorded(r) for r in requests], metadata or {}, vessel_toml)


def trial_requests(trial: TrialFile) -> list[StreamRequest]:
    """Return the streams of a trial file; paths are relative to the file."""
    return [_request(entry, trial.path.parent) for entry in trial.sources]


def trial_metadata(trial: TrialFile) -> dict[str, str]:
    """Return the metadata that a trial file gives its log: its name and the conditions."""
    return {"trial_file": trial.path.name} | condition_metadata(trial.conditions)


def _request(entry: SourceEntry, folder: Path) -> StreamRequest:
    address = entry.address
    own = entry.format.open_transport(address, ReceptionClock()) is not None
    if not own and not is_live(address) and address != "-":
        address = os.fspath(folder / address)
    options = argparse.Namespace()
    for key, value in vars(entry.options).items():
        setattr(options, key, folder / value if isinstance(value, Path) else value)
    return StreamRequest(
        entry.name, entry.format, address, options, entry.keep_raw, f"{entry.name}."
    )


def _transports(requests: Sequence[StreamRequest], clock: ReceptionClock) -> list[Transport | None]:
    """Return the transports of all streams, or raise what is wrong with any of them."""
    if sum(request.address == "-" for request in requests) > 1:
        raise UsageError("two sources read the standard input, which one can; give one an address")
    transports, errors = [], list[ShiplogError]()
    for request in requests:
        try:
            transports.append(_transport(request, clock))
        except ShiplogError as error:
            errors.append(error)
    if len(errors) > 1:
        raise UsageError("; ".join(map(str, errors)))
    if errors:
        raise errors[0]
    return transports


def _transport(request: StreamRequest, clock: ReceptionClock) -> Transport | None:
    """Return the live transport of a stream, not opened yet; None for a recorded stream."""
    address = request.address
    if own := request.format.open_transport(address, clock):
        return own
    if is_live(address) or (address == "-" and not _is_recording(sys.stdin.fileno())):
        return open_transport(address, clock)
    if address != "-" and not Path(address).is_file():
        raise LogError(f"no such file: {address}{_address_hint(address)}")
    return None


def _address_hint(address: str) -> str:
    """Return the address that is probably meant by the name of a device."""
    if address.startswith("/dev/") or re.fullmatch(r"COM\d+", address):
        return f"; a serial port is serial://{address}"
    if re.fullmatch(r"v?can\d+", address):
        return "; a CAN bus is read by `shiplog record nmea2000`"
    return ""


def _is_recording(descriptor: int) -> bool:
    """Whether a file descriptor is a file, which was recorded before, and not a pipe."""
    return stat.S_ISREG(os.fstat(descriptor).st_mode)


def _live(request: StreamRequest, transport: Transport, clock: ReceptionClock) -> LiveInput:
    live = LiveStream(transport, clock, request.name)
    stream = StreamSource(
        request.name,
        request.format.name,
        waiting_packets(live),
        request.format.make_decoder(request.options),
        keep_raw=request.keep_raw is not False,
        origin=transport.address,
        prefix=request.prefix,
        options=options_text(request.format, request.options),
    )
    return LiveInput(live, stream)


def _recorded(request: StreamRequest) -> StreamSource:
    _, lines = peek(read_lines(request.address), 1)  # where it cannot be read, the error names it
    try:
        opened = request.format.open_file(lines, request.options)
    except LogError as error:
        raise LogError(f"{error}: {request.address}") from error
    batches = opened.batches if request.pace is None else paced(opened.batches, request.pace)
    return StreamSource(
        request.name,
        request.format.name,
        batches,
        opened.decoder,
        keep_raw=request.keep_raw is True,
        origin=Path(request.address).name,
        prefix=request.prefix,
        options=options_text(request.format, request.options),
    )

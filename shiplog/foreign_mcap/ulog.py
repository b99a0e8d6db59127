"""ULog files of PX4, copied to MCAP files with JSON messages, whose topics a layout describes."""

import json
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shiplog.errors import LayoutError, LogError, ShiplogError, UsageError
from shiplog.layouts.field_paths import parse_path

if TYPE_CHECKING:
    from mcap.writer import Writer

SUFFIX = ".ulg"
QUATERNION_FIELD, QUATERNION_PARTS = "q", ("w", "x", "y", "z")  # an array in PX4, in this order
GNSS_TOPICS = ("sensor_gps", "vehicle_gps_position")
GNSS_TIME = "time_utc_usec"
UNKNOWN_START_NS = 946_684_800 * 10**9  # 2000-01-01, of a file without GNSS time


def is_ulog(path: Path) -> bool:
    """Return whether a file is a ULog file, by its name."""
    return path.suffix.lower() == SUFFIX


@dataclass(frozen=True)
class UlogCopy:
    """A temporary MCAP file with the topics of a ULog file.

    Attributes
    ----------
    path
        The MCAP file; its name is that of the ULog file.
    warnings
        What was found in reading the ULog file, each in a sentence.
    data_lost
        Whether a part of it could not be read, or the logger had dropped messages.
    """

    path: Path
    warnings: tuple[str, ...] = ()
    data_lost: bool = False


@contextmanager
def ulog_as_mcap(path: Path) -> Iterator[UlogCopy]:
    """Copy a ULog file to a temporary MCAP file, which exists while the context lasts.

    A topic is ``/name``, of a further instance ``/name/1``. A message has the fields of the topic,
    a quaternion with its parts ``q.w`` to ``q.z``. Times are those since boot, shifted to UTC by
    the time of the GNSS receiver; the time of measurement is ``timestamp_sample`` where a topic has
    it. An error within the context names the ULog file in place of the temporary one.

    Raises
    ------
    UsageError
        The package pyulog is not installed.
    LogError
        The file cannot be read, is not ULog, or has no messages.
    ShiplogError
        The temporary file cannot be written.

    References
    ----------
    ULog file format, docs.px4.io, "ULog File Format".
    """
    ulog, notes = _read(path)
    start_ns, warnings = _boot_time(ulog, path)
    warnings += _damage(ulog, notes, path)
    with ExitStack() as stack:
        try:
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="shiplog-"))
            copy = Path(folder) / path.name
            _write_copy(copy, ulog, start_ns)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise ShiplogError(
                f"cannot write a temporary copy: {reason}; make room for it, or set TMPDIR to "
                f"another folder: {path}"
            ) from error
        lost = bool(ulog.file_corruption or ulog.dropouts)
        try:
            yield UlogCopy(copy, tuple(warnings), lost)
        except (LogError, LayoutError) as error:
            raise type(error)(str(error).replace(os.fspath(copy), os.fspath(path))) from error


def _read(path: Path) -> tuple[Any, str]:
    """Return the file as pyulog reads it, and what that prints."""
    try:
        from pyulog import ULog  # noqa: PLC0415 - an optional dependency
    except ImportError as error:
        raise UsageError(
            f"ULog files need pyulog, which is not installed; pip install 'shiplog[ulog]': {path}"
        ) from error
    printed = StringIO()
    try:
        with path.open("rb") as stream, redirect_stdout(printed):
            ulog = ULog(stream)
    except OSError as error:
        raise LogError(f"cannot read: {(error.strerror or str(error)).lower()}: {path}") from error
    except Exception as error:  # pyulog has no common exception for damaged files
        raise LogError(f"not a ULog file ({error}); check what wrote it: {path}") from error
    if not any(len(dataset.data["timestamp"]) for dataset in ulog.data_list):
        raise LogError(f"no messages in it; log again: {path}")
    return ulog, printed.getvalue()


def _boot_time(ulog: Any, path: Path) -> tuple[int, list[str]]:  # noqa: ANN401 - untyped library
    """Return the instant of boot, ns since 1970, and a warning where the file does not have it."""
    for dataset in ulog.data_list:
        if dataset.name in GNSS_TOPICS and GNSS_TIME in dataset.data:
            utc = dataset.data[GNSS_TIME].astype(np.int64)
            since_boot = dataset.data["timestamp"].astype(np.int64)
            if np.any(utc > 0):
                return int(np.median((utc - since_boot)[utc > 0])) * 1000, []
    warning = (
        f"{path.name}: no time of a GNSS receiver in it; its times count from boot, which is taken "
        "to be at 2000-01-01 00:00 UTC"
    )
    return UNKNOWN_START_NS, [warning]


def _damage(ulog: Any, notes: str, path: Path) -> list[str]:  # noqa: ANN401 - untyped library
    """Return the warnings about damage and dropouts."""
    warnings = []
    if ulog.file_corruption:
        first = notes.strip().splitlines()[:1]
        warnings.append(
            f"{path.name}: damaged, messages were lost{f' ({first[0]:.120})' if first else ''}"
        )
    if ulog.dropouts:
        secs = sum(dropout.duration for dropout in ulog.dropouts) * 1e-3
        warnings.append(
            f"{path.name}: the logger dropped messages {len(ulog.dropouts)} times, for {secs:.1f} "
            "s in all; use a faster card or log fewer topics"
        )
    return warnings


def _write_copy(copy: Path, ulog: Any, start_ns: int) -> None:  # noqa: ANN401 - untyped library
    """Write the topics of a ULog file to an MCAP file."""
    from mcap.writer import Writer  # noqa: PLC0415 - of no other log

    with copy.open("wb") as stream:
        writer = Writer(stream)
        writer.start(library="shiplog")
        for dataset in ulog.data_list:
            _write_topic(writer, dataset, start_ns)
        writer.finish()  # type: ignore[no-untyped-call]


def _write_topic(writer: "Writer", dataset: Any, start_ns: int) -> None:  # noqa: ANN401
    """Write the messages of one topic; its times are those of the records."""
    schema_id = writer.register_schema(dataset.name, "jsonschema", b'{"type": "object"}')
    instance = f"/{dataset.multi_id}" if dataset.multi_id else ""
    channel_id = writer.register_channel(f"/{dataset.name}{instance}", "json", schema_id)
    columns = {name: values.tolist() for name, values in dataset.data.items()}
    logged = columns.pop("timestamp")
    sampled = columns.pop("timestamp_sample", logged)
    paths = [_steps(name) for name in columns]
    for i, row in enumerate(zip(*columns.values(), strict=True)):
        message: dict[str, Any] = {}
        for steps, value in zip(paths, row, strict=True):
            _put(message, steps, value)
        received_ns = start_ns + logged[i] * 1000
        measured_ns = start_ns + (sampled[i] or logged[i]) * 1000
        writer.add_message(channel_id, received_ns, json.dumps(message).encode(), measured_ns)


def _steps(name: str) -> tuple[str | int, ...]:
    """Return the steps to a field of pyulog, such as ``esc[0].esc_rpm``."""
    steps = parse_path(name) or (name,)
    if len(steps) == 2 and steps[0] == QUATERNION_FIELD and steps[1] in range(4):
        return QUATERNION_FIELD, QUATERNION_PARTS[int(steps[1])]
    return steps


def _put(message: dict[str, Any], steps: Sequence[str | int], value: object) -> None:
    """Put a value into a message of nested objects and arrays; the arrays grow in order."""
    place: Any = message
    for step, following in zip(steps, (*steps[1:], None), strict=True):
        inner: Any = value
        if following is not None:
            inner = [] if isinstance(following, int) else {}
        if isinstance(place, list):
            if step == len(place):
                place.append(inner)
        else:
            place.setdefault(step, inner)
        place = place[step]

"""Samples to MCAP: streaming, and safe against a crash up to the last flush."""

import os
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Self

from mcap.writer import CompressionType, Writer

from . import __version__
from .files import cannot_write, replacing
from .schema import (
    ENCODING,
    FORMAT_VERSION,
    GEOGRAPHIC,
    METADATA_NAME,
    VESSEL_ATTACHMENT,
    encode,
    schema_for,
)
from .types import Channel, TrialLog
from .units import CATALOGUE, factor

CHUNK_BYTES = 1 << 20  # what a crash between two flushes can lose


class LogWriter:
    """An open log, to which samples are added as they come; `close` makes it a finished file.

    A process killed in between leaves a file that still reads up to the last `flush`.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        metadata: Mapping[str, str] | None = None,
        vessel_toml: str | None = None,
    ) -> None:
        try:
            self._stream = Path(path).open("wb")  # noqa: SIM115 - closed by `close`
        except OSError as error:
            raise cannot_write(Path(path), error) from error
        self._writer = Writer(
            self._stream, CHUNK_BYTES, CompressionType.ZSTD, enable_data_crcs=True
        )
        self._writer.start(profile="", library=f"shiplog {__version__} mcap {version('mcap')}")
        self._writer.add_metadata(
            METADATA_NAME,
            dict(metadata or {})
            | {"format_version": FORMAT_VERSION, "written_by": f"shiplog {__version__}"},
        )
        if vessel_toml is not None:
            self._writer.add_attachment(
                0, 0, VESSEL_ATTACHMENT, "application/toml", vessel_toml.encode()
            )
        self._schema_ids: dict[str, int] = {}
        self._channel_ids: dict[str, int] = {}
        self._sequences: dict[str, int] = {}

    def __enter__(self) -> Self:
        """The open log."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the log."""
        self.close()

    def write(self, *slabs: Channel) -> None:
        """Add the slabs' samples, interleaved in the order in which they were received.

        Raises `UsageError` where a slab's unit does not measure what its name says.
        """
        messages = []
        for slab in slabs:
            channel_id, first = self._register(slab), self._sequences[slab.topic]
            self._sequences[slab.topic] += len(slab)
            received, measured = slab.received_ns.tolist(), slab.measured_ns.tolist()
            for i, data in enumerate(encode(slab)):
                messages.append((received[i], channel_id, first + i, measured[i], data))
        messages.sort(key=lambda message: message[0])
        for received_ns, channel_id, sequence, measured_ns, data in messages:
            self._writer.add_message(channel_id, received_ns, data, measured_ns, sequence)

    @property
    def samples(self) -> int:
        """How many were added so far."""
        return sum(self._sequences.values())

    def flush(self) -> None:
        """Hand what was written to the operating system: a killed process loses it no more."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Write the index and close the file."""
        if not self._stream.closed:
            with self._stream:
                self._writer.finish()  # type: ignore[no-untyped-call]

    def _register(self, slab: Channel) -> int:
        if slab.topic not in self._channel_ids:
            if slab.name in CATALOGUE and slab.fields != GEOGRAPHIC:
                factor(slab.unit, CATALOGUE[slab.name].unit)  # refused now, not when it is read
            schema = schema_for(slab.fields)
            if schema.name not in self._schema_ids:
                self._schema_ids[schema.name] = self._writer.register_schema(
                    schema.name, ENCODING, schema.descriptor_set
                )
            self._channel_ids[slab.topic] = self._writer.register_channel(
                slab.topic, ENCODING, self._schema_ids[schema.name], channel_metadata(slab)
            )
            self._sequences[slab.topic] = 0
        return self._channel_ids[slab.topic]


def write(log: TrialLog, path: str | os.PathLike[str]) -> None:
    """Write a whole trial to `path`; nothing half-written is left there if it fails."""
    with (
        replacing(path) as part,
        LogWriter(part, metadata=log.metadata, vessel_toml=log.vessel_toml) as writer,
    ):
        writer.write(*log.channels)


def channel_metadata(channel: Channel) -> dict[str, str]:
    """What the file says of a channel: its unit, its sign, its name and its source."""
    said = {"channel": channel.name, "source": channel.source, "unit": channel.unit}
    if channel.name in CATALOGUE:
        said["positive"] = CATALOGUE[channel.name].positive
    return dict(channel.metadata) | said

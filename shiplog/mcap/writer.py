"""Writing of logs: whole trials, and samples as they are recorded."""

import os
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from types import TracebackType
from typing import Self

from mcap import records

from shiplog.files import atomic_write
from shiplog.types import Channel, TrialLog, concatenate_channels
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor
from shiplog.version import __version__

from .encode import SampleBatch, encode_mcap_chunks
from .record_writer import McapRecordWriter
from .schema import ENCODING, FORMAT_VERSION, METADATA_NAME, VESSEL_ATTACHMENT, schema_for

MAX_MCAP_CHUNK_BYTES = 1 << 20  # a crash loses at most about as much since the last flush
_PENDING_SAMPLES = MAX_MCAP_CHUNK_BYTES // 40  # about an MCAP chunk: a scalar takes 40 bytes


class LogWriter:
    """An open log to which samples are appended as they come; `close` makes it a complete file.

    If the process is killed, the file can be read up to the last `flush`. A `LogWriter` is a
    context manager that closes the log.

    Parameters
    ----------
    path
        The MCAP file; it is overwritten.
    metadata
        Text about the trial, by key.
    vessel_toml
        The text of a vessel file to attach.

    Raises
    ------
    ShiplogError
        The file cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from shiplog import read
    >>> times = np.array([0, 100_000_000])
    >>> with TemporaryDirectory() as folder:
    ...     with LogWriter(f"{folder}/trial.mcap", metadata={"place": "Neva"}) as writer:
    ...         writer.write(Channel("rudder", "feedback", "rad", times, times, np.zeros(2)))
    ...     read(f"{folder}/trial.mcap")["rudder"]
    Channel(/rudder/feedback [rad], 2 samples)
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        metadata: Mapping[str, str] | None = None,
        vessel_toml: str | None = None,
    ) -> None:
        self._file = McapRecordWriter(path)
        self._schema_ids: dict[str, int] = {}  # by name
        self._channel_ids: dict[str, int] = {}  # by topic
        self._counts: dict[int, int] = {}  # of samples, by channel id
        self._pending: list[SampleBatch] = []
        versions = {"format_version": FORMAT_VERSION, "written_by": f"shiplog {__version__}"}
        self._file.write_metadata(METADATA_NAME, dict(metadata or {}) | versions)
        if vessel_toml is not None:
            content = vessel_toml.encode()
            self._file.write_attachment(VESSEL_ATTACHMENT, "application/toml", content)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def samples(self) -> int:
        """The number of samples written so far."""
        return sum(self._counts.values())

    def write(self, *channels: Channel) -> None:
        """Append samples, interleaved in the order of reception.

        Parameters
        ----------
        channels
            The next samples of each channel. The first of a topic fixes its unit, fields and
            metadata.

        Raises
        ------
        UsageError
            The unit of a known channel does not measure its quantity.
        """
        for channel in channels:
            channel_id = self._register(channel)
            self._pending.append(SampleBatch(channel_id, self._counts[channel_id], channel))
            self._counts[channel_id] += len(channel)
        if sum(len(batch.samples) for batch in self._pending) >= _PENDING_SAMPLES:
            self._write_pending()

    def flush(self) -> None:
        """Hand all samples to the operating system, so that a killed process does not lose them."""
        self._write_pending()
        self._file.flush()

    def close(self) -> None:
        """Write the summary and close the file; a second call has no effect."""
        if not self._file.closed:
            with closing(self._file):
                self._write_pending()
                self._file.finish(self._counts)

    def _register(self, channel: Channel) -> int:
        """Return the id of a channel, and describe the channel when it is new."""
        if channel.topic not in self._channel_ids:
            if channel.name in CATALOGUE and channel.fields != GEOGRAPHIC:
                conversion_factor(channel.unit, CATALOGUE[channel.name].unit)  # reject bad units
            channel_id = len(self._channel_ids) + 1
            self._file.add_channel(
                records.Channel(
                    id=channel_id,
                    topic=channel.topic,
                    message_encoding=ENCODING,
                    metadata=channel_metadata(channel),
                    schema_id=self._register_schema(channel.fields),
                )
            )
            self._channel_ids[channel.topic] = channel_id
            self._counts[channel_id] = 0
        return self._channel_ids[channel.topic]

    def _register_schema(self, fields: tuple[str, ...]) -> int:
        from .messages import descriptor_set  # noqa: PLC0415 - protobuf takes long to import

        schema = schema_for(fields)
        if schema.name not in self._schema_ids:
            schema_id = len(self._schema_ids) + 1
            record = records.Schema(
                id=schema_id, name=schema.name, encoding=ENCODING, data=descriptor_set(schema)
            )
            self._file.add_schema(record)
            self._schema_ids[schema.name] = schema_id
        return self._schema_ids[schema.name]

    def _write_pending(self) -> None:
        batches, self._pending = _one_batch_per_channel(self._pending), []
        if batches:
            for mcap_chunk in encode_mcap_chunks(batches, MAX_MCAP_CHUNK_BYTES):
                self._file.write_mcap_chunk(mcap_chunk)


def write(log: TrialLog, path: str | os.PathLike[str]) -> None:
    """Write a whole trial to an MCAP file.

    Parameters
    ----------
    log
        The trial.
    path
        The file. It appears only when it is complete; until then an existing one is kept.

    Raises
    ------
    ShiplogError
        The file cannot be written.
    UsageError
        The unit of a known channel does not measure its quantity.
    """
    with (
        atomic_write(path) as part,
        LogWriter(part, metadata=log.metadata, vessel_toml=log.vessel_toml) as writer,
    ):
        writer.write(*log.channels)


def channel_metadata(channel: Channel) -> dict[str, str]:
    """Return the metadata of a channel in the file: its name, source, unit and sign convention."""
    metadata = {"channel": channel.name, "source": channel.source, "unit": channel.unit}
    if channel.name in CATALOGUE:
        metadata["positive"] = CATALOGUE[channel.name].positive
    return dict(channel.metadata) | metadata


def _one_batch_per_channel(batches: Sequence[SampleBatch]) -> list[SampleBatch]:
    """Join the consecutive batches of each channel."""
    by_channel: dict[int, list[SampleBatch]] = {}
    for batch in batches:
        if len(batch.samples):
            by_channel.setdefault(batch.channel_id, []).append(batch)
    return [
        replace(group[0], samples=concatenate_channels([batch.samples for batch in group]))
        for group in by_channel.values()
    ]

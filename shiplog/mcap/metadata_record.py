"""Metadata records of shiplog, with a checksum, which MCAP has for other records only."""

import zlib
from collections.abc import Mapping
from io import BytesIO

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from .record_structure import content_size
from .schema import METADATA_NAME

CHECKSUM_KEY = "crc32"  # of the other entries of the record


def with_checksum(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of a metadata record of shiplog, completed by their checksum.

    Examples
    --------
    >>> with_checksum({"place": "Neva"})
    {'place': 'Neva', 'crc32': '104a6dcc'}
    """
    return {**metadata, CHECKSUM_KEY: _checksum(metadata)}


def read_metadata(content: bytes) -> records.Metadata:
    """Read a metadata record, and verify its checksum if it has one.

    Parameters
    ----------
    content
        The content of the record. The checksum is not part of the result.

    Raises
    ------
    ValueError
        The record is damaged.
    """
    if content_size(Opcode.METADATA, content) is None:
        raise ValueError("metadata whose fields are longer than their record")
    record: records.Metadata = records.Metadata.read(ReadDataStream(BytesIO(content)))
    if record.name == METADATA_NAME:
        recorded = record.metadata.pop(CHECKSUM_KEY, None)
        if recorded not in {None, _checksum(record.metadata)}:
            raise ValueError("metadata whose checksum is wrong")
    return record


def metadata_is_intact(content: bytes) -> bool:
    """Whether a metadata record can be read, and its checksum, if it has one, is right."""
    try:
        read_metadata(content)
    except (ValueError, McapError):
        return False
    return True


def _checksum(metadata: Mapping[str, str]) -> str:
    parts = [part for entry in metadata.items() for part in entry]
    data = b"".join(f"{len(part)}:{part}".encode() for part in parts)
    return f"{zlib.crc32(data):08x}"

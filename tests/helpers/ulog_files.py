"""Small ULog files, written by the description of the format, without a library."""

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

FORMATS = {"uint64_t": "Q", "float": "f", "double": "d", "uint8_t": "B", "int32_t": "i"}
Topic = tuple[str, Sequence[str], Sequence[Sequence[float]]]  # name, fields, rows


def write_ulog(path: Path, topics: Sequence[Topic], instances: Mapping[int, int] = {}) -> Path:
    """Write topics to a ULog file.

    Parameters
    ----------
    path
        The file.
    topics
        Name, fields such as ``float[4] q`` and rows of values; the first field is
        ``uint64_t timestamp``.
    instances
        The instance of a topic, by its number in `topics`; by default 0.
    """
    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    data += _message("B", bytes(40))
    for name, fields, _ in {name: (name, fields, ()) for name, fields, _ in topics}.values():
        data += _message("F", f"{name}:{';'.join(fields)};".encode())
    for number, (name, _, _) in enumerate(topics):
        head = struct.pack("<BH", instances.get(number, 0), number)
        data += _message("A", head + name.encode())
    for number, (_, fields, rows) in enumerate(topics):
        layout = "<" + "".join(map(_format, fields))
        for row in rows:
            data += _message("D", struct.pack("<H", number) + struct.pack(layout, *row))
    path.write_bytes(data)
    return path


def _format(field: str) -> str:
    kind, _, count = field.split(maxsplit=1)[0].rstrip("]").partition("[")
    return FORMATS[kind] * int(count or 1)


def _message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content

"""The library nmea2000: PGNs, and the fields of messages in SI units.

Its decoder for lines stamps some formats with the time of decoding and drops what it cannot read
without a count, so that only its parts below the lines are used. They are in private modules: the
dependency is pinned to one year's releases, and the tests compare with its public decoder.
"""

from collections.abc import Mapping

from shiplog.errors import UsageError

try:
    from nmea2000 import _canboat, backend
except ImportError as error:
    raise UsageError(
        f"NMEA 2000 needs more libraries ({error}); "
        "install them with `pip install 'shiplog[nmea2000]'`"
    ) from error

Field = int | float | None


class FrameError(ValueError):
    """A line, frame or message that is rejected; the text is the reason, from a fixed set."""


def ngt1_codec() -> _canboat.GatewayCodec:
    """Make a codec of the binary messages of an Actisense NGT-1."""
    return _canboat.GatewayCodec("ngt1")


def is_fast(pgn: int) -> bool:
    """Whether the messages of a PGN are longer than one frame, as fast packets."""
    return bool(backend.is_fast_pgn(pgn))


def split_identifier(identifier: int) -> tuple[int, int, int]:
    """Return PGN, source address and destination of a 29-bit CAN identifier.

    Examples
    --------
    >>> split_identifier(0x19F51323)
    (128275, 35, 255)
    """
    _, pgn, source, destination = _canboat.can_id_decompose(identifier)
    return pgn, source, destination


def fields(pgn: int, data: bytes) -> Mapping[str, Field]:
    """Return the numbers of a message by their names in canboat's database.

    Parameters
    ----------
    pgn
        The parameter group number.
    data
        The whole message; a short one has no values behind its end.

    Returns
    -------
    fields
        Numbers in SI units; codes of enumerations; dates in days since 1970-01-01 and times in
        seconds since midnight. None means not available, or reported as faulty by the sensor.
        Empty where the message cannot be decoded.

    Examples
    --------
    >>> fields(127251, bytes.fromhex("00 00 00 00 01 ff ff ff"))["rate"]
    0.524288
    """
    message = backend.decode(pgn, data, units="si")
    if message is None:
        return {}
    return {field.id: field.raw_value for field in message.fields}

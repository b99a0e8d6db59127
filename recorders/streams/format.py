"""Formats of streams: what a package adds so that its format can be recorded and decoded."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .decoder import Decoder
from .packets import Batches

if TYPE_CHECKING:
    from recorders.streams.reception_clock import ReceptionClock
    from recorders.transports.transport import Transport

GROUP = "shiplog.stream_formats"  # of the entry points


@dataclass(frozen=True)
class OpenedStream:
    """A stream that is ready to be decoded.

    Attributes
    ----------
    batches
        Packets, each with its time of reception.
    decoder
        Decodes them.
    """

    batches: Batches
    decoder: Decoder


def _no_options(parser: argparse.ArgumentParser) -> None:
    """Add no option."""


@dataclass(frozen=True)
class StreamFormat:
    """A format of packets, such as NMEA 0183.

    A package adds one by an entry point of the group ``shiplog.stream_formats``. It is then a
    source of ``shiplog record NAME ADDRESS``, of a trial file, and of ``shiplog decode``. Its
    module is imported for ``shiplog record --help``, too, so that heavy libraries are best imported
    inside `open`.

    Attributes
    ----------
    name
        The name, such as ``nmea0183``; raw packets are recorded with it.
    help
        One line for the list of sources.
    open
        Makes the stages and the decoder of a stream. Its arguments are batches and the parsed
        options. Packets of a file or of a raw topic come as lines; those of a file have no time
        (`NO_TIME`), and the batches that `open` returns have one or raise a `ShiplogError` that
        states what is missing.
    configure
        Adds the format's own options to a parser. A trial file has the same options as keys.
    transport
        Makes the transport of an address that only this format has, such as ``can0``; returns None
        for other addresses.
    """

    name: str
    help: str
    open: Callable[[Batches, argparse.Namespace], OpenedStream]
    configure: Callable[[argparse.ArgumentParser], None] = _no_options
    transport: "Callable[[str, ReceptionClock], Transport | None]" = lambda _address, _clock: None

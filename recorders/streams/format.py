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


def _no_options(parser: argparse.ArgumentParser) -> None:
    """Add no option."""


@dataclass(frozen=True)
class OpenedFile:
    """The lines of a file with their times, and the decoder for them.

    Attributes
    ----------
    batches
        The lines, each with its time of reception.
    decoder
        Decodes them. Its counts have the lines that were rejected for want of a time, and the
        warnings about the times are among its events.
    """

    batches: Batches
    decoder: Decoder


@dataclass(frozen=True)
class StreamFormat:
    """A format of packets, such as NMEA 0183.

    A package adds one by an entry point of the group ``shiplog.stream_formats``. It is then a
    source of ``shiplog record NAME ADDRESS``, of a trial file, and of ``shiplog decode``. Its
    module is imported for ``shiplog record --help``, too, so that heavy libraries are best imported
    inside its functions.

    Attributes
    ----------
    name
        The name, such as ``nmea0183``; raw packets are recorded with it.
    help
        One line for the list of sources.
    make_decoder
        Makes a decoder of packets that have a time of reception, from a live transport or a raw
        topic, given the parsed options.
    open_file
        Gives the lines of a file, which have no time (`NO_TIME`), their times of reception, from
        the text before each or from their content, and makes their decoder. Raises a
        `ShiplogError` that states what is missing, or the batches do, where there are no times.
    configure
        Adds the format's own options to a parser. A trial file has the same options as keys.
    open_transport
        Makes the transport of an address that only this format has, such as ``can0``; returns None
        for other addresses.
    """

    name: str
    help: str
    make_decoder: Callable[[argparse.Namespace], Decoder]
    open_file: Callable[[Batches, argparse.Namespace], OpenedFile]
    configure: Callable[[argparse.ArgumentParser], None] = _no_options
    open_transport: "Callable[[str, ReceptionClock], Transport | None]" = lambda _address, _clock: (
        None
    )

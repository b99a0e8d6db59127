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
        Makes a decoder, given the parsed options. It decodes packets that have a time of reception,
        from a live transport, a file, or a raw topic.
    add_times
        Gives the lines of a file their times of reception, from the text before each, or from its
        content; a stage that takes and yields batches. Raises a `ShiplogError` that states what is
        missing where there are none. The text before each payload is removed.
    configure
        Adds the format's own options to a parser. A trial file has the same options as keys.
    open_transport
        Makes the transport of an address that only this format has, such as ``can0``; returns None
        for other addresses.
    """

    name: str
    help: str
    make_decoder: Callable[[argparse.Namespace], Decoder]
    add_times: Callable[[Batches, argparse.Namespace], Batches]
    configure: Callable[[argparse.ArgumentParser], None] = _no_options
    open_transport: "Callable[[str, ReceptionClock], Transport | None]" = lambda _address, _clock: (
        None
    )

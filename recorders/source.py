"""The interface of a source of samples, and what a source offers to the command line."""

import argparse
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from shiplog import Channel
from shiplog.types import Event, RawPackets

Recordable = Channel | RawPackets | Event
"""What a source yields and a log holds: samples, raw packets, and events."""


class Source(Protocol):
    """Anything that yields samples: a simulated trial, a serial line, a network.

    A class needs no base class to be a source, only these three members.
    """

    @property
    def metadata(self) -> Mapping[str, str]:
        """Where the samples come from, as texts by key, to be kept in the log.

        Read when the recording begins and again when it ends, so that counts can be part of it.
        """
        ...

    @property
    def vessel_toml(self) -> str | None:
        """The text of the vessel file to keep in the log; None where the source has none."""
        ...

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield what was received, chunk by chunk, in the order of reception.

        Each chunk is written to the file before the next one is asked for. A crash of the process
        can lose the last one only, so that a chunk should hold seconds rather than hours.

        Yields
        ------
        tuple
            Samples of one or more channels in SI units, received later than those of the chunk
            before; and, where the source has them, raw packets and events. Nothing where a live
            source received nothing for a while.
        """
        ...


S = TypeVar("S", bound=Source)


def _nothing(arguments: argparse.Namespace, source: Source) -> None:
    """Do nothing after the recording."""


@dataclass(frozen=True)
class RecorderCommand(Generic[S]):
    """A source as ``shiplog record NAME`` offers it.

    A package adds one by an entry point of the group ``shiplog.recorders`` whose name is NAME and
    whose object is a `RecorderCommand`. Its module is imported for ``shiplog record --help``, too,
    so that heavy libraries are best imported inside `open`.

    Attributes
    ----------
    help
        One line for the list of sources.
    configure
        Adds the source's own arguments to its parser. `record` itself adds ``-o FILE``.
    open
        Makes the source from the parsed arguments; ``arguments.output`` is the file of ``-o``. A
        `ShiplogError` it raises becomes one line on stderr.
    finish
        Called with the arguments and the source after a recording that was not interrupted.
    """

    help: str
    configure: Callable[[argparse.ArgumentParser], None]
    open: Callable[[argparse.Namespace], S]
    finish: Callable[[argparse.Namespace, S], None] = _nothing

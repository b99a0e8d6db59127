"""What a recorder records."""

from collections.abc import Iterator, Mapping
from typing import Protocol

from shiplog import Channel


class Source(Protocol):
    """Anything that yields samples: a simulated trial, a serial line, a network."""

    @property
    def metadata(self) -> Mapping[str, str]:
        """Where the samples come from, for the log's provenance."""
        ...

    @property
    def vessel_toml(self) -> str | None:
        """The vessel file to keep with the log, if the source knows one."""
        ...

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """What was received, chunk by chunk, each later than the one before."""
        ...

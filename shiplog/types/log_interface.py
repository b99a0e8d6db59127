"""Interfaces of logs, whether in memory, in a file, or screened."""

from collections.abc import Iterator, Mapping
from typing import Protocol, Self

from .channel import Channel
from .event import Event


class ChunkedLog(Protocol):
    """The samples of a log, as recorded or as screened: what resampling and checks need of it."""

    @property
    def name(self) -> str:
        """The name of the file."""

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Iterate over the samples in chunks, each topic in the order of reception.

        Each call is one pass over the log; a log allows any number of them.
        """


class Log(ChunkedLog, Protocol):
    """The interface of a log, whether it is in memory (`TrialLog`) or in its file (`LogFile`).

    Of a log in its file, `warnings` and `data_lost` are complete after a first pass over `chunks`.
    """

    @property
    def metadata(self) -> Mapping[str, str]:
        """Text about the trial, by key."""

    @property
    def vessel_toml(self) -> str | None:
        """The attached vessel file."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Problems met in reading the file."""

    @property
    def data_lost(self) -> bool:
        """Whether a part of the file could not be read."""

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened during the trial, in the order of time."""

    def select_sources(self, sources: Mapping[str, str]) -> Self:
        """Return the log with a single source for each of the names given.

        Parameters
        ----------
        sources
            The source to keep, by channel name.

        Raises
        ------
        LogError
            The log has no such channel.
        """

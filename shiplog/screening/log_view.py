"""What a log that is computed from another one has in common with it."""

from collections.abc import Mapping

from shiplog.types import Event, Log


class LogView:
    """A log that is computed from another one: name, text and events are those of the other.

    Parameters
    ----------
    log
        The other log.
    """

    def __init__(self, log: Log) -> None:
        self._log = log

    @property
    def name(self) -> str:
        """The name of the file."""
        return self._log.name

    @property
    def metadata(self) -> Mapping[str, str]:
        """Text about the trial, by key."""
        return self._log.metadata

    @property
    def vessel_toml(self) -> str | None:
        """The attached vessel file."""
        return self._log.vessel_toml

    @property
    def warnings(self) -> tuple[str, ...]:
        """Problems met in reading the file."""
        return self._log.warnings

    @property
    def data_lost(self) -> bool:
        """Whether a part of the file could not be read."""
        return self._log.data_lost

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened during the trial, in the order of time."""
        return self._log.events

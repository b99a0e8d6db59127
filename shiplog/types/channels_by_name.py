"""Channels of a log, or something about each of them, indexed by name and source."""

from collections.abc import Iterator
from typing import Generic, Protocol, TypeVar

from shiplog.errors import LogError
from shiplog.units import did_you_mean


class NamedChannel(Protocol):
    """Anything about one quantity from one source: a channel, or statistics of it."""

    @property
    def name(self) -> str:
        """The quantity."""

    @property
    def source(self) -> str:
        """The sensor or program it comes from."""


C_co = TypeVar("C_co", bound=NamedChannel, covariant=True)


class ChannelsByName(Generic[C_co]):
    """A collection of channels, or of something about each of them, indexed by name.

    ``log["yaw_rate"]`` is the first source of that quantity in the file, ``log["yaw_rate/gyro"]``
    the source named. Iteration yields the channels in the order of the file and `len` counts
    them; ``in`` accepts a name, a name with its source, and a channel.

    Attributes
    ----------
    name
        The name of the log, for messages.
    channels
        The channels in the order of the file.
    """

    name: str
    channels: tuple[C_co, ...]

    def __getitem__(self, key: str) -> C_co:
        """Return the channel of a name, or of a name and a source.

        Raises
        ------
        LogError
            There is no such channel; the message lists those that the log has.
        """
        found = self.get(key)
        if found is None:
            raise LogError(self._no_channel(key))
        return found

    def get(self, key: str) -> C_co | None:
        """Return ``log[key]``, or None if there is no such channel."""
        name, _, source = key.strip("/").partition("/")
        for channel in self.channels:
            if channel.name == name and source in ("", channel.source):
                return channel
        return None

    def _no_channel(self, key: str) -> str:
        name, _, source = key.strip("/").partition("/")
        sources = [channel.source for channel in self.channels if channel.name == name]
        if sources:
            return f"no source {source!r} of {name!r} in {self.name}; it has {', '.join(sources)}"
        names = sorted({channel.name for channel in self.channels})
        return (
            f"no channel {key!r} in {self.name}; it has {', '.join(names) or 'none'}"
            f"{did_you_mean(key, names)}"
        )

    def __contains__(self, key: object) -> bool:
        """Whether a name, a name with its source, or a channel is in the log."""
        if isinstance(key, str):
            return self.get(key) is not None
        return any(channel is key for channel in self.channels)

    def __iter__(self) -> Iterator[C_co]:
        """Iterate over the channels in the order of the file."""
        return iter(self.channels)

    def __len__(self) -> int:
        """Return the number of channels."""
        return len(self.channels)

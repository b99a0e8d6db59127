"""Raw packets: what a source sent, byte by byte, beside the samples that were decoded from it."""

from dataclasses import dataclass, replace

import numpy as np

from .arrays import TimeArray, read_only


@dataclass(frozen=True, eq=False)
class RawPackets:
    """Packets of one source in the order of reception: lines, datagrams or frames.

    Attributes
    ----------
    source
        The name of the source, such as ``gyro``; the topic is ``/raw/SOURCE``.
    format
        The format of the data, by which they can be decoded again, such as ``nmea0183``.
    received_ns
        (n,) times of reception, ns since 1970-01-01 UTC.
    data
        n packets.

    Raises
    ------
    ValueError
        The numbers of times and packets differ.
    """

    source: str
    format: str
    received_ns: TimeArray
    data: tuple[bytes, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "received_ns", read_only(self.received_ns, np.int64))
        if self.received_ns.shape != (len(self.data),):
            raise ValueError(
                f"{self.topic}: received_ns {self.received_ns.shape}, {len(self.data)} packets"
            )

    @property
    def topic(self) -> str:
        """The topic in the MCAP file, such as ``/raw/gyro``."""
        return f"/raw/{self.source}"

    def __len__(self) -> int:
        """Return the number of packets."""
        return len(self.data)

    def part(self, start: int, stop: int) -> "RawPackets":
        """Return the packets with the numbers `start` to `stop` - 1."""
        return replace(self, received_ns=self.received_ns[start:stop], data=self.data[start:stop])

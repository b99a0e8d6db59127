"""Splitting of a byte stream into lines of bounded length."""

from .packets import MAX_PACKET_BYTES


class LineSplitter:
    r"""Splits bytes as they come into lines, which end with LF, CR, or both.

    A line longer than `MAX_PACKET_BYTES` is cut there and the rest of it is discarded, so that a
    stream without line ends needs no memory.

    Parameters
    ----------
    begins_inside
        Whether the stream may begin inside a line, as that of a serial port does. What precedes the
        first line end is then discarded: a cut line can be a valid one with a wrong number.

    Examples
    --------
    >>> splitter = LineSplitter()
    >>> splitter.lines(b"$HEHDT,1"), splitter.lines(b"23.4,T*12\r\n$HE")
    ([], [b'$HEHDT,123.4,T*12'])
    >>> splitter.rest()
    b'$HE'
    """

    def __init__(self, *, begins_inside: bool = False) -> None:
        self._begun = b""
        self._skips = begins_inside

    def lines(self, data: bytes) -> list[bytes]:
        """Return the lines that the next bytes complete, without their ends and empty lines."""
        *complete, begun = (self._begun + data).replace(b"\r", b"\n").split(b"\n")
        if self._skips and complete:
            del complete[0]
            self._skips = False
        self._begun = begun[:MAX_PACKET_BYTES]
        return [line[:MAX_PACKET_BYTES] for line in complete if line]

    def rest(self) -> bytes:
        """Return the line that has begun and not ended, and forget it."""
        begun, self._begun = self._begun, b""
        return begun

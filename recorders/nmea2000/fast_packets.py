"""Fast packets: messages of up to 223 bytes, assembled from the consecutive frames of a sender.

The first byte of a frame has the number of the message, 0 to 7, in its upper three bits and the
number of the frame in the other five; the second byte of the first frame is the length.
"""

from collections.abc import Sequence

from recorders.streams.counts import StreamCounts

from .canboat_library import FrameError
from .line_formats import FRAME_BYTES

MAX_FAST_BYTES = 223
_INCOMPLETE = "part of an incomplete fast packet"


class FastPackets:
    """Assembly of the messages of several senders; each frame is counted once.

    A sender's frames come in order on a CAN bus. A message of which one is missing is rejected as a
    whole: with a frame of a later message in its place the values would be wrong. What waits is
    bounded by the number of senders, PGNs and the 8 numbers of their messages.

    Parameters
    ----------
    counts
        Receives the frames before the last one of a message, and those of incomplete messages.
    """

    def __init__(self, counts: StreamCounts) -> None:
        self._counts = counts
        self._waiting: dict[tuple[int, int, int], list[bytes]] = {}

    def push(self, pgn: int, source: int, frame: bytes) -> bytes | None:
        """Return the data of the message that a frame completes, or None.

        Raises
        ------
        FrameError
            The frame is none of a fast packet.
        """
        if len(frame) < 2:
            raise FrameError("frame that is none of a fast packet")
        key, number = (pgn, source, frame[0] >> 5), frame[0] & 31
        frames = self._waiting.pop(key, [])
        if number == 0:
            self._reject(frames)
            frames = [frame]
        else:
            is_next = number == len(frames)
            frames.append(frame)
            if not is_next:
                self._reject(frames)
                return None
        length = frames[0][1]
        if not 0 < length <= MAX_FAST_BYTES:
            raise FrameError(f"fast packet without data or of more than {MAX_FAST_BYTES} bytes")
        message = frames[0][2:] + b"".join(part[1:] for part in frames[1:])
        if len(message) >= length:
            self._counts.skip(f"part of {pgn}", len(frames) - 1)
            return message[:length]
        if len(frame) < FRAME_BYTES:  # only the last one may be shorter
            self._reject(frames)
        else:
            self._waiting[key] = frames
        return None

    def finish(self) -> None:
        """Reject the messages that are still incomplete."""
        for frames in self._waiting.values():
            self._reject(frames)
        self._waiting.clear()

    def _reject(self, frames: Sequence[bytes]) -> None:
        if frames:
            self._counts.reject(_INCOMPLETE, len(frames))

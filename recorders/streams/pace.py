"""Recorded packets let through at the pace at which they were received."""

import time
from collections.abc import Callable

from .packets import Batches, Packet

STEP_NS = 250_000_000  # of the recording, of one batch


def paced(
    batches: Batches,
    factor: float,
    *,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> Batches:
    """Yield each packet when it is due.

    Parameters
    ----------
    batches
        Packets with ascending times.
    factor
        How many times faster than they were received.
    clock, sleep
        The clock, s, and the function that waits, s.

    Examples
    --------
    >>> waited = []
    >>> packets = [Packet(b"a", 0), Packet(b"b", 10**9)]
    >>> list(paced(iter([packets]), 2.0, clock=lambda: 0.0, sleep=waited.append)) == [
    ...     [packet] for packet in packets]
    True
    >>> waited
    [0.5]
    """
    started, first_ns = clock(), None
    for batch in batches:
        for part in _parts(batch):
            first_ns = part[0].received_ns if first_ns is None else first_ns
            due = (part[-1].received_ns - first_ns) * 1e-9 / factor
            if (wait := due - (clock() - started)) > 0:
                sleep(wait)
            yield part


def _parts(batch: list[Packet]) -> Batches:
    """Cut a batch into parts of at most `STEP_NS`."""
    start = 0
    for end in range(1, len(batch) + 1):
        if end == len(batch) or batch[end].received_ns - batch[start].received_ns >= STEP_NS:
            yield batch[start:end]
            start = end

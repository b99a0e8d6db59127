"""Clock of reception: the wall clock at one instant, continued by the steady clock."""

import time
from collections.abc import Callable

MIN_JUMP_NS = 50_000_000  # smaller differences are the corrections of a time server


def steady_ns() -> int:
    """Return the time since the machine's start, ns; it also counts while the machine sleeps."""
    clock = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
    return time.clock_gettime_ns(clock)


class ReceptionClock:
    """Times of reception that never jump, whatever happens to the wall clock.

    Parameters
    ----------
    wall_ns, steady_ns
        The clocks of the machine, ns.

    Examples
    --------
    >>> steady = iter((5, 7))
    >>> ReceptionClock(lambda: 1_000, lambda: next(steady)).now_ns()
    1002
    """

    def __init__(
        self,
        wall_ns: Callable[[], int] = time.time_ns,
        steady_ns: Callable[[], int] = steady_ns,
    ) -> None:
        self._wall_ns, self._steady_ns = wall_ns, steady_ns
        self._offset_ns = wall_ns() - steady_ns()
        self._reported_ns = 0

    def now_ns(self) -> int:
        """Return the time, ns since 1970-01-01 UTC."""
        return self._steady_ns() + self._offset_ns

    def wall_clock_jump_ns(self) -> int:
        """Return by how much the wall clock was set since the last call, ns; 0 if it was not."""
        ahead_ns = self._wall_ns() - self.now_ns()
        jump_ns = ahead_ns - self._reported_ns
        if abs(jump_ns) < MIN_JUMP_NS:
            return 0
        self._reported_ns = ahead_ns
        return jump_ns

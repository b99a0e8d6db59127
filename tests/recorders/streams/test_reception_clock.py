"""Tests of recorders.streams.reception_clock with clocks that are set by hand."""

from recorders.streams.reception_clock import ReceptionClock

HOUR_NS = 3600 * 10**9


class _Clocks:
    def __init__(self) -> None:
        self.wall_ns, self.steady_ns = 10**18, 5 * 10**9

    def pass_secs(self, secs: int) -> None:
        self.wall_ns += secs * 10**9
        self.steady_ns += secs * 10**9

    def clock(self) -> ReceptionClock:
        return ReceptionClock(lambda: self.wall_ns, lambda: self.steady_ns)


def test_times_run_on_steadily_while_the_wall_clock_is_set() -> None:
    clocks = _Clocks()
    clock = clocks.clock()
    clocks.pass_secs(1)
    clocks.wall_ns -= HOUR_NS
    assert clock.now_ns() == 10**18 + 10**9


def test_each_jump_of_the_wall_clock_is_returned_once_with_its_size() -> None:
    clocks = _Clocks()
    clock = clocks.clock()
    assert clock.wall_clock_jump_ns() == 0
    clocks.wall_ns += HOUR_NS
    assert clock.wall_clock_jump_ns() == HOUR_NS
    assert clock.wall_clock_jump_ns() == 0
    clocks.wall_ns -= HOUR_NS
    assert clock.wall_clock_jump_ns() == -HOUR_NS


def test_corrections_of_a_time_server_are_no_jump() -> None:
    clocks = _Clocks()
    clock = clocks.clock()
    clocks.wall_ns += 10_000_000
    assert clock.wall_clock_jump_ns() == 0

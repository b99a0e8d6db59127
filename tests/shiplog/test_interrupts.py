import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest
from places import PROJECT

from shiplog.interrupts import (
    deferred,
    handled_signals,
    interruptible,
    stopped_by_signals,
    take_waiting,
)

ALL = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """The handlers before a test are those after it."""
    before = [signal.getsignal(number) for number in ALL]
    yield
    assert [signal.getsignal(number) for number in ALL] == before


@pytest.mark.parametrize("number", ALL)
def test_each_of_the_signals_is_raised_as_ctrl_c_is(number: signal.Signals) -> None:
    with pytest.raises(KeyboardInterrupt), handled_signals():
        signal.raise_signal(number)


@pytest.mark.parametrize("number", ALL)
def test_a_deferred_signal_is_raised_at_the_end_of_the_block(number: signal.Signals) -> None:
    done: list[int] = []

    def work() -> None:
        with deferred():
            signal.raise_signal(number)
            done.append(1)
        done.append(2)

    with pytest.raises(KeyboardInterrupt), handled_signals():
        work()
    assert done == [1]


def test_an_error_in_a_deferred_block_precedes_the_signal() -> None:
    def work() -> None:
        signal.raise_signal(signal.SIGTERM)
        raise OSError("full")

    with pytest.raises(OSError, match="full"), handled_signals(), deferred():
        work()


def test_a_signal_that_waits_is_raised_where_the_work_can_be_interrupted() -> None:
    with handled_signals(), deferred():
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt), interruptible():
            pytest.fail("the block must not run")
        assert not take_waiting()


def test_what_follows_the_first_signal_is_not_interrupted_by_the_next_ones() -> None:
    undone: list[bool] = []

    def work() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            signal.raise_signal(signal.SIGTERM)
            undone.append(True)

    with handled_signals(), deferred():
        with pytest.raises(KeyboardInterrupt), interruptible():
            work()
        assert undone
        assert take_waiting()


def test_nested_blocks_are_one() -> None:
    done: list[int] = []

    def work() -> None:
        with handled_signals(), deferred():
            with handled_signals(), deferred():
                signal.raise_signal(signal.SIGINT)
            done.append(1)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == [1]


def test_a_hangup_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stopped_by_signals(lambda: None):
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) != signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)


def test_the_first_signal_stops_and_the_second_one_is_raised() -> None:
    stops: list[bool] = []
    with stopped_by_signals(lambda: stops.append(True)):
        signal.raise_signal(signal.SIGINT)
        assert stops == [True]
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert stops == [True]


def test_other_threads_leave_the_signals_of_the_main_thread_alone() -> None:
    entered: list[bool] = []

    def work() -> None:
        with handled_signals(), deferred(), interruptible():
            entered.append(take_waiting())

    with handled_signals(), deferred():
        signal.raise_signal(signal.SIGTERM)
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
        assert take_waiting()
    assert entered == [False]


LATE = """
import signal, time
from shiplog import interrupts
interrupts.PATIENCE_SECS = 0.05
interrupts.take_signals()
signal.raise_signal(signal.SIGTERM)
time.sleep(0.1)
print("still here", flush=True)
signal.raise_signal(signal.SIGTERM)
print("not reached")
"""


def test_a_signal_long_after_the_first_ends_a_process_that_does_not_end() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LATE],
        env=os.environ | {"PYTHONPATH": os.fspath(PROJECT)},
        stdout=subprocess.PIPE,
        check=False,
    )
    assert done.returncode == -signal.SIGTERM
    assert done.stdout == b"still here\n"

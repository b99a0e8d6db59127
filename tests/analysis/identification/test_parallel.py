"""A map over threads: order, events, errors and interruption."""

import threading
import time

import pytest

from analysis.identification.parallel import parallel_map


def ignore(_item: int, _done: bool) -> None:
    """Take no notice of an event."""


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_are_in_the_order_of_the_items(threads: int) -> None:
    def late(secs: float) -> float:
        time.sleep(secs)
        return secs

    items = [0.05, 0.0, 0.02, 0.0]
    assert parallel_map(late, items, ignore, threads) == items
    assert parallel_map(late, [], ignore, threads) == []


@pytest.mark.parametrize("threads", [1, 2])
def test_events_are_in_the_calling_thread_a_begin_and_an_end_for_each_item(threads: int) -> None:
    events: list[tuple[int, bool]] = []

    def on_event(item: int, done: bool) -> None:
        assert threading.current_thread() is threading.main_thread()
        events.append((item, done))

    parallel_map(str, range(4), on_event, threads)
    assert sorted(events) == [(i, done) for i in range(4) for done in (False, True)]
    assert all(events.index((i, False)) < events.index((i, True)) for i in range(4))


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_is_raised_and_no_further_item_is_begun(threads: int) -> None:
    begun: list[int] = []

    def fail(item: int) -> None:
        begun.append(item)
        time.sleep(0.01)
        if item == 1:
            raise ValueError("item 1")

    with pytest.raises(ValueError, match="item 1"):
        parallel_map(fail, range(50), ignore, threads)
    time.sleep(0.1)
    assert len(begun) < 10


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupt_ends_the_work_at_once(threads: int) -> None:
    """An interrupt is raised in the calling thread, as here by a callback."""

    def interrupt(_item: int, done: bool) -> None:
        if done:
            raise KeyboardInterrupt

    begun: list[int] = []

    def work(item: int) -> None:
        begun.append(item)
        time.sleep(0.02)

    with pytest.raises(KeyboardInterrupt):
        parallel_map(work, range(50), interrupt, threads)
    time.sleep(0.1)
    assert len(begun) < 10

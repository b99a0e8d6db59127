"""Threads: a map for compiled work that releases the GIL, and one thread for linear algebra."""

import os
import threading
from collections.abc import Callable, Sequence
from queue import Empty, SimpleQueue
from typing import TypeVar, cast

from threadpoolctl import threadpool_limits

T = TypeVar("T")
R = TypeVar("R")
Event = tuple[int, list[R] | BaseException | None]  # item; its result in a list, error, or begun


F = TypeVar("F", bound=Callable[..., object])


def single_blas_thread(function: F) -> F:
    """Run a function with one thread of the linear algebra library, whatever it calls.

    Its matrices are small: more threads would only wait for each other, many times longer than
    the work takes. The results then do not depend on the number of cores.
    """
    return cast("F", threadpool_limits.wrap(limits=1, user_api="blas")(function))


def usable_cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def parallel_map(
    function: Callable[[T], R],
    items: Sequence[T],
    on_event: Callable[[int, bool], None],
    threads: int | None = None,
) -> list[R]:
    """Apply a function to each item, several at a time.

    Threads, not processes: nothing is copied, and a script that calls this needs no
    ``if __name__ == "__main__"``. They are daemons, so that an interrupted program ends at once.

    Parameters
    ----------
    function
        Must not change what the items share.
    items
        Those that take long first, so that the threads finish together.
    on_event
        Called in the calling thread with an item's index and False when it begins, True when it
        is done. What it raises ends the work.
    threads
        How many; the number of usable cores if None. With one, the calling thread does the work.

    Returns
    -------
    results
        In the order of the items, whatever the order in which they were done.

    Raises
    ------
    BaseException
        The first error of the function, or KeyboardInterrupt; no further item is begun.

    Examples
    --------
    >>> parallel_map(abs, [-1, 2, -3], on_event=lambda item, done: None)
    [1, 2, 3]
    """
    count = min(usable_cores() if threads is None else threads, len(items))
    if count <= 1:
        return _sequential_map(function, items, on_event)
    waiting: SimpleQueue[int] = SimpleQueue()
    for i in range(len(items)):
        waiting.put(i)
    events: SimpleQueue[Event[R]] = SimpleQueue()
    stopped = threading.Event()
    for number in range(count):
        threading.Thread(
            target=_work,
            args=(function, items, waiting, events, stopped),
            name=f"parallel-map-{number}",
            daemon=True,
        ).start()
    results: dict[int, R] = {}
    try:
        while len(results) < len(items):
            i, outcome = events.get()
            if isinstance(outcome, BaseException):
                raise outcome
            if outcome is not None:
                results[i] = outcome[0]
            on_event(i, outcome is not None)
    finally:
        stopped.set()
    return [results[i] for i in range(len(items))]


def _work(
    function: Callable[[T], R],
    items: Sequence[T],
    waiting: "SimpleQueue[int]",
    events: "SimpleQueue[Event[R]]",
    stopped: threading.Event,
) -> None:
    """Take items until all are taken, and put an event when one is begun, done or has failed."""
    while not stopped.is_set():
        try:
            i = waiting.get_nowait()
        except Empty:
            return
        events.put((i, None))
        try:
            events.put((i, [function(items[i])]))
        except BaseException as error:  # noqa: BLE001 - raised again by the calling thread
            events.put((i, error))


def _sequential_map(
    function: Callable[[T], R], items: Sequence[T], on_event: Callable[[int, bool], None]
) -> list[R]:
    results = []
    for i, item in enumerate(items):
        on_event(i, False)
        results.append(function(item))
        on_event(i, True)
    return results

"""Signals that ask the process to end: SIGINT, SIGTERM and SIGHUP, deferred where they do damage.

Python runs a signal's handler between any two steps of the main thread. `handled_signals` makes
each of the three a `KeyboardInterrupt`; within `deferred` it waits for the end of the block, and
within `interruptible` inside of that, it is raised again. Once one is raised, further ones wait, so
that nothing interrupts what the first one has to undo. Outside of the main thread all of this does
nothing, and without `handled_signals` signals have the effect that the caller has chosen.
"""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

SIGNAL_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # the last one is not on all systems
PATIENCE_SECS = 5.0  # after the first signal; a later one ends a process that has not ended


@dataclass
class _Signals:
    """The state of the process's signals.

    Attributes
    ----------
    previous
        The handlers before `handled_signals`, by signal; empty where it is not in force.
    is_deferred
        Whether a signal waits.
    is_waiting
        Whether one waits now.
    first_secs
        When the first signal came, by the monotonic clock, s.
    stop
        What the next signal calls instead of being raised.
    """

    previous: dict[int, Any] = field(default_factory=dict)
    is_deferred: bool = False
    is_waiting: bool = False
    first_secs: float | None = None
    stop: Callable[[], None] | None = None


_signals = _Signals()


def take_signals() -> None:
    """Handle the signals to the end of the process; they wait, except in `interruptible`."""
    _install()
    _signals.is_deferred = True


@contextmanager
def handled_signals() -> Iterator[None]:
    """Raise SIGINT, SIGTERM and SIGHUP as `KeyboardInterrupt` within the block.

    A SIGHUP that is ignored, as by ``nohup``, stays so. Within another block this does nothing.
    """
    is_outermost = not _signals.previous
    _install()
    try:
        yield
    finally:
        if is_outermost and _is_handling():
            previous, _signals.previous = _signals.previous, {}
            for number, handler in previous.items():
                signal.signal(number, handler)


@contextmanager
def deferred() -> Iterator[None]:
    """Let signals wait for the end of the block; an error within it precedes them."""
    if not _is_handling() or _signals.is_deferred:
        yield
        return
    try:
        _signals.is_deferred = True
        yield
    except BaseException:
        _signals.is_deferred = False
        raise
    _signals.is_deferred = False
    if take_waiting():
        raise KeyboardInterrupt


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise signals again within a block that is inside of a deferred one, also one that waits."""
    if not _is_handling() or not _signals.is_deferred:
        yield
        return
    try:
        _signals.is_deferred = False
        if _signals.is_waiting:
            _raise()
        yield
    finally:
        _signals.is_deferred = True


@contextmanager
def stopped_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Call `stop` at the first signal within the block; later ones are raised.

    For work that ends by itself when it is asked to, such as a live recording.
    """
    with handled_signals():
        previous = _signals.stop
        if _is_handling():
            _signals.stop = stop
        try:
            yield
        finally:
            if _is_handling():
                _signals.stop = previous


def take_waiting() -> bool:
    """Return whether a signal waits, which is then dealt with."""
    is_waiting = _is_handling() and _signals.is_waiting
    if is_waiting:
        _signals.is_waiting = False
    return is_waiting


def _install() -> None:
    if threading.current_thread() is not threading.main_thread() or _signals.previous:
        return
    numbers = [getattr(signal, name) for name in SIGNAL_NAMES if hasattr(signal, name)]
    hangup = getattr(signal, "SIGHUP", None)
    if hangup and signal.getsignal(hangup) == signal.SIG_IGN:
        numbers.remove(hangup)  # by nohup
    _signals.first_secs, _signals.is_waiting, _signals.is_deferred = None, False, False
    for number in numbers:
        _signals.previous[number] = signal.signal(number, _on_signal)


def _is_handling() -> bool:
    """Whether signals are handled here, and this is the thread in which they arrive."""
    return bool(_signals.previous) and threading.current_thread() is threading.main_thread()


def _on_signal(number: int, _frame: FrameType | None) -> None:
    now_secs = time.monotonic()
    if _signals.first_secs is None:
        _signals.first_secs = now_secs
    elif now_secs > _signals.first_secs + PATIENCE_SECS:
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)
    if _signals.stop is not None:
        stop, _signals.stop = _signals.stop, None
        stop()
    elif _signals.is_deferred:
        _signals.is_waiting = True
    else:
        _raise()


def _raise() -> None:
    """Raise the signal, and let further ones wait while it is dealt with."""
    _signals.is_deferred, _signals.is_waiting = True, False
    raise KeyboardInterrupt

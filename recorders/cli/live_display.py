"""Live status of a recording: a table on a terminal, plain lines elsewhere, and a key for marks."""

import os
import select
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import isnan
from pathlib import Path

from recorders.trial.live_source import LiveSource
from recorders.trial.status import ChannelStatus
from shiplog.types import Event
from shiplog.units import CATALOGUE, conversion_factor

LINE_SECS = 10.0  # between the lines where stderr is no terminal
REFRESHES_PER_SECOND = 4
MAX_ROWS = 40
MARK_KEY = "m"


class MarkKey:
    """Marks that are made by a key in the terminal of the recorder.

    Parameters
    ----------
    now_ns
        Returns the time of the clock of reception, ns.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._count = 0
        self.enabled = False

    def take(self) -> list[Event]:
        """Return an event for each press of the key since the last call."""
        events = []
        while self.enabled and select.select([sys.stdin], [], [], 0)[0]:
            pressed = os.read(sys.stdin.fileno(), 64)
            if not pressed:
                break
            for _ in range(pressed.decode(errors="replace").count(MARK_KEY)):
                self._count += 1
                events.append(Event(self._now_ns(), f"mark {self._count}"))
        return events

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Read single keys within the block, where stdin is a terminal."""
        if not sys.stdin.isatty():
            yield
            return
        import termios
        import tty

        saved = termios.tcgetattr(sys.stdin)
        try:
            tty.setcbreak(sys.stdin)
            self.enabled = True
            yield
        finally:
            self.enabled = False
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, saved)


@contextmanager
def live_display(source: LiveSource, log: Path) -> Iterator[Callable[[int], None]]:
    """Show the status of a live recording on stderr, and yield the function that updates it.

    Parameters
    ----------
    source
        The source that is recorded.
    log
        The file that is written, for its size and the free space of its disk.
    """
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _line_printer(source, log)
        return
    from rich.live import Live

    with Live(console=console, refresh_per_second=REFRESHES_PER_SECOND, transient=True) as live:
        yield lambda _samples: live.update(_status_table(source, log))


def value_in_words(channel: ChannelStatus) -> str:
    """Return the last value of a channel in the unit in which people read it."""
    kind = CATALOGUE.get(channel.name)
    if len(channel.last_value) > 1:
        return ", ".join(f"{value:.5f}" for value in channel.last_value[:2])
    (value,) = channel.last_value
    if kind is None:
        return f"{value:.4g} {channel.unit}"
    shown = value * conversion_factor(kind.unit, kind.display_unit)
    return f"{shown:.2f}" if kind.display_unit == "1" else f"{shown:.2f} {kind.display_unit}"


def rate_in_words(channel: ChannelStatus) -> str:
    """Return the rate of a channel, or a dash where it is not known yet."""
    return "-" if isnan(channel.rate_hz) else f"{channel.rate_hz:.1f} Hz"


def _line_printer(source: LiveSource, log: Path) -> Callable[[int], None]:
    last = time.monotonic()

    def on_chunk(samples: int) -> None:
        nonlocal last
        if time.monotonic() - last < LINE_SECS:
            return
        last = time.monotonic()
        channels = ", ".join(
            f"{c.topic} {'silent' if c.stale else f'{rate_in_words(c)} {value_in_words(c)}'}"
            for c in source.status.channels[:MAX_ROWS]
        )
        missing = source.status.missing
        alarm = f"; nothing of {', '.join(missing)}" if missing else ""
        text = f"{samples} samples, {_sizes(log)}: {channels or 'nothing heard'}{alarm}"
        print(text, file=sys.stderr, flush=True)

    return on_chunk


def _status_table(source: LiveSource, log: Path):  # type: ignore[no-untyped-def]  # noqa: ANN202 - rich is imported here only
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    now_ns = source.clock.now_ns()
    table = Table(title=f"recording {log.name}: {_sizes(log)}", title_justify="left")
    table.add_column("channel")
    for heading in ("rate", "age", "last value", "samples"):
        table.add_column(heading, justify="right", no_wrap=True)
    for channel in source.status.channels[:MAX_ROWS]:
        age = f"{max(0.0, (now_ns - channel.last_ns) * 1e-9):.1f} s"
        table.add_row(
            Text(channel.topic),
            rate_in_words(channel),
            age,
            value_in_words(channel),
            str(channel.samples),
            style="bold red" if channel.stale else None,
        )
    lines = [Text(text) for text in _stream_lines(source)]
    if missing := source.status.missing:
        lines.append(Text(f"nothing heard of {', '.join(missing)}", style="bold red"))
    lines.append(Text(f"{MARK_KEY}: mark an event   Ctrl-C: end the recording", style="dim"))
    return Group(table, *lines)


def _stream_lines(source: LiveSource) -> Iterator[str]:
    """Yield the state of each stream and the packets it has rejected or dropped."""
    for each in source.inputs:
        counts = each.stream.decoder.counts
        rejected = ", ".join(f"{count} {reason}" for reason, count in counts.rejected.items())
        parts = [f"{each.stream.name}: {each.live.state.value}"]
        parts += [f"rejected {rejected}"] if rejected else []
        parts += [f"dropped {each.live.dropped}"] if each.live.dropped else []
        yield "; ".join(parts)


def _sizes(log: Path) -> str:
    """Return the size of the file and the free space of its disk, in words."""
    try:
        size, free = log.stat().st_size, shutil.disk_usage(log.parent).free
    except OSError:
        return "size unknown"
    return f"{size / 1e6:.1f} MB, {free / 1e9:.1f} GB free"

"""Live status of a recording: a table on a terminal, plain lines elsewhere, and a key for marks."""

import os
import select
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from recorders.trial.live_source import LiveSource
from recorders.trial.status import ChannelStatus
from shiplog.cli.console import print_line
from shiplog.printable import printable
from shiplog.types import Event
from shiplog.units import CATALOGUE, conversion_factor, utc_text

if TYPE_CHECKING:
    from rich.console import Group

LINE_SECS = 10.0  # between the lines where stderr is no terminal
REFRESHES_PER_SECOND = 4
MAX_ROWS = 40  # channels of a line
FRAME_LINES = 10  # of the live table: its frame, and the lines that are not always there
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
        while self.enabled and _may_use_terminal() and select.select([sys.stdin], [], [], 0)[0]:
            try:
                pressed = os.read(sys.stdin.fileno(), 64)
            except OSError:  # the terminal was closed
                pressed = b""
            if not pressed:
                self.enabled = False
            for _ in range(pressed.decode(errors="replace").count(MARK_KEY)):
                self._count += 1
                events.append(Event(self._now_ns(), f"mark {self._count}"))
        return events

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Read single keys within the block, where stdin is a terminal."""
        if not _may_use_terminal():
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
            if _may_use_terminal():
                with suppress(termios.error):  # it was closed
                    termios.tcsetattr(sys.stdin, termios.TCSADRAIN, saved)


def _may_use_terminal() -> bool:
    """Whether stdin is a terminal in whose foreground this process is.

    A process in the background that reads from its terminal, or sets it, is stopped by the system.
    """
    if sys.stdin is None or not sys.stdin.isatty():
        return False
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:
        return False


@dataclass(frozen=True)
class Shown:
    """What a live display shows.

    Attributes
    ----------
    source
        The source that is recorded.
    log
        The log by its final name, for the title.
    growing
        Returns the file that is written at the moment, for its size and the room on its disk.
    """

    source: LiveSource
    log: Path
    growing: Callable[[], Path]


@contextmanager
def live_display(shown: Shown) -> Iterator[Callable[[int], None]]:
    """Show the status of a live recording on stderr, and yield the function that updates it.

    A display that can no longer be written, because its terminal or the reader of its pipe has
    gone, does not end the recording.
    """
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _line_printer(shown)
        return
    from rich.live import Live

    def on_chunk(_samples: int) -> None:
        with suppress(OSError):
            live.update(_status_table(shown, console.height))

    with Live(console=console, refresh_per_second=REFRESHES_PER_SECOND, transient=True) as live:
        yield on_chunk


def value_in_words(channel: ChannelStatus) -> str:
    """Return the last value of a channel in the unit in which people read it."""
    kind = CATALOGUE.get(channel.name)
    if len(channel.last_value) > 1:
        return ", ".join(f"{value:.5f}" for value in channel.last_value[:2])
    (value,) = channel.last_value
    if isnan(value):
        return "no value"
    if channel.name == "gnss_time":
        return utc_text(value)
    if kind is None:
        return f"{value:.4g} {channel.unit}"
    shown = value * conversion_factor(kind.unit, kind.display_unit)
    return f"{shown:.2f}" if kind.display_unit == "1" else f"{shown:.2f} {kind.display_unit}"


def rate_in_words(channel: ChannelStatus) -> str:
    """Return the rate of a channel, or a dash where it is not known yet."""
    return "-" if isnan(channel.rate_hz) else f"{channel.rate_hz:.1f} Hz"


def _line_printer(shown: Shown) -> Callable[[int], None]:
    last = time.monotonic()

    def on_chunk(samples: int) -> None:
        nonlocal last
        if time.monotonic() - last < LINE_SECS:
            return
        last = time.monotonic()
        with suppress(OSError):
            print_line(_status_line(shown, samples), to_stderr=True)

    return on_chunk


def _status_line(shown: Shown, samples: int) -> str:
    status = shown.source.status
    channels = ", ".join(
        f"{c.topic} {'silent' if c.stale else f'{rate_in_words(c)} {value_in_words(c)}'}"
        for c in status.channels[:MAX_ROWS]
    )
    missing = status.missing
    alarm = f"; no value of {', '.join(missing)}" if missing else ""
    faults = "".join(
        f"; {each.stream.name}: {each.live.fault}"
        for each in shown.source.inputs
        if each.live.fault
    )
    sizes = _sizes(shown.growing())
    return f"{samples} samples, {sizes}: {channels or 'nothing heard'}{alarm}{faults}"


def _status_table(shown: Shown, height: int) -> "Group":
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    source, now_ns = shown.source, shown.source.clock.now_ns()
    title = Text(printable(f"recording {shown.log.name}: {_sizes(shown.growing())}"))
    table = Table(title=title, title_justify="left")
    table.add_column("channel")
    for heading in ("rate", "age", "last value", "samples"):
        table.add_column(heading, justify="right", no_wrap=True)
    channels = source.status.channels
    room = max(1, height - FRAME_LINES - len(source.inputs))
    for channel in channels[:room]:
        table.add_row(
            Text(printable(channel.topic)),
            rate_in_words(channel),
            _age(channel.last_ns, now_ns),
            value_in_words(channel),
            str(channel.samples),
            style="bold red" if channel.stale else None,
        )
    lines = [Text(printable(text), no_wrap=True) for text in _stream_lines(source)]
    if len(channels) > room:
        lines.insert(0, Text(f"and {len(channels) - room} more channels"))
    if missing := source.status.missing:
        lines.append(Text(printable(f"no value of {', '.join(missing)}"), style="bold red"))
    if mark := source.status.last_mark:
        lines.append(Text(printable(f"last mark: {mark.text}, {_age(mark.time_ns, now_ns)} ago")))
    lines.append(Text(f"{MARK_KEY}: mark an event   Ctrl-C: end the recording", style="dim"))
    return Group(table, *lines)


def _age(time_ns: int, now_ns: int) -> str:
    return f"{max(0.0, (now_ns - time_ns) * 1e-9):.1f} s"


def _stream_lines(source: LiveSource) -> Iterator[str]:
    """Yield the state of each stream, and the packets it has rejected or dropped."""
    for each in source.inputs:
        counts = each.stream.decoder.counts
        rejected = ", ".join(f"{count} {reason}" for reason, count in counts.rejected.items())
        fault = f" ({each.live.fault})" if each.live.fault else ""
        parts = [f"{each.stream.name}: {each.live.state.value}{fault}"]
        parts += [f"rejected {rejected}"] if rejected else []
        parts += [f"dropped {each.live.dropped}"] if each.live.dropped else []
        yield "; ".join(parts)


def _sizes(file: Path) -> str:
    """Return the size of a file and the free space of its disk, in words."""
    try:
        size, free = file.stat().st_size, shutil.disk_usage(file.parent).free
    except OSError:
        return "size unknown"
    return f"{size / 1e6:.1f} MB, {free / 1e9:.1f} GB free"

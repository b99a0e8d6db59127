"""Tests of recorders.cli.live_display: what is shown, and that showing it ends no recording."""

import io
import os
import pty
import sys
from pathlib import Path

import numpy as np
import pytest
from number_format import NUMBERS
from rich.console import Console

from recorders.cli import live_display
from recorders.cli.live_display import (
    MarkKey,
    Shown,
    _line_printer,
    _status_table,
    value_in_words,
)
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_options import parse_options
from recorders.trial.live_source import LiveSource
from recorders.trial.open_source import StreamRequest, open_streams
from shiplog.types import Channel, Event


def _shown(log: Path) -> Shown:
    options = parse_options(NUMBERS, {}, "bridge")
    request = StreamRequest("bridge", NUMBERS, "udp://127.0.0.1:1", options, None, "bridge.")
    source = open_streams([request], ReceptionClock())
    assert isinstance(source, LiveSource)
    return Shown(source, log, lambda: log.with_name(log.name + ".part"))


def _text(shown: Shown) -> str:
    console = Console(file=io.StringIO(), width=120, color_system=None)
    console.print(_status_table(shown, 40))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_the_title_names_the_log_and_the_size_is_that_of_the_growing_file(tmp_path: Path) -> None:
    (tmp_path / "a[red].mcap.part").write_bytes(bytes(2_300_000))
    text = _text(_shown(tmp_path / "a[red].mcap"))
    assert "recording a[red].mcap: 2.3 MB" in text
    assert ".part" not in text


def test_the_last_mark_of_a_person_is_shown_and_no_event_of_a_stream(tmp_path: Path) -> None:
    shown = _shown(tmp_path / "a.mcap")
    assert "last mark" not in _text(shown)
    now_ns = shown.source.clock.now_ns()
    shown.source.status.add(
        [Event(now_ns, "execute, 20 starboard"), Event(now_ns, "noise", "bridge")]
    )
    assert "last mark: execute, 20 starboard, 0." in _text(shown)


def test_what_comes_from_the_wire_cannot_control_the_terminal(tmp_path: Path) -> None:
    shown = _shown(tmp_path / "a.mcap")
    times = np.array([1])
    channel = Channel("rudder", "\x1b[2J[bold]", "rad", times, times, np.zeros(1))
    shown.source.status.add([channel])
    shown.source.inputs[0].stream.decoder.counts.reject("bad \x1b[2J")
    text = _text(shown)
    assert "\x1b" not in text
    assert r"/rudder/\x1b[2J[bold]" in text


def test_a_channel_without_a_number_is_shown_as_one_without_value(tmp_path: Path) -> None:
    shown = _shown(tmp_path / "a.mcap")
    times = np.array([1])
    shown.source.status.add([Channel("rudder", "N", "rad", times, times, np.array([np.nan]))])
    (channel,) = shown.source.status.channels
    assert value_in_words(channel) == "no value"


def test_a_closed_pipe_ends_no_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Closed(io.StringIO):
        written = 0

        def write(self, _text: str) -> int:
            Closed.written += 1
            raise BrokenPipeError

    monkeypatch.setattr(live_display, "LINE_SECS", 0.0)
    monkeypatch.setattr(sys, "stderr", Closed())
    _line_printer(_shown(tmp_path / "a.mcap"))(5)
    assert Closed.written > 0


def test_a_terminal_that_is_closed_ends_the_key_and_no_recording(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    controller, port = pty.openpty()
    monkeypatch.setattr(live_display, "_may_use_terminal", lambda: True)
    with os.fdopen(port) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        key = MarkKey(lambda: 7)
        with key.listening():
            os.write(controller, b"xmm")
            assert key.take() == [Event(7, "mark 1"), Event(7, "mark 2")]
            os.close(controller)
            assert key.take() == []
            assert not key.enabled


@pytest.mark.parametrize("stdin", [None, io.StringIO()])
def test_without_a_terminal_there_is_no_key(
    monkeypatch: pytest.MonkeyPatch, stdin: io.StringIO | None
) -> None:
    monkeypatch.setattr(sys, "stdin", stdin)
    key = MarkKey(lambda: 0)
    with key.listening():
        assert key.take() == []


def test_a_terminal_of_another_foreground_process_is_not_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    controller, port = pty.openpty()  # it controls no process, so that none is its foreground
    with os.fdopen(port) as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        key = MarkKey(lambda: 0)
        with key.listening():
            os.write(controller, b"m\n")
            assert key.take() == []
            assert not key.enabled
    os.close(controller)

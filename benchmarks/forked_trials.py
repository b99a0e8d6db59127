"""Commands of shiplog in forked children: on small disks, and with a signal at a step of theirs."""

import os
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from shiplog.cli.main import main

PROJECT = Path(__file__).parents[1]
MAX_CHILD_SECS = 100  # a child that takes longer hangs
MIN_DISK_BYTES = 16384  # a disk has blocks of 4096 bytes; smaller ones are limits of a file's size
BLOCK_BYTES = 4096
MOUNT, UMOUNT = shutil.which("mount") or "mount", shutil.which("umount") or "umount"
CONTEXTLIB = contextmanager.__code__.co_filename


@dataclass(frozen=True)
class Ending:
    """How a child ended.

    Attributes
    ----------
    code
        Its exit code; negative where a signal killed it.
    errors
        What it wrote on stderr.
    files
        The names of the files in its folder, without links.
    """

    code: int
    errors: str
    files: frozenset[str]


def run_command(arguments: Sequence[str]) -> int:
    """Run a command as the process of the command line does."""
    sys.argv = ["shiplog", *arguments]
    return main()


def run_limited(arguments: Sequence[str], limit: int | None) -> int:
    """Run a command whose files can have no more than `limit` bytes each."""
    if limit is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    return run_command(arguments)


def run_traced(arguments: Sequence[str], step: int, number: int) -> int:
    """Run a command, and send it a signal at one of its steps; count them where `number` is 0."""
    count = 0

    def trace(frame: FrameType, event: str, _argument: object) -> Any:  # noqa: ANN401 - itself
        nonlocal count
        if event == "line":
            count += 1
            if count == step + 1:
                os.kill(os.getpid(), number)
        elif not frame.f_code.co_filename.startswith((os.fspath(PROJECT), CONTEXTLIB)):
            return None
        return trace

    sys.settrace(trace)
    code = run_command(arguments)
    sys.settrace(None)
    if number == 0:
        Path("steps").write_text(str(count), encoding="utf-8")
    return code


def fork(work: Callable[[], int]) -> int:
    """Start a child that does some work, and return its process id."""
    child = os.fork()
    if child:
        return child
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which nohup ignores
    try:
        code = int(work())
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    finally:
        os._exit(99)  # by an exception


def run_child(work: Callable[[], int], place: Path) -> Ending:
    """Run some work in a folder to its end."""
    reader, writer = os.pipe()

    def in_place() -> int:
        signal.alarm(MAX_CHILD_SECS)
        os.chdir(place)
        os.dup2(writer, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        # the command makes streams of its own, after which the end of these closes nothing
        sys.stdout, sys.stderr = (os.fdopen(each, "w", closefd=False) for each in (1, 2))
        return work()

    child = fork(in_place)
    os.close(writer)
    with os.fdopen(reader, encoding="utf-8", errors="replace") as stream:
        errors = stream.read()
    _, status = os.waitpid(child, 0)
    files = frozenset(file.name for file in place.iterdir() if not file.is_symlink()) - {"steps"}
    return Ending(os.waitstatus_to_exitcode(status), errors, files)


@contextmanager
def small_disk(place: Path, space: int) -> Iterator[int | None]:
    """Make a folder a disk of some size, and yield None; else the limit of the size of a file."""
    place.mkdir()
    size = f"size={space // BLOCK_BYTES * BLOCK_BYTES}"
    mount = [MOUNT, "-t", "tmpfs", "-o", size, "tmpfs", os.fspath(place)]
    mounted = (
        space >= MIN_DISK_BYTES
        and subprocess.run(mount, check=False, stderr=subprocess.DEVNULL).returncode == 0
    )
    try:
        yield None if mounted else space
    finally:
        if mounted:
            subprocess.run([UMOUNT, os.fspath(place)], check=True)

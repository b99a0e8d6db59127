"""A Rerun viewer of its own for a review."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from typing import IO

from shiplog.errors import ShiplogError

VIEWER_SECS = 20.0  # within which a viewer listens, or never will


def view_review(path: str | os.PathLike[str]) -> None:
    """Open a review in a viewer of its own, which listens to this computer only.

    The viewer stays open when the caller ends. Raises `ShiplogError` where none can start, for
    want of a screen as a rule.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    listening = ["--bind", "127.0.0.1", "--port", str(port)]
    command = [sys.executable, "-m", "rerun_cli", *listening, os.fspath(path)]
    with tempfile.TemporaryFile() as said:
        viewer = subprocess.Popen(  # noqa: S603 - our own interpreter
            command, stdout=subprocess.DEVNULL, stderr=said, start_new_session=True
        )
        _await(viewer, port, said)


def _await(viewer: subprocess.Popen[bytes], port: int, said: IO[bytes]) -> None:
    """Wait until the viewer listens; it does so a moment before it looks for a screen."""
    deadline, listening = time.monotonic() + VIEWER_SECS, False
    while viewer.poll() is None and time.monotonic() < deadline:
        if listening:
            return
        with socket.socket() as probe:
            listening = probe.connect_ex(("127.0.0.1", port)) == 0
        time.sleep(1.0 if listening else 0.1)
    _end(viewer)
    said.seek(0)
    lines = said.read().decode(errors="replace").strip().splitlines()
    reason = lines[-1].rpartition(": ")[2].rstrip(".") if lines else "it does not answer"
    raise ShiplogError(
        f"the Rerun viewer cannot start here ({reason}); "
        "the review is in its file; open that on a computer with a screen"
    )


def _end(viewer: subprocess.Popen[bytes]) -> None:
    """End the command and, where there are process groups, the viewer it started."""
    if viewer.poll() is None and hasattr(os, "killpg"):
        os.killpg(viewer.pid, signal.SIGTERM)
    viewer.terminate()
    viewer.wait()

"""A Rerun viewer started for a review."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from typing import IO

from shiplog.errors import ShiplogError

MAX_START_SECS = 20.0  # a viewer that does not listen by then has failed


def view_review(path: str | os.PathLike[str]) -> None:
    """Open a review in a viewer of its own, which listens to this computer only.

    The viewer stays open when the caller ends.

    Raises
    ------
    ShiplogError
        Where no viewer can start, mostly because there is no screen.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    listening = ["--bind", "127.0.0.1", "--port", str(port)]
    command = [sys.executable, "-m", "rerun_cli", *listening, os.fspath(path)]
    with tempfile.TemporaryFile() as stderr:
        viewer = subprocess.Popen(  # noqa: S603 - our own interpreter
            command, stdout=subprocess.DEVNULL, stderr=stderr, start_new_session=True
        )
        _wait(viewer, port, stderr)


def _wait(viewer: subprocess.Popen[bytes], port: int, stderr: IO[bytes]) -> None:
    """Wait until the viewer listens and, a moment later, still runs: it looks for a screen then."""
    deadline, listening = time.monotonic() + MAX_START_SECS, False
    while viewer.poll() is None and time.monotonic() < deadline:
        if listening:
            return
        with socket.socket() as client:
            listening = client.connect_ex(("127.0.0.1", port)) == 0
        time.sleep(1.0 if listening else 0.1)
    _end(viewer)
    stderr.seek(0)
    lines = stderr.read().decode(errors="replace").strip().splitlines()
    reason = lines[-1].rpartition(": ")[2].rstrip(".") if lines else "no answer"
    raise ShiplogError(
        f"the Rerun viewer cannot start here ({reason}); "
        "the review was written; open its file on a computer with a screen"
    )


def _end(viewer: subprocess.Popen[bytes]) -> None:
    """Terminate the command and, where there are process groups, the viewer it started."""
    if viewer.poll() is None and hasattr(os, "killpg"):
        os.killpg(viewer.pid, signal.SIGTERM)
    viewer.terminate()
    viewer.wait()

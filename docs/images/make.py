"""Take the picture of a review.

    python docs/images/make.py trial.rrd review.png

It needs no screen. Without a graphics card, Debian's `mesa-vulkan-drivers` renders in software.
"""

import argparse
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

from rerun.experimental import ViewerClient

WINDOW = "1800x1100"
MAX_START_SECS = 30.0  # until the viewer answers
LAYOUT_SECS = 8.0  # until the plots are laid out and the viewer's greetings are gone


def main() -> None:
    """Start a viewer without a window, open the review in it, and save a screenshot."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("review", type=Path, help="an .rrd file")
    parser.add_argument("picture", type=Path, help="the .png to write")
    parser.add_argument(
        "--window", default=WINDOW, metavar="WIDTHxHEIGHT",
        help=f"size of the viewer's window (default: {WINDOW})",
    )  # fmt: skip
    arguments = parser.parse_args()
    port = free_port()
    options = ["--window-size", arguments.window, "--bind", "127.0.0.1", "--port", str(port)]
    viewer = subprocess.Popen(  # noqa: S603 - our own interpreter
        [sys.executable, "-m", "rerun_cli", "--headless", "--hide-welcome-screen", *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        client = connect_to_viewer(port)
        client.open(str(arguments.review.resolve()))
        time.sleep(LAYOUT_SECS)
        arguments.picture.write_bytes(client.take_screenshot())
    finally:
        os.killpg(viewer.pid, signal.SIGTERM)  # the command and the viewer it started
        viewer.wait()


def free_port() -> int:
    """Return a port of this computer on which no program listens."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def connect_to_viewer(port: int) -> ViewerClient:
    """Return a client of the viewer on a port, as soon as it answers.

    Raises the client's own error if there is no answer for `MAX_START_SECS`.
    """
    deadline = time.monotonic() + MAX_START_SECS
    while True:
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.get_state()
        except Exception:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.2)
        else:
            return client


if __name__ == "__main__":
    main()

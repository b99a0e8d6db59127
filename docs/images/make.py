"""Make the picture of a review: `python docs/images/make.py trial.rrd review.png`.

It needs no screen. Without a graphics card, Debian's `mesa-vulkan-drivers` draws in software.
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
PATIENCE_SECS = 30.0


def main() -> None:
    """Take the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("review", type=Path, help="an .rrd file")
    parser.add_argument("picture", type=Path, help="the .png to write")
    parser.add_argument("--window", default=WINDOW, metavar="WIDTHxHEIGHT")
    arguments = parser.parse_args()
    port = free_port()
    place = ["--window-size", arguments.window, "--bind", "127.0.0.1", "--port", str(port)]
    viewer = subprocess.Popen(  # noqa: S603 - our own interpreter
        [sys.executable, "-m", "rerun_cli", "--headless", "--hide-welcome-screen", *place],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        client = connected(port)
        client.open(str(arguments.review.resolve()))
        time.sleep(8)  # until the plots are laid out and the viewer's greetings are gone
        arguments.picture.write_bytes(client.take_screenshot())
    finally:
        os.killpg(viewer.pid, signal.SIGTERM)  # the command and the viewer it started
        viewer.wait()


def free_port() -> int:
    """A port of this computer that nothing listens on."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def connected(port: int) -> ViewerClient:
    """The viewer on that port, once it answers."""
    deadline = time.monotonic() + PATIENCE_SECS
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

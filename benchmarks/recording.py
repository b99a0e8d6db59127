"""The rate at which sentences are recorded over loopback UDP without loss.

    python -m benchmarks.recording --rate 10000 20000 --secs 60

The load goes to 127.0.0.1 only. The recorder is a process of its own; the one that sends paces
itself by the clock and reports the rate it reached.
"""

import argparse
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from pathlib import Path
from tempfile import TemporaryDirectory

from shiplog import read
from shiplog.mcap.raw_reader import read_raw

BURST = 0.005  # s between the bursts of the sender
START_SECS, END_SECS = 60.0, 2.0  # to wait for the recorder's start, and for its last packets


@dataclass(frozen=True)
class LoadResult:
    """What came of a load over UDP.

    Attributes
    ----------
    sent, recorded, decoded
        The number of sentences sent, kept raw in the log, and decoded.
    counted
        The number of lost packets that the log's metadata state.
    rate_hz
        The rate at which they were sent, 1/s.
    cpu_share
        The processor time of the recorder by the time of the load, in cores.
    """

    sent: int
    recorded: int
    decoded: int
    counted: int
    rate_hz: float
    cpu_share: float


def sentence(number: int) -> bytes:
    """Return one of five kinds of sentences of a ship that turns; all differ.

    Examples
    --------
    >>> sentence(0)
    b'$TIROT,0.00,A*3B'
    """
    t = 0.02 * number
    text = (
        f"TIROT,{12 * sin(0.01 * t):.2f},A",
        f"AGRSA,{10 * sin(0.02 * t):.2f},A,,",
        f"ERRPM,S,1,{80 + 2 * cos(0.03 * t):.2f},,A",
        f"VDVHW,,T,,M,{14 + sin(0.005 * t):.3f},N,{25.9 + sin(0.005 * t):.3f},K",
        f"HEHDT,{(200 + 60 * sin(0.004 * t)) % 360:.3f},T",
    )[number % 5]
    checksum = 0
    for character in text.encode():
        checksum ^= character
    return f"${text}*{checksum:02X}".encode()


def measure_load(rate_hz: float, secs: float, folder: Path) -> LoadResult:
    """Send sentences to a recorder over loopback UDP, and count what its log holds.

    Parameters
    ----------
    rate_hz
        Sentences a second, each a datagram.
    secs
        The duration of the load, s.
    folder
        Where the log is written.
    """
    sentences = [sentence(n) for n in range(int(rate_hz * secs))]
    log, port = folder / "load.mcap", _free_port()
    command = ("record", "nmea0183", f"udp://127.0.0.1:{port}", "-o", os.fspath(log))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with subprocess.Popen(
        [sys.executable, "-m", "shiplog", *command], stderr=subprocess.PIPE, text=True
    ) as recorder:
        _wait_for_start(recorder)
        took = _send(sentences, rate_hz, port)
        time.sleep(END_SECS)
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=START_SECS)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    recorded = sum(len(packets) for packets in read_raw(log))
    written = read(log)
    decoded = sum(map(len, written.channels))
    counted = int(written.metadata.get("nmea0183.dropped", 0))
    sent = len(sentences)
    return LoadResult(sent, recorded, decoded, counted, sent / took, cpu / took)


def _send(sentences: Sequence[bytes], rate_hz: float, port: int) -> float:
    """Send sentences at a rate, in bursts; returns the time it took, s."""
    with socket.socket(type=socket.SOCK_DGRAM) as sender:
        sender.connect(("127.0.0.1", port))
        start, sent = time.perf_counter(), 0
        while sent < len(sentences):
            due = min(len(sentences), int((time.perf_counter() - start) * rate_hz) + 1)
            for each in sentences[sent:due]:
                sender.send(each)
            sent = due
            time.sleep(BURST)
        return time.perf_counter() - start


def _wait_for_start(recorder: "subprocess.Popen[str]") -> None:
    if recorder.stderr is None:
        raise SystemExit("the recorder has no stderr")
    for line in recorder.stderr:
        if line.startswith("recording to"):
            time.sleep(0.5)
            return
    raise SystemExit("the recorder did not start")


def _free_port() -> int:
    with socket.socket(type=socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def main() -> None:
    """Measure, and print the results."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recording", description=__doc__)
    parser.add_argument("--rate", type=float, nargs="*", default=[10_000.0], help="1/s, over UDP")
    parser.add_argument("--secs", type=float, default=60.0, help="of each load")
    arguments = parser.parse_args()
    with TemporaryDirectory(prefix="shiplog-recording-") as name:
        for rate in arguments.rate:
            result = measure_load(rate, arguments.secs, Path(name))
            print(
                f"UDP: {result.sent} sentences at {result.rate_hz:.0f}/s: "
                f"{result.sent - result.recorded} lost, {result.counted} of them counted, "
                f"{result.decoded} samples, "
                f"{result.cpu_share:.2f} cores"
            )


if __name__ == "__main__":
    main()

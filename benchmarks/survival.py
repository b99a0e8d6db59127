"""What recordings and outputs survive: killed processes, signals at any step, full disks.

    python -m benchmarks.survival                # 200 moments and 100 sizes each, in minutes
    python -m benchmarks.survival --moments 20

Each trial is a child of this process, forked when all libraries are imported, that runs a command
in a folder of its own. Signals strike at random steps of the program, counted line by line. A full
disk is a small tmpfs where one can be mounted, else a limit of the size of files. The exit code is
1 where a file was not what it must be.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Any

import numpy as np

from recorders.record import record
from recorders.streams.counts import StreamCounts
from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.sample_buffer import SampleBuffer
from recorders.streams.stream_source import StreamSource
from recorders.transports.live_stream import LiveStream
from recorders.trial.live_source import LiveInput, LiveSource, waiting_packets
from shiplog import read
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode

PROJECT = Path(__file__).parents[1]
SAMPLE = PROJECT / "sample_data" / "zigzag_20_20.mcap"
SENTENCES = PROJECT / "sample_data" / "ship.nmea"
RATE_HZ = 100
FIRST_KILL_SECS, LAST_KILL_SECS = 0.4, 3.4  # after the start of a recording
KILLED_TOGETHER = 20
MAX_CHILD_SECS = 100  # a child that takes longer hangs
OUTPUTS = {  # verbs by name: their arguments, and the files they write
    "record": (("record", "nmea0183", str(SENTENCES), "--raw", "-o", "out.mcap"), ("out.mcap",)),
    "convert": (("convert", str(SAMPLE), "out.mcap"), ("out.mcap",)),
    "convert to csv": (("convert", str(SAMPLE), "out.csv"), ("out.csv",)),
    "replay": (
        ("replay", str(SAMPLE), "-o", "out.rrd", "--json", "out.json"),
        ("out.rrd", "out.json"),
    ),
    "info": (("info", str(SAMPLE), "--json", "out.json"), ("out.json",)),
}


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
        The names of the files it left in its folder.
    """

    code: int
    errors: str
    files: frozenset[str]


def kill_recordings(moments: int, folder: Path, seed: int = 1) -> tuple[list[float], list[str]]:
    """Kill live recordings of 100 messages a second at random moments.

    Returns
    -------
    lost_secs, failures
        (n,) how much of the recording was lost, s, for those that can be read; and what is wrong
        with the others.
    """
    chance = np.random.default_rng(seed)
    lost, failures = [], []
    for begin in range(0, moments, KILLED_TOGETHER):
        running = []
        for number in range(begin, min(begin + KILLED_TOGETHER, moments)):
            path = folder / f"killed{number}.mcap"
            running.append((_forked(partial(_record_live, path)), path))
        started = time.monotonic()
        ends = sorted(chance.uniform(FIRST_KILL_SECS, LAST_KILL_SECS) for _ in running)
        for end, (child, path) in zip(ends, running, strict=True):
            time.sleep(max(0.0, started + end - time.monotonic()))
            os.kill(child, signal.SIGKILL)
            killed_ns = time.time_ns()
            os.waitpid(child, 0)
            try:
                lost.append(_lost_secs(path, killed_ns))
            except Exception as error:  # noqa: BLE001 - whatever it is, the file cannot be read
                failures.append(f"{path.name}, killed after {end:.3f} s: {error!r}")
    return lost, failures


def interrupt(
    name: str, moments: int, folder: Path, seed: int = 1
) -> tuple[Counter[str], list[str]]:
    """Send SIGINT, SIGTERM and SIGHUP in turn to a verb at random steps.

    Returns
    -------
    outcomes, failures
        How often it ended how, and what is wrong with what it left.
    """
    arguments, outputs = OUTPUTS[name]
    chance, steps = np.random.default_rng(seed), _count_steps(name, folder)
    outcomes, failures = Counter[str](), []
    for number in range(moments):
        step = int(chance.integers(steps))
        which = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)[number % 3]
        place = folder / f"{name} {number}".replace(" ", "_")
        ending = _run_child(partial(_traced, arguments, step, which), place)
        faults = _faults(ending, outputs, place)
        if ending.code not in (ExitCode.OK, ExitCode.INTERRUPTED):
            faults.append(f"exit code {ending.code}: {ending.errors[-300:]}")
        failures += [f"{name}, {which.name} at step {step} of {steps}: {text}" for text in faults]
        kept = "whole" if outputs[0] in ending.files else "nothing left"
        outcomes[f"exit code {ending.code}, {kept}"] += 1
    return outcomes, failures


def fill_disk(name: str, sizes: int, folder: Path, seed: int = 1) -> tuple[Counter[str], list[str]]:
    """Run a verb on disks of random sizes that are too small for its outputs.

    Returns
    -------
    outcomes, failures
        How often it ended how, and what is wrong with what it left.
    """
    arguments, outputs = OUTPUTS[name]
    whole = folder / f"{name} whole".replace(" ", "_")
    _run_child(partial(_main, arguments), whole)
    size = sum((whole / output).stat().st_size for output in outputs)
    chance = np.random.default_rng(seed)
    outcomes, failures = Counter[str](), []
    for number in range(sizes):
        space = int(size * chance.uniform(0.0, 0.95))
        place = folder / f"{name} full {number}".replace(" ", "_")
        with _small_disk(place, space) as limit:
            ending = _run_child(partial(_limited, arguments, limit), place)
            faults = _faults(ending, outputs, place)
            lines = [line for line in ending.errors.splitlines() if "shiplog: " in line]
            if ending.code != ExitCode.FAILURE or len(lines) != 1:  # Rerun adds its own
                faults.append(f"exit code {ending.code}: {ending.errors[-300:]}")
            kept = "readable remainder" if "out.mcap.part" in ending.files else "nothing left"
        failures += [f"{name}, disk of {space} bytes: {text}" for text in faults]
        outcomes[f"exit code {ending.code}, {kept}"] += 1
    return outcomes, failures


# ---- the recorder that is killed


class _Steady:
    """A transport that sends the numbers from 0 on, `RATE_HZ` a second."""

    address, lost = "a steady sensor", 0

    def __init__(self, clock: ReceptionClock) -> None:
        self._clock, self._count = clock, 0

    def open(self) -> None:
        self._start = time.monotonic()

    def receive(self, timeout_secs: float) -> list[Packet]:
        time.sleep(max(0.0, min(timeout_secs, self._due() - time.monotonic())))
        packets = []
        while self._due() <= time.monotonic():
            packets.append(Packet(b"%d" % self._count, self._clock.now_ns()))
            self._count += 1
        return packets

    def close(self) -> None:
        pass

    def _due(self) -> float:
        return self._start + self._count / RATE_HZ


class _Numbers:
    """A decoder of numbers, as revolutions."""

    def __init__(self) -> None:
        self.counts = StreamCounts()

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        for packet in batch:
            samples.add("rpm", "sensor", float(packet.data), packet.received_ns)
            self.counts.accept("number")

    def finish(self, samples: SampleBuffer) -> None:
        pass


def _record_live(path: Path) -> int:
    clock = ReceptionClock()
    live = LiveStream(_Steady(clock), clock, "sensor")
    stream = StreamSource("sensor", "numbers", waiting_packets(live), _Numbers(), keep_raw=True)
    record(LiveSource([LiveInput(live, stream)], clock), path)
    return 0


def _lost_secs(path: Path, killed_ns: int) -> float:
    """Return how much of the end of a killed recording is missing, s."""
    rpm = read(path.with_name(path.name + ".part"))["rpm"]
    np.testing.assert_array_equal(rpm.values, np.arange(len(rpm)))
    return float(killed_ns - int(rpm.received_ns[-1])) * 1e-9


# ---- children


def _main(arguments: Sequence[str]) -> int:
    """Run a command as the process of the command line does."""
    sys.argv = ["shiplog", *arguments]
    return main()


def _limited(arguments: Sequence[str], limit: int | None) -> int:
    if limit is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    return _main(arguments)


def _traced(arguments: Sequence[str], step: int, number: int) -> int:
    """Run a command, and send it a signal at one of its steps; count them where none has it."""
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
    code = _main(arguments)
    sys.settrace(None)
    if number == 0:
        Path("steps").write_text(str(count), encoding="utf-8")
    return code


MOUNT, UMOUNT = shutil.which("mount") or "mount", shutil.which("umount") or "umount"
CONTEXTLIB = contextmanager.__code__.co_filename


def _count_steps(name: str, folder: Path) -> int:
    place = folder / f"{name} steps".replace(" ", "_")
    ending = _run_child(partial(_traced, OUTPUTS[name][0], -1, 0), place)
    if ending.code != ExitCode.OK:
        raise SystemExit(f"{name} fails by itself: {ending.errors}")
    return int((place / "steps").read_text(encoding="utf-8"))


def _forked(work: Callable[[], int]) -> int:
    """Start a child that does some work, and return its process id."""
    child = os.fork()
    if child:
        return child
    try:
        code = int(work())
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    finally:
        os._exit(99)  # by an exception


def _run_child(work: Callable[[], int], place: Path) -> Ending:
    """Run some work in a folder to its end."""
    place.mkdir(exist_ok=True)
    errors = place.with_name(place.name + ".err")

    def in_place() -> int:
        signal.alarm(MAX_CHILD_SECS)
        os.chdir(place)
        stderr = os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(stderr, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        # the command makes streams of its own, after which the end of these closes nothing
        sys.stdout, sys.stderr = (os.fdopen(each, "w", closefd=False) for each in (1, 2))
        return work()

    _, status = os.waitpid(_forked(in_place), 0)
    files = frozenset(file.name for file in place.iterdir()) - {"steps"}
    text = errors.read_text(encoding="utf-8")
    return Ending(os.waitstatus_to_exitcode(status), text, files)


@contextmanager
def _small_disk(place: Path, space: int) -> Iterator[int | None]:
    """Make a folder a disk of some size, and yield None; else the limit of the size of a file."""
    place.mkdir()
    mount = [MOUNT, "-t", "tmpfs", "-o", f"size={max(space, 4096)}", "tmpfs", os.fspath(place)]
    mounted = subprocess.run(mount, check=False, stderr=subprocess.DEVNULL).returncode == 0
    try:
        yield None if mounted else space
    finally:
        if mounted:
            subprocess.run([UMOUNT, os.fspath(place)], check=True)


def _faults(ending: Ending, outputs: Sequence[str], place: Path) -> list[str]:
    """Return what is wrong with the files that a child has left."""
    allowed = {*outputs, "out.mcap.part"} if ending.code == ExitCode.FAILURE else set(outputs)
    faults = [f"left {file}" for file in ending.files - allowed]
    for output in ending.files & {*outputs, "out.mcap.part"}:
        try:
            _require_whole(place / output)
        except Exception as error:  # noqa: BLE001 - whatever it is, the file is not whole
            faults.append(f"{output}: {error!r}")
    if "Traceback" in ending.errors:
        faults.append(f"a traceback: {ending.errors[-600:]}")
    return faults


def _require_whole(path: Path) -> None:
    """Raise an exception where a file is not whole, or a remainder is not readable."""
    if path.suffix == ".part":
        read(path)
    elif path.suffix == ".mcap":
        if warnings := [text for text in read(path).warnings if "finished" in text]:
            raise ValueError("; ".join(warnings))
    elif path.suffix == ".csv":
        if not path.read_text(encoding="utf-8").endswith("# end\n"):
            raise ValueError("cut off")
    elif path.suffix == ".json":
        json.loads(path.read_text(encoding="utf-8"))
    else:
        from rerun.chunk import RrdReader  # noqa: PLC0415 - takes long to import

        if not any(chunk.entity_path == "/summary" for chunk in RrdReader(path).stream()):
            raise ValueError("no summary")


def warm_up(folder: Path, verbs: Iterable[str] = OUTPUTS) -> None:
    """Run verbs once, so that the children find all libraries imported and loops compiled."""
    before = Path.cwd()
    os.chdir(folder)
    for arguments, outputs in (OUTPUTS[verb] for verb in verbs):
        own = list(arguments)
        if "out.rrd" in outputs:  # Rerun's threads do not survive a fork
            import_module("analysis.view.replay_review")
            own = [a for a in arguments if a not in ("-o", "out.rrd")]
        with redirect_stdout(StringIO()):
            main(own)
        for output in outputs:
            Path(output).unlink(missing_ok=True)
    os.chdir(before)


def _report(what: str, outcomes: Counter[str], failures: list[str]) -> bool:
    counts = "; ".join(f"{count}: {outcome}" for outcome, count in sorted(outcomes.items()))
    print(f"{what}: {counts}; {len(failures)} failures", flush=True)
    for failure in failures:
        print(f"  {failure}")
    return not failures


def run(moments: int, sizes: int) -> bool:
    """Run all trials, print what came of them, and return whether all is as it must be."""
    good = True
    with TemporaryDirectory(prefix="shiplog-survival-") as name:
        folder = Path(name)
        warm_up(folder)
        lost, failures = kill_recordings(moments, folder)
        failures += [f"{secs:.3f} s were lost" for secs in lost if secs > 1.0]
        longest = f"read, at most {max(lost):.3f} s lost" if lost else "none read"
        good &= _report("kill -9 while recording", Counter({longest: len(lost)}), failures)
        for verb in OUTPUTS:
            good &= _report(f"signals in {verb}", *interrupt(verb, moments, folder))
            good &= _report(f"full disk in {verb}", *fill_disk(verb, sizes, folder))
    return good


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--sizes", type=int, default=100)
    options = parser.parse_args()
    raise SystemExit(0 if run(options.moments, options.sizes) else 1)

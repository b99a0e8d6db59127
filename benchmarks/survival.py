"""What recordings and outputs survive: killed processes, signals at any step, full disks.

    python -m benchmarks.survival                # 200 moments and 100 sizes each, about an hour
    python -m benchmarks.survival --moments 20 --sizes 10 --only recordings replay

Each trial is a child of this process, forked when all libraries are imported, that runs a command
in a folder of its own. Signals strike live recordings at random moments, and verbs at random steps
of the program, counted line by line. A full disk is a small tmpfs where one can be mounted, else a
limit of the size of files. Every other output has an older file under its name. The exit code is 1
where a file was not what it must be.
"""

import argparse
import os
import signal
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from shiplog import read
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode

from .ended_recordings import end_recordings, start_together
from .forked_trials import PROJECT, Ending, run_child, run_limited, run_traced, small_disk

SAMPLES = PROJECT / "sample_data"
LINKS = {  # files of every trial's folder, by name
    "trial.mcap": SAMPLES / "zigzag_20_20.mcap",
    "trial.ref.mcap": SAMPLES / "zigzag_20_20.ref.mcap",
    "new.mcap": SAMPLES / "zigzag_20_20.mcap",  # a log without a reference
    "changed.mcap": SAMPLES / "turning_circle_35.mcap",  # with the reference of another log
    "changed.ref.mcap": SAMPLES / "zigzag_20_20.ref.mcap",
    "ship.nmea": SAMPLES / "ship.nmea",
    "bridge.csv": SAMPLES / "bridge.csv",
    "system.toml": PROJECT / "examples" / "systems" / "heading_regulator.toml",
}
PAIRS = 300
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)
OLDER = b"an older file\n"
UNFINISHED = "out.mcap.part"


@dataclass(frozen=True)
class Command:
    """A command and what it writes.

    Attributes
    ----------
    arguments
        Of the command line.
    outputs
        The names of the files it writes.
    code
        Its exit code where nothing goes wrong.
    """

    arguments: tuple[str, ...]
    outputs: tuple[str, ...]
    code: ExitCode = ExitCode.OK


def _command(line: str, *outputs: str, code: ExitCode = ExitCode.OK) -> Command:
    return Command(tuple(line.split()), outputs, code)


COMMANDS = {  # a further verb is a further row
    "record": _command("record nmea0183 ship.nmea --raw -o out.mcap", "out.mcap"),
    "convert": _command("convert trial.mcap out.mcap", "out.mcap"),
    "convert to csv": _command("convert trial.mcap out.csv", "out.csv"),
    "convert to parquet": _command("convert trial.mcap out.parquet", "out.parquet"),
    "info": _command("info trial.mcap --json out.json", "out.json"),
    "replay": _command(
        "replay trial.mcap -o out.rrd --json out.json", "out.rrd", "out.json"
    ),
    "identify": _command(
        "identify trial.mcap --model nomoto -o out.toml --review out.rrd --json out.json",
        "out.toml", "out.rrd", "out.json",
    ),
    "estimate": _command(
        "estimate trial.mcap --system system.toml -o out.rrd --json out.json",
        "out.rrd", "out.json",
    ),
    "check": _command("check trial.mcap --json out.json", "out.json"),
    "check that fails": _command(
        "check changed.mcap", "changed.check.rrd", code=ExitCode.FAILURE
    ),
    "check --update": _command("check new.mcap --update", "new.ref.mcap"),
    "report": _command(
        "report trial.mcap -o out.html --json out.json", "out.html", "out.json"
    ),
    "view": _command("view trial.mcap -o out.rrd", "out.rrd"),
    "convert to kml": _command("convert raw.mcap out.kml", "out.kml"),
    "layout": _command("layout bridge.csv -o out.toml", "out.toml"),
    "decode": _command("decode raw.mcap -o out.mcap", "out.mcap"),
    "recover": _command("recover cut.mcap -o out.mcap", "out.mcap", code=ExitCode.DATA_LOST),
}  # fmt: skip


def make_inputs(folder: Path) -> None:
    """Write the inputs of the commands that are no samples to a folder, and link the others."""
    _link_inputs(folder)
    whole = LINKS["trial.mcap"].read_bytes()
    (folder / "cut.mcap").write_bytes(whole[: len(whole) * 2 // 3])
    with redirect_stdout(StringIO()):
        main(
            [
                "record",
                "nmea0183",
                str(folder / "ship.nmea"),
                "--raw",
                "-o",
                str(folder / "raw.mcap"),
            ]
        )


def interrupt(
    name: str, moments: int, folder: Path, seed: int = 1
) -> tuple[Counter[str], list[str]]:
    """Send SIGINT, SIGTERM, SIGHUP and SIGKILL in turn to a command at random steps.

    Returns
    -------
    outcomes, failures
        How often it ended how, and what is wrong with what it wrote.
    """
    command = COMMANDS[name]
    chance, outcomes, failures = np.random.default_rng(seed), Counter[str](), []
    whole = _undisturbed(name, folder)
    steps = int((whole / "steps").read_text(encoding="utf-8"))
    for number in range(moments):
        step = int(chance.integers(steps))
        which = SIGNALS[number % len(SIGNALS)]
        place = _place(folder, name, f"signal {number}")
        place.mkdir()
        _prepare(place, command, number)
        ending = run_child(partial(run_traced, command.arguments, step, which), place)
        is_complete = ending.code == command.code
        faults = _faults(ending, command, place, whole, is_complete=is_complete)
        if ending.code not in (command.code, ExitCode.INTERRUPTED, -signal.SIGKILL):
            faults.append(f"exit code {ending.code}: {ending.errors[-300:]}")
        failures += [f"{name}, {which.name} at step {step} of {steps}: {text}" for text in faults]
        outcomes[f"exit code {ending.code}, {_kept(ending, command, place)}"] += 1
    return outcomes, failures


def fill_disk(name: str, sizes: int, folder: Path, seed: int = 1) -> tuple[Counter[str], list[str]]:
    """Run a command on disks of random sizes that are too small for its outputs.

    Returns
    -------
    outcomes, failures
        How often it ended how, and what is wrong with what it wrote.
    """
    command = COMMANDS[name]
    whole = _undisturbed(name, folder)
    size = sum((whole / output).stat().st_size for output in command.outputs)
    chance = np.random.default_rng(seed)
    outcomes, failures = Counter[str](), []
    for number in range(sizes):
        space = int(size * chance.uniform(0.0, 0.95))
        place = _place(folder, name, f"full {number}")
        with small_disk(place, space) as limit:
            _prepare(place, command, number)
            ending = run_child(partial(run_limited, command.arguments, limit), place)
            faults = _faults(ending, command, place, whole, is_complete=False)
            lines = [line for line in ending.errors.splitlines() if "shiplog: " in line]
            if ending.code != ExitCode.FAILURE or len(lines) != 1:  # beside warnings
                faults.append(f"exit code {ending.code}: {ending.errors[-300:]}")
            outcomes[f"exit code {ending.code}, {_kept(ending, command, place)}"] += 1
        failures += [f"{name}, disk of {space} bytes: {text}" for text in faults]
    return outcomes, failures


def warm_up(folder: Path, names: Iterable[str] = COMMANDS) -> None:
    """Run commands once, so that the children find all libraries imported and loops compiled."""
    before = Path.cwd()
    os.chdir(folder)
    for command in (COMMANDS[name] for name in names):
        own = list(command.arguments)
        if "out.rrd" in own:  # Rerun must not have threads before the fork
            import_module("analysis.view.replay_review")
            at = own.index("out.rrd")
            del own[at - 1 : at + 1]
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            main(own)
        for output in command.outputs:
            Path(output).unlink(missing_ok=True)
    os.chdir(before)


def _place(folder: Path, name: str, trial: str) -> Path:
    return folder / f"{name} {trial}".replace(" ", "_")


def _link_inputs(place: Path) -> None:
    for name, target in LINKS.items():
        (place / name).symlink_to(target)
    for name in ("raw.mcap", "cut.mcap"):
        if not (place / name).exists() and (place.parent / name).exists():
            (place / name).symlink_to(place.parent / name)


def _prepare(place: Path, command: Command, number: int) -> None:
    """Link the inputs of a trial; every other trial has older files where the outputs go."""
    _link_inputs(place)
    if number % 2:
        try:
            for output in command.outputs:
                (place / output).write_bytes(OLDER)
        except OSError:  # the disk is too small even for these
            pass


def _undisturbed(name: str, folder: Path) -> Path:
    """Run a command without a disturbance, count its steps, and return its folder."""
    place = _place(folder, name, "undisturbed")
    if not place.exists():
        place.mkdir()
        _link_inputs(place)
        ending = run_child(partial(run_traced, COMMANDS[name].arguments, -1, 0), place)
        if ending.code != COMMANDS[name].code:
            raise SystemExit(f"{name} fails by itself: {ending.errors}")
    return place


def _kept(ending: Ending, command: Command, place: Path) -> str:
    """Return what there is after a trial, in words; of several outputs, of the first one."""
    if UNFINISHED in ending.files:
        return "readable remainder"
    first = place / command.outputs[0]
    if not first.exists():
        return "nothing"
    return "the older file" if first.read_bytes() == OLDER else "a whole file"


def _faults(
    ending: Ending, command: Command, place: Path, whole: Path, *, is_complete: bool
) -> list[str]:
    """Return what is wrong with the files in a folder, compared with those of a whole run."""
    allowed = {*command.outputs}
    if ending.code in (ExitCode.FAILURE, -signal.SIGKILL):
        allowed.add(UNFINISHED)
    if ending.code == -signal.SIGKILL:  # the next run takes these over
        allowed |= {f".{output}.part" for output in command.outputs}
    faults = [f"there is a file {file}" for file in ending.files - allowed]
    for output in ending.files & {*command.outputs, UNFINISHED}:
        try:
            _require_whole(place / output, whole / output, is_complete=is_complete)
        except Exception as error:  # noqa: BLE001 - whatever it is, the file is not whole
            faults.append(f"{output}: {error!r}")
    if "Traceback" in ending.errors:
        faults.append(f"a traceback: {ending.errors[-600:]}")
    return faults


def _require_whole(path: Path, undisturbed: Path, *, is_complete: bool) -> None:
    """Raise an exception where an output is not whole.

    Parameters
    ----------
    path
        The output.
    undisturbed
        The same output of a command that nothing disturbed.
    is_complete
        Whether the command ended well. Else its output may be an older file, or a recording that
        ends early.
    """
    if path.name == UNFINISHED:
        read(path)
    elif path.read_bytes() == OLDER:
        if is_complete:
            raise ValueError("the older file")
    elif path.suffix == ".mcap" and not is_complete:
        if warnings := [text for text in read(path).warnings if "finished" in text]:
            raise ValueError("; ".join(warnings))
    elif _content(path) != _undisturbed_content(undisturbed):
        raise ValueError("not what the undisturbed command writes")


@cache
def _undisturbed_content(path: Path) -> object:
    return _content(path)


def _content(path: Path) -> object:
    """Return what must be the same in the outputs of two runs."""
    if path.suffix == ".mcap":
        log = read(path)
        return log.warnings, [
            (c.topic, c.received_ns.tobytes(), c.values.tobytes()) for c in log.channels
        ]
    if path.suffix == ".rrd":
        from rerun.chunk import RrdReader  # noqa: PLC0415 - takes long to import

        return sorted((c.entity_path, c.num_rows) for c in RrdReader(path).stream())
    return path.read_bytes()


def _report(what: str, outcomes: Counter[str], failures: list[str]) -> bool:
    counts = "; ".join(f"{count}: {outcome}" for outcome, count in sorted(outcomes.items()))
    print(f"{what}: {counts}; {len(failures)} failures", flush=True)
    for failure in failures:
        print(f"  {failure}")
    return not failures


def run(moments: int, sizes: int, only: Sequence[str]) -> bool:
    """Run trials, print what came of them, and return whether all is as it must be."""
    good = True
    with TemporaryDirectory(prefix="shiplog-survival-") as name:
        folder = Path(name)
        names = [name for name in COMMANDS if name in only]
        make_inputs(folder)
        warm_up(folder, names)
        if "recordings" in only:
            for number in (signal.SIGKILL, signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                lost, failures = end_recordings(number, moments, folder)
                longest = f"read, at most {max(lost):.3f} s lost" if lost else "none read"
                good &= _report(
                    f"{number.name} while recording", Counter({longest: len(lost)}), failures
                )
        if "pairs" in only:
            failures = start_together(PAIRS, folder)
            right = Counter({"one log by one recorder": PAIRS - len(failures)})
            good &= _report("two recorders on one name", right, failures)
        for verb in names:
            good &= _report(f"full disk in {verb}", *fill_disk(verb, sizes, folder))
            good &= _report(f"signals in {verb}", *interrupt(verb, moments, folder))
    return good


if __name__ == "__main__":
    everything = ["recordings", "pairs", *COMMANDS]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--sizes", type=int, default=100)
    parser.add_argument("--only", nargs="+", choices=everything, default=everything)
    options = parser.parse_args()
    raise SystemExit(0 if run(options.moments, options.sizes, options.only) else 1)

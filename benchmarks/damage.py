"""Damaged logs: `python -m benchmarks.damage` reads some 30,000 variants of a small one.

The file of several MCAP chunks is cut at every byte, one bit of every byte is inverted, 10,000
random bursts are put into it, and its MCAP chunks are reordered and repeated. Each variant is read
whole, in part and chunk by chunk, and recovered. No exception but a refusal in one line, no wrong
value without a warning, no intact MCAP chunk lost, and not more than 5 s: the exit code is 1 where
one of these fails. The tests do the same with a sample. The table that it prints, also of what the
Python reader of the library mcap does with the same files, is in docs/reliability.md.
"""

import argparse
import itertools
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from io import BytesIO
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from mcap.reader import make_reader

import shiplog.mcap.stream
from shiplog import LogError, TrialLog, open_log, read
from shiplog.mcap.recover import recover
from shiplog.types import Channel, concatenate_channels

from .damaged_files import (
    CHUNKS,
    SAMPLES,
    START_NS,
    Variant,
    bursts,
    cuts,
    flips,
    orders,
    write_log,
)

MAX_SECS = 5.0
MIDDLE_NS = START_NS + CHUNKS * SAMPLES * 50_000_000
T = TypeVar("T")
Rows = dict[str, list[tuple[int, int, bytes]]]  # times of reception and measurement, values


@dataclass(frozen=True)
class Outcome:
    """What became of a variant.

    Attributes
    ----------
    way, place
        Of the variant.
    result
        ``whole``, ``part`` with a warning, or ``refused``.
    by_mcap
        What the Python reader of mcap did: ``whole``, ``error``, or ``silent``: messages are
        missing or wrong without an error.
    errors
        What is wrong with our own result, in words.
    """

    way: str
    place: str
    result: str
    by_mcap: str
    errors: tuple[str, ...] = ()


@cache
def original() -> tuple[bytes, TrialLog]:
    """Return the undamaged file and its log."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trial.mcap"
        return write_log(path), read(path)


def judge(variant: Variant, path: Path) -> Outcome:
    """Read a variant in every way.

    Parameters
    ----------
    variant
        The damaged file.
    path
        Where to write it.
    """
    path.write_bytes(variant.data)
    errors: list[str] = []
    log = _attempt("whole", lambda: read(path), errors)
    if log is not None:
        errors += _errors("whole", log, variant)
    for name, options in _PARTS.items():
        part = _attempt(name, partial(read, path, **options), errors)
        if part is not None and log is not None and not _is_part(part, log, options):
            errors.append(f"{name}: not the part of the whole")
    by_chunks = _attempt("chunks", lambda: _read_by_chunks(path), errors)
    if by_chunks is not None and log is not None and _rows(by_chunks) != _rows(log):
        errors.append("chunks: not the samples of the whole")
    recovered = _attempt("recover", lambda: _recovered(path), errors)
    if recovered is not None and log is not None and _rows(recovered) != _rows(log):
        errors.append("recover: not the samples of the whole")
    result = "refused" if log is None else "whole" if not _missing(log) else "part"
    return Outcome(variant.way, variant.place, result, _by_mcap(path), tuple(errors))


_PARTS: dict[str, dict[str, Any]] = {
    "one channel": {"channels": ["yaw_rate"]},
    "second half": {"start_ns": MIDDLE_NS},
    "one channel, first half": {"channels": ["speed"], "end_ns": MIDDLE_NS},
}


def _attempt(name: str, action: Callable[[], T], errors: list[str]) -> T | None:
    """Return what an action returns; None if it refuses, or fails, which is an error."""
    start = time.monotonic()
    try:
        return action()
    except LogError as error:
        if "\n" in str(error):
            errors.append(f"{name}: a refusal of more than one line")
    except Exception as error:  # noqa: BLE001 - this is what must not happen
        errors.append(f"{name}: {type(error).__name__}: {error}")
    finally:
        if time.monotonic() - start > MAX_SECS:
            errors.append(f"{name}: more than {MAX_SECS} s")
    return None


def _errors(name: str, log: TrialLog, variant: Variant) -> Iterator[str]:
    """Yield what is wrong with a log that was read whole."""
    rows, expected = _rows(log), _rows(original()[1])
    for topic, samples in rows.items():
        rest = iter(expected.get(topic, []))
        if not all(sample in rest for sample in samples):
            yield f"{name}: samples of {topic} that were not recorded"
    is_stated = bool(log.warnings)
    if _missing(log) and not is_stated:
        yield f"{name}: samples are missing without a warning"
    if log.vessel_toml != original()[1].vessel_toml and not (log.vessel_toml is None and is_stated):
        yield f"{name}: a wrong vessel file"
    if not log.metadata.items() <= original()[1].metadata.items():
        yield f"{name}: wrong metadata"
    if log.metadata != original()[1].metadata and not is_stated:
        yield f"{name}: metadata are missing without a warning"
    for topic, samples in expected.items():
        per_chunk = len(samples) // CHUNKS
        read_rows = set(rows.get(topic, []))
        for number in variant.intact:
            if not read_rows.issuperset(samples[number * per_chunk : (number + 1) * per_chunk]):
                yield f"{name}: the intact MCAP chunk {number} was not read"


def _missing(log: TrialLog) -> bool:
    return _rows(log) != _rows(original()[1]) or log.events != original()[1].events


def _rows(log: TrialLog) -> Rows:
    return {
        channel.topic: list(
            zip(
                channel.received_ns.tolist(),
                channel.measured_ns.tolist(),
                map(bytes, channel.values.reshape(len(channel), -1)),
                strict=True,
            )
        )
        for channel in log.channels
        if len(channel)
    }


def _is_part(part: TrialLog, log: TrialLog, options: dict[str, Any]) -> bool:
    """Whether a part has the samples that the whole log has of it."""
    start, end = options.get("start_ns", 0), options.get("end_ns", 2**63)
    names = options.get("channels")
    expected = {
        topic: selected
        for topic, samples in _rows(log).items()
        if names is None or topic.split("/")[1] in names
        if (selected := [sample for sample in samples if start <= sample[0] < end])
    }
    return _rows(part) == expected and part.vessel_toml == log.vessel_toml


def _read_by_chunks(path: Path) -> TrialLog:
    """Read a log as one that is longer than memory."""
    limit = shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY
    shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY = 10
    try:
        log = open_log(path)
        chunks = list(log.chunks())
    finally:
        shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY = limit
    channels: list[list[Channel]] = [list(parts) for parts in zip(*chunks, strict=True)]
    return TrialLog(path.name, tuple(map(concatenate_channels, channels)))


def _recovered(path: Path) -> TrialLog:
    target = path.with_suffix(".good.mcap")
    recover(path, target)
    return read(target)


def _by_mcap(path: Path) -> str:
    """Return what the Python reader of mcap does with a file."""
    whole = original()[0]
    try:
        content = _content_by_mcap(path.read_bytes())
    except Exception:  # noqa: BLE001 - it raises whatever its parsers do
        return "error"
    return "whole" if content == _content_by_mcap(whole) else "silent"


def _content_by_mcap(data: bytes) -> list[object]:
    """Return the messages, attachments and metadata that the reader of mcap finds in a file."""
    reader = make_reader(BytesIO(data), validate_crcs=True)
    messages = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()]
    return [*messages, *reader.iter_attachments(), *reader.iter_metadata()]


def variants(step: int, count: int) -> Iterator[Variant]:
    """Yield all variants: of cuts and bits every `step`-th, and `count` bursts."""
    data = original()[0]
    yield from itertools.chain(
        cuts(data, step), flips(data, step), bursts(data, count), orders(data)
    )


def judge_share(shares: int, step: int, count: int, number: int) -> list[Outcome]:
    """Judge every variant whose place is `number` modulo `shares`, in this process."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "damaged.mcap"
        mine = itertools.islice(variants(step, count), number, None, shares)
        return [judge(variant, path) for variant in mine]


def table(outcomes: Iterable[Outcome]) -> str:
    """Return the counts by way and kind of record, as Markdown."""
    counts: dict[tuple[str, str], Counter[str]] = {}
    for outcome in outcomes:
        row = counts.setdefault((outcome.way, outcome.place), Counter())
        row.update([outcome.result, f"mcap {outcome.by_mcap}", "files"])
        row["errors"] += bool(outcome.errors)
    columns = ("files", "whole", "part", "refused", "errors",
               "mcap whole", "mcap error", "mcap silent")  # fmt: skip
    lines = [f"| damage | in | {' | '.join(columns)} |", f"|---|---|{'---|' * len(columns)}"]
    for (way, place), row in sorted(counts.items()):
        lines.append(f"| {way} | {place} | {' | '.join(str(row[name]) for name in columns)} |")
    return "\n".join(lines)


def main() -> int:
    """Judge all variants on all processors, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--step", type=int, default=1, help="of the bytes that are cut or changed")
    parser.add_argument("--bursts", type=int, default=10_000)
    arguments = parser.parse_args()
    shares = 4 * (os.cpu_count() or 1)
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        share = partial(judge_share, shares, arguments.step, arguments.bursts)
        outcomes = [outcome for part in pool.map(share, range(shares)) for outcome in part]
    print(table(outcomes))
    wrong = Counter(
        f"{outcome.way} in {outcome.place}: {error}"
        for outcome in outcomes
        for error in outcome.errors
    )
    for text, count in wrong.most_common(40):
        print(f"{count:6d}  {text}", file=sys.stderr)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())

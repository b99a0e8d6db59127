"""A replay against its reference: the regression check.

The reference of `zigzag.mcap` is `zigzag.ref.mcap` beside it: a log of what the replay found,
in blocks of four seconds and in the order in which it is found, so that the first channel that
differs is where to look. Each carries its own tolerance, in its own unit.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from analysis.replay.replay import analyse
from shiplog import Channel, ShiplogError, TrialLog, Vessel, read, write

from .reference import make_reference

SUFFIX = ".ref.mcap"
NOT_LOGS = (SUFFIX, ".truth.mcap")


@dataclass(frozen=True)
class Difference:
    """How one channel of a replay differs from its reference."""

    topic: str
    unit: str
    tolerance: float
    largest: float
    rms: float
    first_secs: float | None  # where it first leaves the tolerance, since the replay's start
    fault: str = ""  # what is wrong beyond values: missing, other times, other gaps

    @property
    def ok(self) -> bool:
        """Whether the channel is as it was."""
        return not self.fault and self.first_secs is None


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """A replay laid beside its reference; its repr, which pytest shows, is what it says."""

    name: str
    differences: tuple[Difference, ...]
    problem: str = ""  # why there was nothing to compare
    replay: TrialLog | None = None
    reference: TrialLog | None = None

    @property
    def ok(self) -> bool:
        """Whether the replay is as it was."""
        return not self.problem and all(difference.ok for difference in self.differences)

    @property
    def changed(self) -> tuple[Difference, ...]:
        """The channels that differ, the first to be computed first."""
        return tuple(difference for difference in self.differences if not difference.ok)

    def __repr__(self) -> str:
        """One line if all is well, else a line for each channel that differs."""
        if self.ok:
            return f"{self.name}: as it was ({len(self.differences)} channels)"
        if self.problem:
            return f"{self.name}: {self.problem}"
        lines = [f"{self.name}: {len(self.changed)} of {len(self.differences)} channels differ"]
        lines += [f"  {d.topic}: {describe(d)}" for d in self.changed]
        return "\n".join(lines)


def comparison_json(comparison: Comparison) -> dict[str, object]:
    """The comparison as plain values; a largest difference that is no number is None."""
    return {
        "log": comparison.name,
        "ok": comparison.ok,
        "problem": comparison.problem or None,
        "channels": [
            {
                "topic": d.topic,
                "unit": d.unit,
                "ok": d.ok,
                "tolerance": d.tolerance if isfinite(d.tolerance) else None,
                "largest": d.largest if isfinite(d.largest) else None,
                "rms": d.rms if isfinite(d.rms) else None,
                "first_secs": d.first_secs,
                "fault": d.fault or None,
            }
            for d in comparison.differences
        ],
    }


def describe(difference: Difference) -> str:
    """A difference in words."""
    if difference.fault:
        return difference.fault
    said = (
        f"largest {difference.largest:.3g}, rms {difference.rms:.3g}, "
        f"allowed {difference.tolerance:.3g} {difference.unit}"
    )
    if difference.first_secs is not None:
        said += f"; first at {difference.first_secs:.1f} s"
    return said


def logs_in(path: Path) -> list[Path]:
    """The log itself, or the logs of a folder without references and truths.

    Raises `ShiplogError` where there is none, or a reference without its log.
    """
    if not path.exists():
        raise ShiplogError(f"no such file or folder: {path}")
    if not path.is_dir():
        return [path]
    logs = sorted(p for p in path.glob("*.mcap") if not p.name.endswith(NOT_LOGS))
    if not logs:
        raise ShiplogError(f"no logs (*.mcap) in the folder; name one that has some: {path}")
    orphans = set(path.glob(f"*{SUFFIX}")) - {reference_path(log) for log in logs}
    if orphans:
        names = ", ".join(sorted(ref.name for ref in orphans))
        raise ShiplogError(f"references whose logs are gone ({names}); delete them: {path}")
    return logs


def reference_path(log: Path) -> Path:
    """Where the reference of a log lies."""
    return log.with_name(log.name.removesuffix(".mcap") + SUFFIX)


def compare(
    log: str | os.PathLike[str] | TrialLog,
    reference: str | os.PathLike[str] | TrialLog | None = None,
    *,
    vessel: Vessel | None = None,
) -> Comparison:
    """Replay a log and compare it with its reference, channel by channel.

    The reference is the file beside the log unless given. A log that does not replay, or has no
    reference, is a comparison that is not `ok`; its `problem` says why.
    """
    name, replay = log.name if isinstance(log, TrialLog) else Path(log).name, None
    try:
        trial = log if isinstance(log, TrialLog) else read(log)
        if trial.data_lost:
            raise ShiplogError(f"data were lost: {'; '.join(trial.warnings)}")
        replay = make_reference(analyse(trial, vessel))
        known = _reference(log if reference is None else reference, beside=reference is None)
    except ShiplogError as error:
        return Comparison(name, (), str(error), replay)
    return Comparison(name, _differences(replay, known), "", replay, known)


def _reference(where: str | os.PathLike[str] | TrialLog, *, beside: bool) -> TrialLog:
    """The reference itself, its file, or the one beside a log; `ShiplogError` if there is none."""
    if isinstance(where, TrialLog):
        if beside:
            raise ShiplogError("a log that is no file needs its reference given")
        known = where
    else:
        path = reference_path(Path(where)) if beside else Path(where)
        if beside and not path.exists():
            raise ShiplogError(
                f"has no reference; look at its replay, then run `shiplog check {where} --update`"
            )
        known = read(path)
    if "reference_of" not in known.metadata:
        raise ShiplogError(f"{known.name} is a log, not a reference; move it away")
    return known


def update(log: Path, comparison: Comparison) -> None:
    """Make a replay that was compared the reference of its log."""
    if comparison.replay is None:
        raise ShiplogError(f"nothing to keep of {comparison.name}: {comparison.problem}")
    write(comparison.replay, reference_path(log))


def _differences(replay: TrialLog, reference: TrialLog) -> tuple[Difference, ...]:
    now = {channel.topic: channel for channel in replay}
    before = {channel.topic: channel for channel in reference}
    start_ns, _ = reference.span_ns
    topics = [*now, *(topic for topic in before if topic not in now)]
    return tuple(_difference(topic, now, before, start_ns) for topic in topics)


def _difference(
    topic: str, now: Mapping[str, Channel], before: Mapping[str, Channel], start_ns: int
) -> Difference:
    if topic not in before:
        return _fault(now[topic], "is new: it is not in the reference")
    known = before[topic]
    if topic not in now:
        return _fault(known, "is gone: it is only in the reference")
    new = now[topic]
    if not np.array_equal(new.measured_ns, known.measured_ns):
        return _fault(known, f"has other times: {len(new)} against {len(known)} samples")
    missing, was_missing = np.isnan(new.values), np.isnan(known.values)
    if not np.array_equal(missing, was_missing):
        at = (known.measured_ns[np.flatnonzero(missing != was_missing)[0]] - start_ns) * 1e-9
        return _fault(
            known,
            f"has other gaps: {missing.sum()} values missing against {was_missing.sum()}, "
            f"first at {at:.1f} s",
        )
    tolerance = float(known.metadata["tolerance"])
    away = np.abs(new.values - known.values)[~missing]
    beyond = np.flatnonzero(away > tolerance)
    first = None
    if len(beyond):
        first = float((known.measured_ns[~missing][beyond[0]] - start_ns) * 1e-9)
    largest = float(np.max(away, initial=0.0))
    rms = float(np.sqrt(np.mean(away**2))) if len(away) else 0.0
    return Difference(topic, known.unit, tolerance, largest, rms, first)


def _fault(channel: Channel, fault: str) -> Difference:
    tolerance = float(channel.metadata.get("tolerance", "nan"))
    return Difference(channel.topic, channel.unit, tolerance, np.inf, np.inf, 0.0, fault)

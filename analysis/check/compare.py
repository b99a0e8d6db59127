"""The regression check: a replay compared with its reference, channel by channel.

The reference of `zigzag.mcap` is `zigzag.ref.mcap` beside it: a log of the replay's results, in
blocks of four seconds and in the order in which they are computed, so that the first channel that
differs is where to look. Each channel carries its own tolerance, in its own unit.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from shiplog import Channel, ShiplogError, TrialLog, Vessel, read, write

from .reference import make_reference

SUFFIX = ".ref.mcap"
NOT_LOGS = (SUFFIX, ".truth.mcap")


@dataclass(frozen=True)
class Difference:
    """The difference between one channel of a replay and that of its reference.

    Attributes
    ----------
    topic, unit
        The channel and its unit.
    tolerance
        The largest difference allowed, in `unit`.
    largest, rms
        The largest difference and the root mean square of all, in `unit`.
    first_secs
        The time of the first difference beyond the tolerance, s since the start of the replay; None
        where there is none.
    mismatch
        A difference other than of values: a missing channel, other times, other missing values.
    """

    topic: str
    unit: str
    tolerance: float
    largest: float
    rms: float
    first_secs: float | None
    mismatch: str = ""

    @property
    def ok(self) -> bool:
        """Whether the channels agree."""
        return not self.mismatch and self.first_secs is None

    def __str__(self) -> str:
        """The difference in words."""
        if self.mismatch:
            return self.mismatch
        text = (
            f"largest difference {self.largest:.3g}, rms {self.rms:.3g}, "
            f"tolerance {self.tolerance:.3g} {self.unit}"
        )
        return text if self.first_secs is None else f"{text}; first at {self.first_secs:.1f} s"


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """A replay compared with its reference; its repr, which pytest shows, is the report.

    Attributes
    ----------
    name
        The name of the log.
    differences
        One for each channel, in the order in which they are computed.
    error
        Why nothing was compared; empty where something was.
    replay, reference
        The results of the replay and the reference; None where there are none.
    """

    name: str
    differences: tuple[Difference, ...]
    error: str = ""
    replay: TrialLog | None = None
    reference: TrialLog | None = None

    @property
    def ok(self) -> bool:
        """Whether the replay agrees with its reference."""
        return not self.error and all(difference.ok for difference in self.differences)

    @property
    def changed(self) -> tuple[Difference, ...]:
        """The channels that differ, in the order in which they are computed."""
        return tuple(difference for difference in self.differences if not difference.ok)

    def __repr__(self) -> str:
        """One line where all channels agree, else a line for each that differs."""
        if self.error:
            return f"{self.name}: {self.error}"
        if self.ok:
            return f"{self.name}: agrees with its reference ({len(self.differences)} channels)"
        lines = [f"{self.name}: {len(self.changed)} of {len(self.differences)} channels differ"]
        lines += [f"  {difference.topic}: {difference}" for difference in self.changed]
        return "\n".join(lines)


def comparison_json(comparison: Comparison) -> dict[str, object]:
    """Return a comparison as plain values for JSON; a number that is not finite is None."""
    return {
        "log": comparison.name,
        "ok": comparison.ok,
        "error": comparison.error or None,
        "channels": [
            {
                "topic": d.topic,
                "unit": d.unit,
                "ok": d.ok,
                "tolerance": d.tolerance if isfinite(d.tolerance) else None,
                "largest": d.largest if isfinite(d.largest) else None,
                "rms": d.rms if isfinite(d.rms) else None,
                "first_secs": d.first_secs,
                "mismatch": d.mismatch or None,
            }
            for d in comparison.differences
        ],
    }


def logs_in(path: Path) -> list[Path]:
    """Return the log itself, or the logs of a folder without references and simulated truths.

    Raises
    ------
    ShiplogError
        Where there is no log, or a reference without its log.
    """
    if not path.exists():
        raise ShiplogError(f"no such file or folder: {path}")
    if not path.is_dir():
        return [path]
    logs = sorted(p for p in path.glob("*.mcap") if not p.name.endswith(NOT_LOGS))
    if not logs:
        raise ShiplogError(f"no logs (*.mcap) in this folder; give one that has some: {path}")
    orphans = set(path.glob(f"*{SUFFIX}")) - {reference_path(log) for log in logs}
    if orphans:
        names = ", ".join(sorted(reference.name for reference in orphans))
        raise ShiplogError(f"references without their logs ({names}); delete them: {path}")
    return logs


def reference_path(log: Path) -> Path:
    """Return the path of a log's reference.

    Examples
    --------
    >>> reference_path(Path("trials/zigzag.mcap")).as_posix()
    'trials/zigzag.ref.mcap'
    """
    return log.with_name(log.name.removesuffix(".mcap") + SUFFIX)


def compare(
    log: str | os.PathLike[str] | TrialLog,
    reference: str | os.PathLike[str] | TrialLog | None = None,
    *,
    vessel: Vessel | None = None,
) -> Comparison:
    """Replay a log and compare the results with its reference, channel by channel.

    A log that cannot be replayed, or has no reference, is a comparison that is not `ok`; its
    `error` states why.

    Parameters
    ----------
    log
        A log or its path.
    reference
        Its reference or the path of it; by default the file beside the log.
    vessel
        The vessel of the replay; by default the one attached to the log.

    Examples
    --------
    >>> compare("sample_data/zigzag_20_20.mcap")
    zigzag_20_20.mcap: agrees with its reference (98 channels)
    """
    name, replay = log.name if isinstance(log, TrialLog) else Path(log).name, None
    try:
        trial = log if isinstance(log, TrialLog) else read(log)
        if trial.data_lost:
            raise ShiplogError(f"data were lost: {'; '.join(trial.warnings)}")
        replay = make_reference(analyse(trial, ReadingOptions(vessel=vessel)))
        known = _reference(log if reference is None else reference, beside=reference is None)
    except ShiplogError as error:
        return Comparison(name, (), str(error), replay)
    return Comparison(name, _differences(replay, known), "", replay, known)


def _reference(where: str | os.PathLike[str] | TrialLog, *, beside: bool) -> TrialLog:
    """Return the reference given, or read its file, or the one beside a log."""
    if isinstance(where, TrialLog):
        if beside:
            raise ShiplogError("a log that is not a file needs its reference given")
        known = where
    else:
        path = reference_path(Path(where)) if beside else Path(where)
        if beside and not path.exists():
            raise ShiplogError(
                f"no reference; inspect its replay, then run `shiplog check {where} --update`"
            )
        known = read(path)
    if "reference_of" not in known.metadata:
        raise ShiplogError(f"{known.name} is a log, not a reference; move it elsewhere")
    return known


def update_reference(log: Path, comparison: Comparison) -> None:
    """Write the results of a replay that was compared as the new reference of its log."""
    if comparison.replay is None:
        raise ShiplogError(f"no results to keep of {comparison.name}: {comparison.error}")
    write(comparison.replay, reference_path(log))


def _differences(replay: TrialLog, reference: TrialLog) -> tuple[Difference, ...]:
    """Compare all channels: those of the replay in order, then those only in the reference."""
    now = {channel.topic: channel for channel in replay}
    before = {channel.topic: channel for channel in reference}
    start_ns, _ = reference.span_ns
    topics = [*now, *(topic for topic in before if topic not in now)]
    return tuple(_difference(topic, now, before, start_ns) for topic in topics)


def _difference(
    topic: str, now: Mapping[str, Channel], before: Mapping[str, Channel], start_ns: int
) -> Difference:
    """Compare times, then missing values, then values."""
    if topic not in before:
        return _mismatch(now[topic], "new: not in the reference")
    known = before[topic]
    if topic not in now:
        return _mismatch(known, "missing: only in the reference")
    new = now[topic]
    if not np.array_equal(new.measured_ns, known.measured_ns):
        return _mismatch(known, f"other times: {len(new)} samples, {len(known)} in the reference")
    missing, was_missing = np.isnan(new.values), np.isnan(known.values)
    if not np.array_equal(missing, was_missing):
        at = (known.measured_ns[np.flatnonzero(missing != was_missing)[0]] - start_ns) * 1e-9
        return _mismatch(
            known,
            f"other gaps: {missing.sum()} values missing, {was_missing.sum()} in the reference; "
            f"first at {at:.1f} s",
        )
    tolerance = float(known.metadata["tolerance"])
    distance = np.abs(new.values - known.values)[~missing]
    beyond = np.flatnonzero(distance > tolerance)
    first = None
    if len(beyond):
        first = float((known.measured_ns[~missing][beyond[0]] - start_ns) * 1e-9)
    largest = float(np.max(distance, initial=0.0))
    rms = float(np.sqrt(np.mean(distance**2))) if len(distance) else 0.0
    return Difference(topic, known.unit, tolerance, largest, rms, first)


def _mismatch(channel: Channel, text: str) -> Difference:
    tolerance = float(channel.metadata.get("tolerance", "nan"))
    return Difference(channel.topic, channel.unit, tolerance, np.inf, np.inf, 0.0, text)

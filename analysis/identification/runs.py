"""Logs as an identifier takes them: each on its own clock, its doubts said, all of one ship."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from shiplog.checks.channel_stats import LogStats
from shiplog.checks.data_quality import data_warnings
from shiplog.checks.log_stats import compute_log_stats
from shiplog.checks.rudder_sign import rudder_sign_warning
from shiplog.errors import LogError, UsageError
from shiplog.resampling import resample
from shiplog.types import FloatArray, Log
from shiplog.vessel.settings import DisturbanceSettings, FilterSettings, IdentifierSettings
from shiplog.vessel.vessel import Vessel
from shiplog.vessel.vessel_parser import parse_vessel

from .segment import Segment, initial_level, split_into_segments

NEEDED = ("yaw_rate", "speed", "rudder", "rpm")
ALSO = ("sway", "heading")
UNLIKE = 2.0  # times the speed for the revolutions: no ship's, from one run to another


@dataclass(frozen=True, eq=False)
class Run:
    """A log: the pieces of it in which the inputs are known, and where the ship was in each."""

    name: str
    segments: tuple[Segment, ...]
    positions: tuple[FloatArray | None, ...]  # (n, 2) m north and east, where they were measured
    vessel: Vessel | None  # that the log carries
    warnings: tuple[str, ...]
    data_lost: bool


def run_from_log(log: Log) -> Run:
    """A log as an identifier takes it.

    Raises `LogError` where a channel is missing or where rudder and revolutions are not known
    together long enough.
    """
    found = compute_log_stats(log, strict=True)
    missing = [name for name in NEEDED if name not in found]
    if missing:
        has = ", ".join(sorted({channel.name for channel in found}))
        raise LogError(
            f"no channel {missing[0]!r} in {log.name}; it has {has or 'none'}; "
            f"an identification needs {', '.join(NEEDED)}"
        )
    segments = split_into_segments(resample(log, None, NEEDED, ALSO), log.name)
    carried = log.vessel_toml
    vessel = parse_vessel(carried, f"vessel.toml in {log.name}") if carried is not None else None
    places = tuple(_positions(log, segment) for segment in segments) if "position" in found else ()
    said = (*log.warnings, *_doubts(log, found))
    return Run(
        log.name, segments, places or (None,) * len(segments), vessel,
        tuple(warning if log.name in warning else f"{log.name}: {warning}" for warning in said),
        log.data_lost,
    )  # fmt: skip


def distinct_runs(logs: Sequence[Log], held_out: Sequence[Log]) -> tuple[list[Run], list[Run]]:
    """Logs to fit and logs to predict as runs, each of a name and of data of its own.

    Raises `UsageError` for data that are given twice: they would be believed twice, or prove
    themselves.
    """
    runs: list[Run] = []
    for log in (*logs, *held_out):
        run = run_from_log(log)
        for other in runs:
            if _same(run, other):
                raise UsageError(
                    f"the same data twice, leave one of the logs out: {other.name}, {run.name}"
                )
        names = {other.name for other in runs}
        number = next(k for k in count(1) if _numbered(run.name, k) not in names)
        runs.append(_renamed(run, _numbered(run.name, number)))
    return runs[: len(logs)], runs[len(logs) :]


def _same(run: Run, other: Run) -> bool:
    return len(run.segments) == len(other.segments) and all(
        np.array_equal(a.measured, b.measured, equal_nan=True)
        for a, b in zip(run.segments, other.segments, strict=True)
    )


def _numbered(name: str, number: int) -> str:
    """The name, of a second log of that name with a number behind it."""
    return name if number == 1 else f"{name} ({number})"


def _renamed(run: Run, name: str) -> Run:
    return replace(run, name=name, segments=tuple(replace(t, name=name) for t in run.segments))


def _doubts(log: Log, found: LogStats) -> Iterator[str]:
    also = tuple(name for name in ("heading", "position") if name in found)
    yield from data_warnings(found, (*NEEDED, *also))
    contrary = rudder_sign_warning(log)
    if contrary:
        yield contrary


def _positions(log: Log, segment: Segment) -> FloatArray | None:
    """Where the ship was at a segment's samples, between the fixes in straight lines, (n, 2)."""
    parts = [c for chunk in log.chunks() for c in chunk if c.name == "position"]
    if not parts:
        return None
    source = parts[0].source
    fixes = [part for part in parts if part.source == source]
    at = np.concatenate([part.measured_ns for part in fixes])
    values = np.concatenate([part.values for part in fixes])
    known = np.isfinite(values).all(axis=1)
    secs = (at[known] - segment.signals.start_ns) * 1e-9
    if len(secs) < 2:
        return None
    time = segment.signals.time_secs
    lines = [np.interp(time, secs, column, np.nan, np.nan) for column in values[known].T]
    return np.column_stack(lines)


def common_vessel(runs: Sequence[Run], given: Vessel | None) -> Vessel | None:
    """The ship that the runs are of: the one given, or the one they carry, if any.

    Raises `LogError` where they carry ships that are not the same.
    """
    if given is not None:
        return given
    carried = [(run.name, run.vessel) for run in runs if run.vessel is not None]
    for name, vessel in carried[1:]:
        if _bare(vessel) != _bare(carried[0][1]):
            raise LogError(
                f"the logs are of different ships: {carried[0][0]} carries {carried[0][1].name!r}, "
                f"{name} carries another model, {vessel.name!r}; identify each ship by herself, "
                "or say which vessel file holds with --vessel"
            )
    return carried[0][1] if carried else None


def _bare(vessel: Vessel) -> Vessel:
    """Her model, length and gear: how she is called, sailed and filtered may differ."""
    return replace(
        vessel, name="", approach_rpm=1.0, angle_unit="rad",
        filter=FilterSettings(), disturbance=DisturbanceSettings(),
        identifier=IdentifierSettings(),
    )  # fmt: skip


def consistency_warnings(runs: Sequence[Run]) -> Iterator[str]:
    """What makes runs look like those of different ships."""
    under_way = [run for run in runs if initial_level(run.segments, "rpm") > 0]
    paces = {
        run.name: initial_level(run.segments, "speed") / initial_level(run.segments, "rpm")
        for run in under_way
    }
    if len(paces) < 2:
        return
    fast, slow = max(paces, key=lambda n: paces[n]), min(paces, key=lambda n: paces[n])
    if paces[fast] > UNLIKE * paces[slow]:
        yield (
            f"{fast} begins with {paces[fast]:.3g} m/s per rpm, {slow} with {paces[slow]:.3g}: "
            "another ship, another scale, or not steady; one model is fitted to both all the same"
        )


def require_distinct(fitted: Iterable[str], held_out: Iterable[str]) -> None:
    """Refuse a log that is named twice: it would be believed twice, or prove itself."""
    fitted, held_out = list(fitted), list(held_out)
    for path in (*fitted, *held_out):
        if path in fitted and path in held_out:
            raise UsageError(
                f"a fit is not validated on a log it has seen; leave it out of one: {path}"
            )
        if max(fitted.count(path), held_out.count(path)) > 1:
            raise UsageError(f"the same log is named twice; name it once: {path}")

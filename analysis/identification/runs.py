"""Logs as a fit takes them: resampled, split at input gaps, checked for one common ship."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import numpy as np

from analysis.identification.fit.segment import Segment, initial_level, split_into_segments
from analysis.replay.channel_warnings import (
    channel_warnings,
    end_warnings,
    late_channel_warnings,
)
from analysis.replay.passes import resampled_chunks
from analysis.replay.position_fixes import PositionFixes
from analysis.replay.reading_options import DEFAULT_OPTIONS, ReadingOptions
from shiplog.checks.consistency.consistency_check import ConsistencyCheck
from shiplog.checks.consistency.findings import (
    CONTRADICTIONS,
    naming_contradictions,
    refuse_contradictions,
)
from shiplog.errors import LogError, UsageError
from shiplog.progress import no_progress
from shiplog.resampling import choose_clock, with_steering_gear
from shiplog.screening import ScreenedLog, screen_log, screen_without_delays
from shiplog.types import (
    FloatArray,
    Log,
    concatenate_signals,
)
from shiplog.vessel.hull import Hull
from shiplog.vessel.settings import DisturbanceSettings, FilterSettings, IdentifierSettings
from shiplog.vessel.vessel import Vessel
from shiplog.vessel.vessel_parser import parse_vessel

REQUIRED_CHANNELS = ("yaw_rate", "speed", "rudder", "rpm")
OPTIONAL_CHANNELS = ("sway", "heading")
MIN_MOVED_SHARE = 1e-3  # of the distance by the speed: a circle many times around has 1e-2
MAX_SPEED_PER_RPM_RATIO = 2.0  # between two runs of one ship


@dataclass(frozen=True, eq=False)
class Run:
    """A log prepared for a fit.

    Attributes
    ----------
    name
        The log's name, unique among the runs of an identification.
    segments
        The stretches in which rudder and revolutions are known.
    vessel
        The vessel file in the log; None without one.
    warnings
        What is unusual about the data; each names the log.
    data_lost
        Whether parts of the log could not be read.
    contradictions
        Those of the warnings that state a wrong unit or sign.
    """

    name: str
    segments: tuple[Segment, ...]
    vessel: Vessel | None
    warnings: tuple[str, ...]
    data_lost: bool
    contradictions: tuple[str, ...] = ()


def run_from_log(log: Log, options: ReadingOptions = DEFAULT_OPTIONS) -> Run:
    """Resample a log, split it into segments and check its data.

    Parameters
    ----------
    log
        A log with `REQUIRED_CHANNELS`; `OPTIONAL_CHANNELS` and positions are used if present.
    options
        Of these the sources of channels, whether contradictions are refused, the place of the
        antenna, and the vessel, whose steering gear follows an order of the rudder; by default
        that of the log.

    Returns
    -------
    Run
        The prepared log.

    Raises
    ------
    LogError
        A channel is missing, or rudder and revolutions are not known together long enough.
    """

    def screen(recorded: Log) -> ScreenedLog:
        return screen_log(
            recorded,
            REQUIRED_CHANNELS,
            (*OPTIONAL_CHANNELS, "position"),
            purpose="an identification",
            sources=options.sources,
            derive=options.derive,
        )

    screened = screen_without_delays(log, options.sensor_delays, screen)
    stats = screened.screening.stats
    toml = log.vessel_toml
    vessel = parse_vessel(toml, f"vessel.toml in {log.name}") if toml is not None else None
    gear = options.vessel or vessel or Vessel("", None)
    clock = choose_clock(screened, stats, None, REQUIRED_CHANNELS, OPTIONAL_CHANNELS)
    clock = with_steering_gear(clock, gear.rudder_rate)
    consistency, fixes = ConsistencyCheck(stats), PositionFixes(stats.get("position"))
    listeners = consistency.add, fixes.add
    signals = concatenate_signals(
        resampled_chunks(screened, clock, no_progress, "read", *listeners)
    )
    findings = consistency.result()
    if options.strict:
        refuse_contradictions(findings)
    contradictions = tuple(f.text for f in findings if f.kind in CONTRADICTIONS)
    with naming_contradictions(contradictions):
        segments = split_into_segments(signals, log.name)
    positions = fixes.at_samples(segment.signals for segment in segments)
    stuck = _hardly_move(positions, segments)
    warnings = [
        *screened.warnings,
        *channel_warnings(stats),
        *late_channel_warnings(stats),
        *(finding.text for finding in findings),
        *end_warnings(stats, clock, REQUIRED_CHANNELS),
    ]
    if stuck:
        warnings.append(
            f"{stats['position'].topic}: at one place throughout the log although the ship makes "
            "way, and not used; if the receiver was stuck, choose another source; if its unit is "
            "wrong, correct it"
        )
    return Run(
        name=log.name,
        segments=tuple(
            replace(segment, fixes=None if stuck else each, antenna=options.antenna)
            for segment, each in zip(segments, positions, strict=True)
        ),
        vessel=vessel,
        warnings=tuple(text if log.name in text else f"{log.name}: {text}" for text in warnings),
        data_lost=log.data_lost,
        contradictions=contradictions,
    )


def _hardly_move(positions: Iterable[FloatArray | None], segments: Iterable[Segment]) -> bool:
    """Return whether the fixes, (n, 2) of each segment, are at one place while the ship sails."""
    given = [each for each in positions if each is not None]
    if not given:
        return False
    fixes = np.concatenate(given)
    fixes = fixes[np.isfinite(fixes).all(axis=1)]
    sailed = sum(
        float(np.nansum(np.abs(each.signals["speed"]))) * each.dt_secs for each in segments
    )
    return len(fixes) > 1 and float(np.ptp(fixes, axis=0).max()) <= MIN_MOVED_SHARE * sailed


def distinct_runs(
    logs: Sequence[Log], held_out: Sequence[Log], options: ReadingOptions
) -> tuple[list[Run], list[Run]]:
    """Prepare logs for fitting and for validation, each with a unique name.

    Parameters
    ----------
    logs
        The logs to fit.
    held_out
        The logs to predict.
    options
        As in `run_from_log`, for each log.

    Returns
    -------
    fitted, held_out
        The runs in the order of the logs; a second log of the same name becomes ``name (2)``.

    Raises
    ------
    UsageError
        Two logs hold the same data: they would count twice, or validate themselves.
    """
    runs: list[Run] = []
    for log in (*logs, *held_out):
        run = run_from_log(log, options)
        for other in runs:
            if _same_data(run, other):
                raise UsageError(
                    f"two logs hold the same data; leave one of them out: {other.name}, {run.name}"
                )
        names = {other.name for other in runs}
        number = next(k for k in count(1) if _numbered(run.name, k) not in names)
        runs.append(_renamed(run, _numbered(run.name, number)))
    return runs[: len(logs)], runs[len(logs) :]


def _same_data(run: Run, other: Run) -> bool:
    return len(run.segments) == len(other.segments) and all(
        np.array_equal(a.measured, b.measured, equal_nan=True)
        for a, b in zip(run.segments, other.segments, strict=True)
    )


def _numbered(name: str, number: int) -> str:
    return name if number == 1 else f"{name} ({number})"


def _renamed(run: Run, name: str) -> Run:
    return replace(run, name=name, segments=tuple(replace(t, name=name) for t in run.segments))


def common_vessel(runs: Sequence[Run], given: Vessel | None) -> Vessel | None:
    """Return the vessel of an identification: the given one, or the one in the logs.

    Parameters
    ----------
    runs
        All runs, fitted and held out.
    given
        The vessel file named by the user, which takes precedence.

    Returns
    -------
    Vessel or None
        None where none is given and no log has one.

    Raises
    ------
    LogError
        The logs have vessel files of different models, lengths, steering gears or hulls.
    """
    if given is not None:
        return given
    embedded = [(run.name, run.vessel) for run in runs if run.vessel is not None]
    for name, vessel in embedded[1:]:
        first_name, first = embedded[0]
        if _physical(vessel) != _physical(first):
            raise LogError(
                f"the logs are of different ships: {first_name} has the vessel file of "
                f"{first.name!r}, {name} another model, {vessel.name!r}; identify each ship "
                "separately, or choose the vessel file with --vessel"
            )
    return _with_known_hull(embedded) if embedded else None


def _with_known_hull(embedded: Sequence[tuple[str, Vessel]]) -> Vessel:
    """Return the vessel of the first log with the hull of the first one that has any."""
    known = [(name, vessel.hull) for name, vessel in embedded if vessel.hull != Hull()]
    for name, hull in known[1:]:
        if hull != known[0][1]:
            raise LogError(
                f"the logs are of different hulls: [hull] of {name} differs from that of "
                f"{known[0][0]}; identify each loading separately, or choose the vessel file with "
                "--vessel"
            )
    return replace(embedded[0][1], hull=known[0][1]) if known else embedded[0][1]


def _physical(vessel: Vessel) -> Vessel:
    """Return the vessel with name, approach, unit, hull and estimator settings set to defaults."""
    return replace(
        vessel, name="", approach_rpm=1.0, angle_unit="rad", gear_given=(),
        filter=FilterSettings(), disturbance=DisturbanceSettings(),
        identifier=IdentifierSettings(), hull=Hull(),
    )  # fmt: skip


def consistency_warnings(runs: Sequence[Run]) -> Iterator[str]:
    """Warn of runs whose initial speeds per rpm differ too much for one ship.

    Parameters
    ----------
    runs
        All runs, fitted and held out; those without revolutions are skipped.

    Yields
    ------
    str
        At most one warning, where the ratio exceeds `MAX_SPEED_PER_RPM_RATIO`.
    """
    under_way = [run for run in runs if initial_level(run.segments, "rpm") > 0]
    speed_per_rpm = {
        run.name: initial_level(run.segments, "speed") / initial_level(run.segments, "rpm")
        for run in under_way
    }
    if len(speed_per_rpm) < 2:
        return
    fast = max(speed_per_rpm, key=lambda name: speed_per_rpm[name])
    slow = min(speed_per_rpm, key=lambda name: speed_per_rpm[name])
    if speed_per_rpm[fast] > MAX_SPEED_PER_RPM_RATIO * speed_per_rpm[slow]:
        yield (
            f"{fast} starts with {speed_per_rpm[fast]:.3g} m/s per rpm, {slow} with "
            f"{speed_per_rpm[slow]:.3g}: different ships, different units, or no steady start; "
            "check the logs, one model is fitted to both"
        )


def is_measured(log: Log) -> bool:
    """Return whether a log is of a trial, and not a reference of `check` or a simulated truth.

    Parameters
    ----------
    log
        An open log.

    Examples
    --------
    >>> from shiplog import open_log
    >>> is_measured(open_log("sample_data/zigzag_20_20.ref.mcap"))
    False
    """
    name = Path(log.name).name
    by_metadata = "reference_of" in log.metadata or "truth_of" in log.metadata
    return not (by_metadata or name.endswith((".ref.mcap", ".truth.mcap")))


def require_distinct_logs(fitted: Iterable[str], held_out: Iterable[str]) -> None:
    """Check that no log is named twice.

    Parameters
    ----------
    fitted, held_out
        The paths of the logs to fit and to validate on.

    Raises
    ------
    UsageError
        A path occurs twice: its data would count twice, or validate themselves.
    """
    fitted, held_out = list(fitted), list(held_out)
    for path in (*fitted, *held_out):
        if path in fitted and path in held_out:
            raise UsageError(
                f"a log cannot be both fitted and used for validation; remove it from one: {path}"
            )
        if max(fitted.count(path), held_out.count(path)) > 1:
            raise UsageError(f"a log is named twice; name it once: {path}")

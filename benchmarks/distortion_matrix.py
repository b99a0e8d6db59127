"""Replays of a simulated trial distorted in 200 ways, whose results must be right or reported.

Every case is replayed, and its figures are compared with the simulator's: the coefficients within
their intervals, the mean speed, the yaw rate, the heading and the track. A case with a wrong figure
must be refused, or have a warning that names the cause; without any warning it is a silent wrong
result.
"""

import warnings as python_warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from analysis.filters.base import OUTPUT_STATES
from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from recorders.simulated.sensors import DEG, suite
from recorders.simulated.simulate import START_NS, SimulatedTrial, simulate
from shiplog import Channel, LogWriter, ShiplogError, TrialLog, Vessel, load_vessel, open_log
from shiplog.types import Log

from .distortion import Clock
from .distortions import CASES, Case, cases

DURATION_SECS = 300.0
PORTION_SECS = 10  # of a file; within one, samples are written in the order of their stamps
MANOEUVRES = ("zigzag-20-20", "zigzag-10-10", "turning-circle", "pseudo-random", "spiral")
COEFFICIENT_STDS = 4.5  # for nine coefficients in 200 cases
RIGHT, RIGHT_WITH_WARNINGS = "right", "right, with warnings"
NAMED, REFUSED = "wrong, cause named", "refused, cause named"
OTHER_WARNING, OTHER_REFUSAL = "wrong, other warnings", "refused, other reason"
SILENT, TRACEBACK = "silent wrong", "traceback"
OUTCOMES = (
    RIGHT, RIGHT_WITH_WARNINGS, NAMED, REFUSED, OTHER_WARNING, OTHER_REFUSAL, SILENT, TRACEBACK,
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """The result of a case.

    Attributes
    ----------
    case
        The case.
    kind
        One of `OUTCOMES`.
    wrong
        The figures that are wrong, with their values and the truth.
    messages
        The warnings, or the error.
    """

    case: Case
    kind: str
    wrong: tuple[str, ...]
    messages: tuple[str, ...]

    @property
    def is_acceptable(self) -> bool:
        """Whether the figures are right or the cause is named."""
        return self.kind in {RIGHT, RIGHT_WITH_WARNINGS, NAMED, REFUSED}


@cache
def undistorted_trial(seed: int = 3, manoeuvre: str = "zigzag-20-20") -> SimulatedTrial:
    """Return the trial that is distorted: a zig-zag with the noise of ordinary sensors."""
    settings = {f"{name}.rate_hz": 5.0 for name in ("yaw_rate", "speed", "rudder", "rpm")}
    settings |= {"heading.white": 0.1 * DEG, "position.white": 1.0}
    vessel = load_vessel("table1")[0]
    return simulate(
        vessel, manoeuvre, duration_secs=DURATION_SECS, seed=seed, sensors=suite("paper", settings)
    )


def as_log(trial: SimulatedTrial) -> TrialLog:
    """Return a trial as a log in memory, without a vessel file."""
    return TrialLog("trial.mcap", trial.channels, trial.metadata)


def run_matrix(chosen: Iterable[Case] | None = None) -> Iterator[Outcome]:
    """Replay every case and classify its result.

    Parameters
    ----------
    chosen
        The cases; by default all of `benchmarks.distortions.cases`.
    """
    harmful: dict[str, bool] = {}
    for case in cases() if chosen is None else chosen:
        outcome = run_case(case, harmful)
        if len(case.distortions) == 1:
            harmful[str(case)] = bool(outcome.wrong) or outcome.kind == REFUSED
        yield outcome


def run_case(case: Case, harmful: dict[str, bool] | None = None) -> Outcome:
    """Replay a case and classify its result.

    Parameters
    ----------
    case
        The case.
    harmful
        Whether a distortion alone makes a figure wrong or is refused, by its name: in a pair, a
        warning must name a distortion that does.
    """
    trial = undistorted_trial()
    log = as_log(trial)
    for distortion in case.distortions:
        log = distortion.apply(log)
    culprits = [d for d in case.distortions if (harmful or {}).get(str(d), True)]
    culprits = culprits or list(case.distortions)
    vessel = load_vessel("table1")[0]
    try:
        with python_warnings.catch_warnings(), TemporaryDirectory() as folder:
            python_warnings.simplefilter("ignore")
            clocks = [d.clock for d in case.distortions if d.clock is not None]
            read = _written(log, clocks, Path(folder) / "trial.mcap") if clocks else log
            analysis = analyse(read, ReadingOptions(vessel))
    except ShiplogError as error:
        named = any(d.is_named_in(str(error)) for d in culprits)
        return Outcome(case, REFUSED if named else OTHER_REFUSAL, (), (str(error),))
    except Exception as error:  # noqa: BLE001 - a traceback is one of the outcomes
        return Outcome(case, TRACEBACK, (), (f"{type(error).__name__}: {error}",))
    messages = tuple(dict.fromkeys((*read.warnings, *analysis.findings.warnings)))
    wrong = tuple(wrong_figures(analysis, trial, vessel))
    if not wrong:
        return Outcome(case, RIGHT_WITH_WARNINGS if messages else RIGHT, (), messages)
    named = any(d.is_named_in(message) for d in culprits for message in messages)
    kind = NAMED if named else OTHER_WARNING if messages else SILENT
    return Outcome(case, kind, wrong, messages)


def _written(log: TrialLog, clocks: Sequence[Clock], path: Path) -> Log:
    """Write a log in the order of its true times, with the times of distorted clocks."""
    ends = START_NS + np.arange(PORTION_SECS, 2 * DURATION_SECS, PORTION_SECS) * 10**9
    cuts = {
        c.topic: [0, *np.searchsorted(c.received_ns, ends).tolist(), len(c)] for c in log.channels
    }
    with LogWriter(path, metadata=log.metadata) as writer:
        for i in range(len(ends) + 1):
            parts = [c.part(cuts[c.topic][i], cuts[c.topic][i + 1]) for c in log.channels]
            writer.write(*(_with_clocks(part, clocks) for part in parts if len(part)))
            writer.flush()
    return open_log(path)


def _with_clocks(channel: Channel, clocks: Sequence[Clock]) -> Channel:
    measured, received = channel.measured_ns, channel.received_ns
    for clock in clocks:
        measured, received = clock(channel, measured), clock(channel, received)
    return replace(channel, measured_ns=measured, received_ns=received)


def wrong_figures(analysis: Analysis, trial: SimulatedTrial, vessel: Vessel) -> Iterator[str]:
    """Yield the figures of a replay that differ from the truth by more than their uncertainty."""
    findings, truth = analysis.findings, vessel.paper_coefficients
    for name, estimate in {**findings.yaw.coefficients, **findings.surge.coefficients}.items():
        if hasattr(truth, name) and np.isfinite(estimate.value):
            error = estimate.value - getattr(truth, name)
            if not abs(error) <= COEFFICIENT_STDS * estimate.std:
                yield (f"{name} = {estimate.value:.3g} ± {2 * estimate.std:.1g} "
                       f"for {getattr(truth, name):.3g}")  # fmt: skip
    clock = findings.plan.clock
    shift_secs = (clock.start_ns - START_NS) * 1e-9
    times = shift_secs + clock.dt_secs * np.arange(clock.count)
    inside = (times >= 0) & (times <= trial.duration_secs)
    if np.mean(inside) < 0.97 or np.ptp(times) < 0.5 * trial.duration_secs:
        yield f"times {times[0]:.4g} to {times[-1]:.4g} s for 0 to {trial.duration_secs:.0f} s"
        return
    true = trial.trajectory.at(times[inside])
    yaw_rate, speed = (analysis.estimates.states[inside, i] for i in OUTPUT_STATES)
    if not abs(np.mean(speed) / np.mean(true["speed"]) - 1) < 0.02:
        yield f"mean speed {np.mean(speed):.3g} m/s for {np.mean(true['speed']):.3g} m/s"
    slope = np.sum(yaw_rate * true["yaw_rate"]) / np.sum(true["yaw_rate"] ** 2)
    if not abs(slope - 1) < 0.05:
        yield f"yaw rate {slope:.3g} times the true one"
    if "heading" in analysis.signals.values:
        error = analysis.signals["heading"][inside] - true["heading"]
        error = np.abs(np.angle(np.exp(1j * error[np.isfinite(error)]))) / DEG
        if len(error) and not (np.median(error) < 2.0 and np.quantile(error, 0.95) < 6.0):
            yield f"heading wrong by {np.median(error):.3g}, up to {np.max(error):.3g} deg"
    yield from _wrong_track(analysis, trial, shift_secs)


def _wrong_track(analysis: Analysis, trial: SimulatedTrial, shift_secs: float) -> Iterator[str]:
    track = analysis.track
    if not len(track.time_secs):
        return
    at = np.clip(track.time_secs + shift_secs, 0, trial.duration_secs)
    true = trial.trajectory.at(at)["position"]
    error = np.column_stack((track.north, track.east)) - (true - true[0])
    distance = np.hypot(*(error - error[0]).T)
    recorded = analysis.findings.track_origin == "recorded positions"
    limit = 0.015 if recorded else 0.05  # of the distance run
    path = float(np.sum(np.hypot(*np.diff(true, axis=0).T)))
    if not np.max(distance) < 10.0 + limit * path:
        yield f"track wrong by up to {np.max(distance):.4g} m after {path:.0f} m"


def false_alarms(seeds: Iterable[int]) -> Iterator[str]:
    """Replay undistorted trials of all manoeuvres; yield the warnings of each.

    Parameters
    ----------
    seeds
        The seeds of the sensors' noise; they take the manoeuvres in turn.
    """
    vessel = load_vessel("table1")[0]
    for seed in seeds:
        manoeuvre = MANOEUVRES[seed % len(MANOEUVRES)]
        log = as_log(undistorted_trial(seed, manoeuvre))
        for warning in analyse(log, ReadingOptions(vessel)).findings.warnings:
            yield f"{manoeuvre}, seed {seed}: {warning}"


@dataclass(frozen=True)
class MatrixResults:
    """The results of the whole matrix, as texts and counts.

    Attributes
    ----------
    counts
        The number of cases by family, and in total, of each of `OUTCOMES`.
    failures
        The cases whose result is wrong while no warning names the cause, with that result.
    false_alarms
        The warnings of undistorted trials.
    trials
        The number of undistorted trials.
    """

    counts: dict[str, tuple[int, ...]]
    failures: tuple[str, ...]
    false_alarms: tuple[str, ...]
    trials: int


def measure_distortions(cases_count: int = CASES, trials: int = 50) -> MatrixResults:
    """Run the matrix and the undistorted trials."""
    outcomes = list(run_matrix(cases(cases_count)))
    failures = [
        f"{each.kind}: {each.case}: {'; '.join(each.wrong or each.messages)}"
        for each in outcomes
        if not each.is_acceptable
    ]
    alarms = tuple(false_alarms(range(trials)))
    return MatrixResults(counts_by_family(outcomes), tuple(failures), alarms, trials)


def counts_by_family(outcomes: Sequence[Outcome]) -> dict[str, tuple[int, ...]]:
    """Count the cases of each of `OUTCOMES`, by family and in total."""
    counts = Counter((each.case.family, each.kind) for each in outcomes)
    families = dict.fromkeys(each.case.family for each in outcomes)
    rows = {f: tuple(counts[f, kind] for kind in OUTCOMES) for f in families}
    return rows | {"total": tuple(map(sum, zip(*rows.values(), strict=True)))}

"""Figures of a replay or of an identification of the trial that differ from the simulator's."""

from collections.abc import Iterator

import numpy as np

from analysis.filters.base import OUTPUT_STATES
from analysis.identification.identify import identify
from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from recorders.simulated.sensors import DEG
from recorders.simulated.simulate import START_NS, SimulatedTrial
from shiplog import Vessel, load_vessel
from shiplog.types import Log

from .undistorted import undistorted_trial

COEFFICIENT_STDS = 4.5  # for nine coefficients in 200 cases

Judged = tuple[list[str], tuple[str, ...]]


def judge_replay(log: Log) -> Judged:
    """Replay a log of the trial; return the figures that are wrong, and the warnings."""
    vessel = load_vessel("table1")[0]
    analysis = analyse(log, ReadingOptions(vessel))
    return list(wrong_figures(analysis, undistorted_trial(), vessel)), analysis.findings.warnings


def judge_identification(log: Log) -> Judged:
    """Identify the ship from a log of the trial; return wrong parameters, and the warnings.

    Parameters that are reported as not identifiable are not compared.
    """
    vessel = load_vessel("table1")[0]
    ship = identify(log, options=ReadingOptions(vessel))
    wrong = []
    for name, value, std in zip(
        ship.uncertainty.names, ship.uncertainty.values, ship.uncertainty.std, strict=True
    ):
        truth = getattr(vessel.paper_coefficients, name)
        if name in ship.identifiable and not abs(value - truth) <= COEFFICIENT_STDS * std:
            wrong.append(f"{name} = {value:.3g} ± {2 * std:.1g} for {truth:.3g}")
    return wrong, ship.warnings


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

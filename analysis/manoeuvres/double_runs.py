"""Means of double runs: the speed of a trial in a current, from two runs on reciprocal courses.

Source: ITTC Recommended Procedure 7.5-04-01-01.1; a constant current cancels in the mean.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .found_manoeuvre import FoundManoeuvre
from .index_uncertainty import COVERAGE_FACTOR, NOISE
from .sailed_manoeuvre import ManoeuvreKind, SailedManoeuvre
from .straight_runs import is_double_run
from .trial_index import TrialIndex
from .trial_signals import TrialSignals
from .turn_current import POSITION_DRIFT

DOUBLE_RUN_SPEED, DOUBLE_RUN_POWER = "speed of the double run", "power of the double run"


def with_double_runs(
    signals: TrialSignals,
    found: Sequence[FoundManoeuvre],
    sailed: Sequence[SailedManoeuvre],
) -> list[SailedManoeuvre]:
    """Add the mean of each double run to the indices of its second run.

    Parameters
    ----------
    signals
        Of the whole trial, without NaN where measured.
    found, sailed
        The manoeuvres, as found and as assessed.
    """
    done = list(sailed)
    for k in range(1, len(found)):
        pair = (found[k - 1], found[k])
        if all(each.kind is ManoeuvreKind.SPEED_RUN for each in pair) and is_double_run(
            signals, *pair
        ):
            added = _means(signals, pair, sailed[k - 1].number)
            done[k] = replace(done[k], indices=(*done[k].indices, *added))
    return done


def _means(
    signals: TrialSignals, pair: tuple[FoundManoeuvre, FoundManoeuvre], number: int
) -> list[TrialIndex]:
    """Return the mean speed over the ground and the mean power of two runs."""
    indices = []
    note = f"mean of this run and of manoeuvre {number}, in which the current cancels"
    if signals.has("positions"):
        made, stds = zip(*(_ground_velocity(signals, run) for run in pair), strict=True)
        headings = [float(np.mean(signals.heading[run.execute : run.end])) for run in pair]
        # the difference of the velocities: the mean of their sizes has a current abeam in it
        apart = abs(np.exp(1j * headings[0]) - np.exp(1j * headings[1]))
        speed, std = abs(made[0] - made[1]) / apart, float(np.hypot(*stds)) / apart
        indices.append(_mean_index(DOUBLE_RUN_SPEED, float(speed), "m/s", float(std), note))
    if signals.has("power"):
        parts = [signals.power[run.execute : run.end] for run in pair]
        means = [float(np.mean(part)) for part in parts]
        stds = tuple(float(np.std(part)) / np.sqrt(len(part)) for part in parts)
        std = float(np.hypot(*stds)) / 2
        indices.append(_mean_index(DOUBLE_RUN_POWER, float(np.mean(means)), "W", std, note))
    return indices


def _ground_velocity(signals: TrialSignals, run: FoundManoeuvre) -> tuple[complex, float]:
    """Return the velocity made good over the ground, north + i east, and its uncertainty, m/s."""
    first, last = signals.positions[run.execute], signals.positions[run.end - 1]
    secs = (run.end - 1 - run.execute) * signals.dt_secs
    error = np.sqrt(2.0) * float(np.hypot(signals.noise.get("position", 0.0), POSITION_DRIFT))
    return complex(*(last - first)) / secs, error / secs


def _mean_index(name: str, value: float, unit: str, std: float, note: str) -> TrialIndex:
    half = COVERAGE_FACTOR * std
    return TrialIndex(
        name, "", value, unit, std, value - half, value + half, {NOISE: std}, note=note
    )

"""Stopping and acceleration: manoeuvres that an order of the revolutions begins."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from .execute import remove_spikes
from .found_manoeuvre import FoundManoeuvre
from .rudder_levels import HeldLevel, held_levels
from .sailed_manoeuvre import ManoeuvreKind
from .smoothing import moving_mean
from .trial_signals import TrialSignals, noise_std

MIN_RPM_CHANGE = 0.02  # of the largest revolutions, within ten seconds: they are changed
RPM_MOVING_SECS = 5.0  # half that time: an engine is run up slowly
MIN_RPM_STEP = 0.15  # of the largest revolutions, from one level to the next
STOP_RPM = 0.05  # of the largest revolutions: below it the propeller does not drive ahead
MIN_STOP_SPEED = 1.0  # m/s, from which a ship can be stopped
MIN_SPEED_GAIN = 1.15  # of an acceleration: speed at its end over that before
MIN_STOP_SHARE = 0.5  # of the speed, that a stopping manoeuvre takes off at least
MEAN_SECS = 5.0  # to either side, over which the speed is averaged
AFTER_STOP_SECS = (
    60.0  # noise makes the stop seem early, and its instant is smoothed with both sides
)
SLOW_SHARE = 0.02  # of the speed at the execute: the ship is stopped


def find_speed_manoeuvres(signals: TrialSignals) -> Iterator[FoundManoeuvre]:
    """Find stopping manoeuvres and accelerations.

    Parameters
    ----------
    signals
        Without NaN.

    Yields
    ------
    FoundManoeuvre
        A stopping manoeuvre from the revolutions' change to the ship's stop, or an acceleration
        to the next change of revolutions.
    """
    if not (signals.has("rpm") and signals.has("speed")):
        return
    dt, rpm = signals.dt_secs, remove_spikes(signals.rpm, signals.dt_secs)
    largest = float(np.max(np.abs(rpm)))
    if largest <= 0:
        return
    movement = MIN_RPM_CHANGE * largest + 3 * noise_std(signals.rpm)
    levels = held_levels(rpm, dt, movement, RPM_MOVING_SECS)
    for before, after in pairwise(levels):
        step = (after.level - before.level) / largest
        if abs(step) < MIN_RPM_STEP:
            continue
        if after.level < STOP_RPM * largest and before.level > MIN_RPM_STEP * largest:
            found = _stop(signals, levels, before)
        else:
            found = _acceleration(signals, before, after) if step > 0 else None
        if found is not None:
            yield found


def _stop(
    signals: TrialSignals, levels: list[HeldLevel], before: HeldLevel
) -> FoundManoeuvre | None:
    execute, speed = before.last, signals.speed
    initial = float(np.median(speed[max(0, execute - round(5 / signals.dt_secs)) : execute + 1]))
    later = [held for held in levels if held.first > execute and held.level > before.level / 3]
    end = later[0].first if later else len(signals)
    mean = moving_mean(speed[execute:end], 1 + 2 * round(MEAN_SECS / signals.dt_secs))
    stopped = np.flatnonzero(mean <= (0.0 if np.min(mean) <= 0 else SLOW_SHARE * initial))
    if len(stopped):
        end = min(end, execute + int(stopped[0]) + 1 + round(AFTER_STOP_SECS / signals.dt_secs))
    if initial < MIN_STOP_SPEED or end - execute < 3:
        return None
    if float(np.min(speed[execute:end])) > MIN_STOP_SHARE * initial:
        return None
    return FoundManoeuvre(ManoeuvreKind.STOPPING, execute, end)


def _acceleration(
    signals: TrialSignals, before: HeldLevel, after: HeldLevel
) -> FoundManoeuvre | None:
    execute, end = before.last, after.last + 1
    initial = max(float(np.median(signals.speed[max(0, execute - 10) : execute + 1])), 0.0)
    tail = max(1, (end - execute) // 10)
    final = float(np.median(signals.speed[end - tail : end]))
    turned = np.ptp(signals.heading[execute:end]) if signals.has("heading") else 0.0
    if final < max(MIN_SPEED_GAIN * initial, initial + 0.3) or turned > 0.5:
        return None
    return FoundManoeuvre(ManoeuvreKind.ACCELERATION, execute, end)

"""Start rules: the instant from which a manoeuvre counts, by an explicit rule.

On the turning circles of the KVLCC2, the instant of the order against that at which the rudder has
moved by 0.5° changes the advance by 3 to 5 %.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import radians

import numpy as np

from shiplog.types import FloatArray

from .execute import HELM_SECS
from .found_manoeuvre import FoundManoeuvre
from .trial_signals import TrialSignals

RAMP_SHARES = (0.15, 0.75)  # of the way to the new angle, through which a line is laid
MAX_RAMP_SECS = 90.0
EVENT_SECS = (30.0, 10.0)  # before and after the rudder's movement: an event belongs to it
STATED_SECS = (90.0, 10.0)  # the same of a stated time
MIN_ORDER_CHANGE = radians(1.5)
EXECUTE_WORD = "execute"


class StartRule(StrEnum):
    """The rules by which a manoeuvre's execute is found."""

    ORDER = "order"  # the rudder's order or, without one, the beginning of its movement
    MOVED = "moved"
    EVENT = "event"
    STATED = "stated"


@dataclass(frozen=True)
class Execute:
    """The execute of a manoeuvre.

    Attributes
    ----------
    sample
        With its fraction.
    rule
        In words, such as ``rudder order (channel)``.
    std_secs
        Standard uncertainty of the instant by this rule, s.
    """

    sample: float
    rule: str
    std_secs: float


@dataclass(frozen=True)
class RuleSettings:
    """What the start rules depend on, as in `analysis.trial.trial_options.TrialOptions`."""

    rule: StartRule = StartRule.ORDER
    moved_angle: float = radians(0.5)
    execute_secs: tuple[float, ...] = ()
    order_delay_std: float = 0.25


def find_executes(
    signals: TrialSignals, found: FoundManoeuvre, settings: RuleSettings
) -> tuple[Execute, dict[str, float]]:
    """Find the execute of a manoeuvre by the rule chosen, and by the others that apply.

    Parameters
    ----------
    signals
        Without NaN.
    found
        The manoeuvre; its `execute` is the sample at which the rudder begins to move.
    settings
        The rule. Where it does not apply to the manoeuvre, `StartRule.ORDER` is used.

    Returns
    -------
    execute
        By the rule chosen.
    others
        The samples of the other rules, by their names.
    """
    dt = signals.dt_secs
    at_order = _order_execute(signals, found, settings)
    rules: dict[StartRule, Execute] = {StartRule.ORDER: at_order}
    started = ramp_start(signals.rudder, found.execute, found.movement, dt)
    moved = moved_sample(signals.rudder, found, started, settings.moved_angle, dt)
    spread = signals.interval("rudder") / np.sqrt(12.0)
    if np.isfinite(moved):
        name = f"rudder moved {np.degrees(settings.moved_angle):.1f}°"
        rules[StartRule.MOVED] = Execute(moved, name, spread)
    at = at_order.sample * dt
    marked = [
        time
        for time, text in signals.events
        if EXECUTE_WORD in text.lower() and -EVENT_SECS[0] <= time - at <= EVENT_SECS[1]
    ]
    if marked:
        nearest = min(marked, key=lambda time: abs(time - at))
        rules[StartRule.EVENT] = Execute(nearest / dt, "marked event", 1.0)
    stated = [
        time for time in settings.execute_secs if -STATED_SECS[0] <= time - at <= STATED_SECS[1]
    ]
    if stated:
        rules[StartRule.STATED] = Execute(max(stated) / dt, "stated time", 0.0)
    chosen = rules.get(settings.rule, at_order)
    others = {each.rule: each.sample for each in rules.values() if each is not chosen}
    return chosen, others


def _order_execute(signals: TrialSignals, found: FoundManoeuvre, settings: RuleSettings) -> Execute:
    """Return the execute at the order, or else at the beginning of the rudder's movement."""
    spread = signals.interval("rudder") / np.sqrt(12.0)
    if signals.has("rudder_order"):
        ordered = order_sample(signals.rudder_order, found, signals.dt_secs)
        if np.isfinite(ordered):
            interval = signals.interval("rudder_order") / np.sqrt(12.0)
            return Execute(ordered, "rudder order (channel)", interval)
    started = ramp_start(signals.rudder, found.execute, found.movement, signals.dt_secs)
    std = float(np.hypot(spread, settings.order_delay_std))
    return Execute(started, "rudder order (beginning of the rudder's movement)", std)


def order_sample(order: FloatArray, found: FoundManoeuvre, dt: float) -> float:
    """Return the last sample before the ordered angle changes; NaN where it does not."""
    first = max(0, found.execute - round(20.0 / dt))
    part = order[first : found.execute + round(10.0 / dt) + 1]
    if len(part) < 2:
        return np.nan
    change = np.abs(np.diff(part))
    towards = found.movement * (part[1:] - part[0])
    steps = np.flatnonzero((change > MIN_ORDER_CHANGE) & (towards > 0))
    return float(first + steps[-1]) + 1.0 if len(steps) else np.nan


def ramp_start(rudder: FloatArray, leaves: int, side: float, dt: float) -> float:
    """Find where the movement of a rudder begins, by a line through its ramp.

    Parameters
    ----------
    rudder
        (n,) rad.
    leaves
        A sample close to the beginning.
    side
        1 for a movement to starboard, -1 to port.
    dt
        Sample interval, s.

    Returns
    -------
    float
        Sample with its fraction, at which the line reaches the mean angle before the ramp.
    """
    window = max(1, round(HELM_SECS / dt))
    helm = float(np.median(rudder[max(0, leaves - window) : leaves + 1]))
    ahead = side * (rudder[leaves : leaves + round(MAX_RAMP_SECS / dt)] - helm)
    if len(ahead) < 3:
        return float(leaves)
    reached = np.flatnonzero(ahead >= 0.9 * np.max(ahead))
    top = int(reached[0])
    target = float(np.median(ahead[top : top + window + 1]))
    low, high = RAMP_SHARES
    first = int(np.argmax(ahead > low * target))
    last = int(np.argmax(ahead > high * target))
    x, y = np.arange(first, last + 1), ahead[first : last + 1]
    if last <= first:  # a step within one sample
        previous = ahead[first - 1] if first else 0.0
        return float(leaves + first - 1 + max(0.0, -previous)) if first else float(leaves)
    slope, intercept = np.polyfit(x, y, 1)
    start = -intercept / slope if slope > 0 else 0.0
    return float(max(0.0, leaves + np.clip(start, first - 2 * window, first)))


def moved_sample(
    rudder: FloatArray, found: FoundManoeuvre, start: float, angle: float, dt: float
) -> float:
    """Return where the rudder has moved by an angle from its helm; NaN where it has not."""
    side = found.movement
    first, window = round(start), max(1, round(HELM_SECS / dt))
    helm = float(np.median(rudder[max(0, first - window) : first + 1]))
    part = side * (rudder[first : found.end] - helm)
    held = np.flatnonzero(part >= 0.5 * np.max(part, initial=0.0))
    below = np.flatnonzero(part[: int(held[0])] < angle) if len(held) else held
    if not len(below):
        return np.nan
    k = int(below[-1])
    return first + k + float((angle - part[k]) / (part[k + 1] - part[k]))

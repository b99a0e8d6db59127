"""Start rules: the instant from which a manoeuvre counts, by an explicit rule.

On the turning circles of the KVLCC2, the instant of the order against that at which the rudder has
moved by 0.5° changes the advance by 3 to 5 %.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import radians

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .execute import HELM_SECS
from .found_manoeuvre import FoundManoeuvre
from .sailed_manoeuvre import ManoeuvreKind
from .trial_signals import TrialSignals

RAMP_SHARES = (0.15, 0.75)  # of the way to the new angle, through which a line is laid
MAX_RAMP_SECS = 90.0
EVENT_SECS = (30.0, 10.0)  # before and after the rudder's movement: an event belongs to it
STATED_SECS = (90.0, 10.0)  # the same of a stated time
MIN_ORDER_CHANGE = radians(1.5)
EXECUTE_WORD = "execute"
HELM_LINE_SECS = 5.0  # before the movement, over which a line is laid through the helm
ORDER_SECS = (20.0, 3.0)  # about the rudder's movement, in which its order is looked for
SPARSE_SECS = 4.0  # between samples of the rudder: more is more than many movements take
MIN_FIRST_SHARE = 0.12  # of the whole movement, that shows before the sample of most of it
HELM_SCATTER_SECS = 60.0  # before a movement, over which the scatter of the helm is taken
POSSIBLE_SECS = 1.0  # beyond the time in which a movement may begin, for noise and helm
FASTEST_GEAR = radians(5.0)  # rad/s
BY_RUDDER = (
    ManoeuvreKind.TURNING_CIRCLE, ManoeuvreKind.ZIGZAG, ManoeuvreKind.INITIAL_TURNING,
    ManoeuvreKind.PULL_OUT,
)  # fmt: skip


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
    by_rudder = found.kind in BY_RUDDER
    at_order = _order_execute(signals, found) if by_rudder else _other_execute(signals, found)
    rules: dict[StartRule, Execute] = {StartRule.ORDER: at_order}
    if by_rudder:
        started, ramp_std = _rudder_start(signals, found)
        moved = moved_sample(signals.rudder, found, started, settings.moved_angle, dt)
        if np.isfinite(moved):
            name = f"rudder moved {np.degrees(settings.moved_angle):.1f}°"
            rules[StartRule.MOVED] = Execute(moved, name, ramp_std)
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


def _order_execute(signals: TrialSignals, found: FoundManoeuvre) -> Execute:
    """Return the execute at the order, or else at the beginning of the rudder's movement."""
    if signals.has("rudder_order"):
        ordered = order_sample(signals.rudder_order, found, signals.dt_secs)
        if np.isfinite(ordered):
            interval = signals.interval("rudder_order") / np.sqrt(12.0)
            return Execute(ordered, "rudder order (channel)", interval)
    started, std = _rudder_start(signals, found)
    return Execute(started, "rudder order (beginning of the rudder's movement)", std)


def _rudder_start(signals: TrialSignals, found: FoundManoeuvre) -> tuple[float, float]:
    """Return where the rudder begins to move, and the uncertainty of the instant, s."""
    noise, dt = signals.noise.get("rudder", 0.0), signals.dt_secs
    if signals.interval("rudder") > SPARSE_SECS:
        return sparse_start(signals, found.execute, found.movement)
    return ramp_start(signals.rudder, found.execute, found.movement, dt, noise)


def sparse_start(signals: TrialSignals, leaves: int, side: float) -> tuple[float, float]:
    """Return where a rudder begins to move that is recorded more seldom than it moves.

    It does so after the last sample at its old angle, and so long before the next one as a gear
    needs for the angle reached there: one that is not faster than `FASTEST_GEAR`, and not slower
    than the movement between samples. Any instant between has the same probability.

    Parameters
    ----------
    signals
        Without NaN, interpolated between the samples.
    leaves
        A sample of the clock close to the beginning.
    side
        1 for a movement to starboard, -1 to port.

    Returns
    -------
    sample
        Of the clock, with its fraction: the middle of the time that is possible.
    std_secs
        Standard uncertainty of that instant, s.
    """
    dt, interval = signals.dt_secs, signals.interval("rudder")
    width = max(1, round(interval / dt))
    first = max(0, leaves - 2 * width)
    part = side * signals.rudder[first : leaves + 2 * width + 1]
    if len(part) < 2 * width:
        return float(leaves), interval / np.sqrt(12.0)
    slopes = np.diff(part)  # constant between two samples
    start = int(np.argmax(slopes > 0.98 * np.max(slopes)))
    helm = signals.rudder[max(0, first - round(HELM_SCATTER_SECS / dt)) : first + 1]
    least = max(
        2.5 * float(np.std(helm)), MIN_FIRST_SHARE * (part[start + 1 :].max() - part[start])
    )
    if start >= width and part[start] - part[start - width] > least:
        start -= width  # it moved a little before the sample from which it moved most
    at = np.minimum(start + width * np.arange(3), len(part) - 1)
    moved, later = np.maximum(np.diff(part[at]), 0.0)
    slowest = max(moved, later, 1e-9) / interval
    earliest = max(0.0, interval - moved / slowest - POSSIBLE_SECS)
    latest = min(interval, max(interval - moved / FASTEST_GEAR, earliest) + POSSIBLE_SECS)
    std = (latest - earliest) / float(np.sqrt(12.0))
    return first + start + (earliest + latest) / 2 / dt, std


def _other_execute(signals: TrialSignals, found: FoundManoeuvre) -> Execute:
    """Return the execute of a manoeuvre that no order of the rudder begins."""
    if found.kind in (ManoeuvreKind.STOPPING, ManoeuvreKind.ACCELERATION):
        side = -1.0 if found.kind is ManoeuvreKind.STOPPING else 1.0
        noise = signals.noise.get("rpm", 0.0)
        started, std = ramp_start(signals.rpm, found.execute, side, signals.dt_secs, noise)
        return Execute(started, "beginning of the revolutions' change", std)
    spiral = found.kind in (ManoeuvreKind.DIRECT_SPIRAL, ManoeuvreKind.REVERSE_SPIRAL)
    rule = "end of the approach" if spiral else "beginning of the steady run"
    return Execute(float(found.execute), rule, 0.0)


def order_sample(order: FloatArray, found: FoundManoeuvre, dt: float) -> float:
    """Return where the ordered angle is half changed; NaN where it is not.

    Between two samples of the order, the instant of the change is known to half their interval.
    """
    first = max(0, found.execute - round(ORDER_SECS[0] / dt))
    part = found.movement * order[first : found.execute + round(ORDER_SECS[1] / dt) + 1]
    if len(part) < 2 or part[-1] - np.median(part[: len(part) // 2]) < MIN_ORDER_CHANGE:
        return np.nan
    half = (part[-1] + float(np.median(part[: len(part) // 2]))) / 2
    last_below = int(np.flatnonzero(part < half)[-1])
    share = (half - part[last_below]) / (part[last_below + 1] - part[last_below])
    return first + last_below + float(share)


def ramp_start(
    values: FloatArray, leaves: int, side: float, dt: float, noise: float = 0.0
) -> tuple[float, float]:
    """Find where the movement of a rudder, or of the revolutions, begins.

    A line is laid through the ramp, and one through the helm before it; they meet at the
    beginning.

    Parameters
    ----------
    values
        (n,) such as the rudder, rad.
    leaves
        A sample close to the beginning.
    side
        1 for a movement up (to starboard), -1 down.
    dt
        Sample interval, s.
    noise
        Standard deviation of the noise, in the unit of the values: with few samples, the scatter
        about a line may be smaller by chance.

    Returns
    -------
    sample
        With its fraction.
    std_secs
        Standard uncertainty of that instant, s, from the scatter about both lines.
    """
    window = max(2, round(HELM_LINE_SECS / dt))
    since = max(0, leaves - window)
    before = side * values[since : leaves + 1]
    helm = float(np.median(before))
    ahead = side * values[leaves : leaves + round(MAX_RAMP_SECS / dt)] - helm
    if len(ahead) < 3 or np.max(ahead) <= 0:
        return float(leaves), dt
    top = int(np.argmax(ahead >= 0.9 * np.max(ahead)))
    target = float(np.median(ahead[top : top + window + 1]))
    first, last = (int(np.argmax(ahead > share * target)) for share in RAMP_SHARES)
    if last - first < 2:  # a step: somewhere within two samples
        return float(max(0, leaves + first - 1)), dt / np.sqrt(3.0)
    ramp_samples = np.arange(leaves + first, leaves + last + 1)
    ramp = _line(ramp_samples, ahead[first : last + 1] + helm, noise)
    level = _line(np.arange(since, leaves + 1), before, noise)
    rise = ramp.slope - level.slope
    met = (level.intercept - ramp.intercept) / rise if rise > 0 else np.inf
    if not leaves + first - 2 * window <= met <= leaves + first:
        return float(leaves), window * dt
    std = float(np.hypot(ramp.std_at(met), level.std_at(met))) / rise
    return max(0.0, float(met)), std * dt


@dataclass(frozen=True)
class _Line:
    """A straight line through samples, with the uncertainty of its values."""

    slope: float
    intercept: float
    scatter: float
    count: int
    mean: float
    square: float

    def std_at(self, x: float) -> float:
        """Return the standard uncertainty of the line's value at x."""
        return self.scatter * float(np.sqrt(1 / self.count + (x - self.mean) ** 2 / self.square))


def _line(x: NDArray[np.int64], y: FloatArray, noise: float) -> _Line:
    """Lay a line through k samples; through less than three, a level."""
    if len(x) < 3:
        scatter = max(float(np.ptp(y)), noise)
        return _Line(0.0, float(np.mean(y)), scatter, len(x), float(x[-1]), 1.0)
    slope, intercept = np.polyfit(x, y, 1)
    scatter = float(np.sqrt(np.sum((y - slope * x - intercept) ** 2) / (len(x) - 2)))
    mean = float(np.mean(x))
    square = float(np.sum((x - mean) ** 2))
    return _Line(float(slope), float(intercept), max(scatter, noise), len(x), mean, square)


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

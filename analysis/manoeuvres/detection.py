"""Detection of the manoeuvres in a trial of any length, from rudder, heading, speed and rpm."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees, pi, radians

import numpy as np

from .found_manoeuvre import FoundManoeuvre
from .rudder_levels import HeldLevel, merged_levels, neutral_rudder, rudder_levels
from .sailed_manoeuvre import ManoeuvreKind, NotComputed
from .speed_manoeuvres import find_speed_manoeuvres
from .spirals import find_direct_spirals, find_reverse_spirals, is_steered
from .start_rules import SPARSE_SECS, ramp_start, sparse_start
from .straight_runs import find_straight_runs
from .trial_signals import TrialSignals, filled_signals, noise_std

MIN_DEFLECTION = radians(4.0)  # of a manoeuvre's rudder from neutral
REPORTED_DEFLECTION = radians(5.0)  # beyond it, rudder that is no manoeuvre is reported
LIKE_ANGLES, LIKE_ANGLES_SHARE = radians(3.0), 0.25  # of both sides of a zig-zag
SLOWEST_GEAR = radians(0.45)  # rad/s, of a reversal without a stop
REVERSAL_SECS = 6.0  # of a reversal, beside the time the gear needs
PASSING_SECS = 3.0  # shorter stops of a rudder on its way to the other side
MIN_TURN = pi / 2  # of a turning circle
MIN_STEADY_TURN = radians(60.0)  # before a pull-out
MIN_PULL_OUT_SECS = 40.0
UNSTEADY_SHARE, UNSTEADY_RATE = 0.2, radians(0.05)  # rad/s, of both halves of a turn's last quarter
PULL_OUT_HELM = radians(1.0)  # of the rudder held midships, noise aside
FULL_TURN = radians(210.0)  # with less rudder than `HARD_RUDDER`, a shorter turn changes course
HARD_RUDDER = radians(25.0)
MAX_RETURN = radians(30.0)  # beyond twice the heading of a zig-zag's reversal, with no reversal
MIN_SWITCH, MIN_SWITCH_SHARE = radians(1.0), 0.4  # of the heading at a reversal; of the first one
MIN_RETURN = 0.5  # of the heading at the last reversal, that a zig-zag goes back from it
MAX_RECOVERY_SECS = 150.0
INITIAL_TURN = radians(10.0)
INITIAL_TURN_RUDDER, RUDDER_TOLERANCE = radians(10.0), radians(1.25)
MIN_MOVING_SPEED = 0.5  # m/s: a slower ship is stopped
OVERSHOOT_TAIL = 0.5  # of the last hold of a zig-zag, in which its last overshoot is looked for


@dataclass(frozen=True, eq=False)
class Detection:
    """What is found in the signals of a trial.

    Attributes
    ----------
    manoeuvres
        In the order of their executes.
    neutral
        The rudder angle that keeps a straight course, rad.
    rejected
        Rudder orders that belong to no manoeuvre, each with the reason.
    """

    manoeuvres: tuple[FoundManoeuvre, ...]
    neutral: float
    rejected: tuple[NotComputed, ...]


def detect_manoeuvres(signals: TrialSignals) -> Detection:
    """Find and classify the manoeuvres in the signals of a trial.

    Parameters
    ----------
    signals
        As measured.

    Returns
    -------
    Detection
        The manoeuvres, and what is none of them.
    """
    filled = filled_signals(signals)
    if not np.isfinite(filled.rudder).any():
        runs = (*find_speed_manoeuvres(filled), *find_straight_runs(filled, ()))
        return Detection(tuple(sorted(runs, key=lambda each: each.execute)), 0.0, ())
    levels = rudder_levels(filled.rudder, filled.dt_secs)
    neutral = neutral_rudder(levels)
    found: list[FoundManoeuvre] = [
        each
        for each in find_reverse_spirals(filled.heading, neutral, filled.dt_secs)
        if is_steered(filled.rudder, each, filled.dt_secs)
    ]
    direct = find_direct_spirals(filled.rudder, neutral, filled.dt_secs)
    found += [each for each in direct if not _overlaps(each, found)]
    found += [each for each in find_speed_manoeuvres(filled) if not _overlaps(each, found)]
    rejected: list[NotComputed] = []
    scan = _RudderScan(filled, merged_levels(levels, neutral, filled.dt_secs), neutral)
    for each in scan.results(found):
        (rejected if isinstance(each, NotComputed) else found).append(each)  # type: ignore[arg-type]
    straight = find_straight_runs(filled, found)
    # between manoeuvres a straight run is an approach or a recovery
    found += [run for run in straight if not found or run.kind is ManoeuvreKind.SPEED_RUN]
    return Detection(tuple(sorted(found, key=lambda each: each.execute)), neutral, tuple(rejected))


def _overlaps(one: FoundManoeuvre, others: list[FoundManoeuvre]) -> bool:
    return any(one.execute < each.end and each.execute < one.end for each in others)


class _RudderScan:
    """Classifies the stretches of held rudder, from the first to the last."""

    def __init__(self, signals: TrialSignals, levels: list[HeldLevel], neutral: float) -> None:
        self._signals, self._dt = signals, signals.dt_secs
        self._neutral, self._recovery = neutral, -1
        passing = PASSING_SECS / self._dt
        self._levels = [
            held
            for held in levels
            if abs(held.level - neutral) >= MIN_DEFLECTION or held.last - held.first > passing
        ]

    def results(self, found: list[FoundManoeuvre]) -> Iterator[FoundManoeuvre | NotComputed]:
        """Yield manoeuvres, and the reasons for rudder orders that are none."""
        spans = [(each.execute, each.end) for each in found]
        k = 0
        while k < len(self._levels):
            held = self._levels[k]
            taken = any(held.first < end and first <= held.last for first, end in spans)
            if taken or not self._is_over(held):
                k += 1
                continue
            chain = self._zigzag_chain(k) if self._has_approach(k) else []
            zigzag = self._zigzag(chain) if len(chain) > 1 else None
            if zigzag is not None:
                yield zigzag
                while k < len(self._levels) and self._levels[k].first < zigzag.end:
                    k += 1
                self._recovery = k
            else:
                for each in self._single(k):
                    yield each
                    if isinstance(each, FoundManoeuvre):
                        self._recovery = k + 1
                k += 1

    def _is_over(self, held: HeldLevel) -> bool:
        return abs(held.level - self._neutral) >= MIN_DEFLECTION

    def _has_approach(self, k: int) -> bool:
        """Whether the rudder is near neutral before the k-th level, or the log begins with it."""
        return abs(self._approach_level(k) - self._neutral) < MIN_DEFLECTION

    def _begins(self, k: int) -> int:
        """Return the sample at which the rudder leaves the level before the k-th."""
        return self._levels[k - 1].last if k else 0

    def _leaves(self, held: HeldLevel) -> int:
        """Return the sample at which the rudder leaves its angle for the other side."""
        side = -1.0 if held.level > self._neutral else 1.0
        if self._signals.interval("rudder") > SPARSE_SECS:
            start, _ = sparse_start(self._signals, held.last, side)
        else:
            start, _ = ramp_start(self._signals.rudder, held.last, side, self._dt)
        return round(start)

    def _approach_level(self, k: int) -> float:
        return self._levels[k - 1].level if k else float(self._signals.rudder[0])

    def _zigzag_chain(self, k: int) -> list[HeldLevel]:
        """Return the k-th level and those after it that alternate in side at like angles."""
        chain = [self._levels[k]]
        for held in self._levels[k + 1 :]:
            before, first = chain[-1].level - self._neutral, chain[0].level - self._neutral
            now = held.level - self._neutral
            # equal as ordered, or from neutral where the sensor's zero is wrong
            ordered = abs(abs(held.level) - abs(chain[0].level))
            tolerance = max(LIKE_ANGLES, LIKE_ANGLES_SHARE * abs(first))
            like = min(abs(abs(now) - abs(first)), ordered) <= tolerance
            secs = (held.first - chain[-1].last) * self._dt
            longest = REVERSAL_SECS + abs(now - before) / SLOWEST_GEAR
            if before * now >= 0 or not like or secs > longest or not self._is_over(held):
                break
            chain.append(held)
        return chain

    def _zigzag(self, chain: list[HeldLevel]) -> FoundManoeuvre | None:
        """Return the zig-zag of a chain; None where the headings at its reversals are none."""
        heading = self._signals.heading
        k = self._levels.index(chain[0])
        execute = self._begins(k)
        reversals = tuple(self._leaves(held) for held in chain[:-1])
        changes = heading[list(reversals)] - np.mean(
            heading[max(0, execute - round(30 / self._dt)) : execute + 1]
        )
        sides = np.sign([held.level - self._neutral for held in chain[:-1]])
        beyond = changes * sides
        if not np.isfinite(beyond).all() or beyond[0] < MIN_SWITCH:
            return None
        # like rudder with which the ship is steadied at the end is no reversal of the zig-zag
        early = np.flatnonzero(beyond < max(MIN_SWITCH, MIN_SWITCH_SHARE * beyond[0]))
        count = int(early[0]) if len(early) else len(beyond)
        changes, sides, reversals = changes[:count], sides[:count], reversals[:count]
        chain, last = chain[: count + 1], chain[count]
        end = last.last
        back = -sides[-1] * (heading[reversals[-1] : end + 1] - heading[reversals[-1]])
        returned = float(back[-1])
        if np.max(np.abs(changes)) > MIN_TURN:
            return None
        if returned > 3 * abs(changes[-1]) + MAX_RETURN:
            if count == 1:
                return None
            # the last angle is kept to turn to another course
            end = reversals[-1] + int(np.argmax(back > 2 * abs(changes[-1])))
        is_cut = end >= len(heading) - 2
        if len(chain) == 2 and not is_cut and returned < MIN_RETURN * abs(changes[-1]):
            return None  # the ship is steadied on another course
        return FoundManoeuvre(
            ManoeuvreKind.ZIGZAG,
            execute,
            end + 1,
            chain[0].level - self._neutral,
            self._approach_level(k),
            reversals,
        )

    def _single(self, k: int) -> Iterator[FoundManoeuvre | NotComputed]:
        """Yield the turn of a rudder that is held over once, and the pull-out after it."""
        held, signals, dt = self._levels[k], self._signals, self._dt
        level = held.level - self._neutral
        if k == 0 and held.first * dt < 1.0:
            yield self._rejected(held, "the log begins with the rudder held over")
            return
        if not self._has_approach(k):
            secs = (held.last - held.first) * self._dt
            if k == self._recovery and secs < MAX_RECOVERY_SECS:
                return  # the ship is steadied after a manoeuvre
            before = degrees(self._approach_level(k) - self._neutral)
            yield self._rejected(held, f"the rudder is at {before:.0f}° before it: no approach")
            return
        execute = self._begins(k)
        turned = np.sign(level) * (signals.heading[execute : held.last + 1])
        turned = turned - turned[0]
        most = float(turned[-1]) if len(turned) else np.nan
        pull_out = self._pull_out(k, most)
        made = (execute, held.last + 1, level, self._approach_level(k))
        is_circle = self._is_circle(held, most)
        if is_circle and (most >= 2 * MIN_TURN or pull_out is None):
            yield FoundManoeuvre(ManoeuvreKind.TURNING_CIRCLE, *made)
        elif pull_out is None:
            angles = np.abs([level, held.level])  # from neutral, or as ordered
            is_10 = bool(np.min(np.abs(angles - INITIAL_TURN_RUDDER)) <= RUDDER_TOLERANCE)
            if is_10 and INITIAL_TURN <= most < MIN_TURN:
                yield FoundManoeuvre(ManoeuvreKind.INITIAL_TURNING, *made)
            elif abs(level) >= REPORTED_DEFLECTION:
                yield self._rejected(held, self._reason(held, most))
        if pull_out is not None:
            yield pull_out

    def _is_circle(self, held: HeldLevel, turned: float) -> bool:
        """Whether a turn is a turning circle, perhaps cut short, and no change of course."""
        is_hard = abs(held.level - self._neutral) >= HARD_RUDDER
        is_last = held.last >= len(self._signals) - 1 - MIN_PULL_OUT_SECS / self._dt
        return turned >= (MIN_TURN if is_hard or is_last else FULL_TURN)

    def _reason(self, held: HeldLevel, turned: float) -> str:
        secs = (held.last - held.first) * self._dt
        if not np.isfinite(turned):
            return "no heading and no yaw rate in the log"
        if turned >= MIN_TURN:
            return (
                f"the heading changes by {degrees(turned):.0f}° and is kept then: a change of "
                f"course; a turning circle at less than {degrees(HARD_RUDDER):.0f}° needs "
                f"{degrees(FULL_TURN):.0f}°"
            )
        return (
            f"held for {secs:.0f} s, in which the heading changes by {degrees(turned):.0f}°: a "
            f"turning circle needs {degrees(MIN_TURN):.0f}°, a zig-zag an equal angle to the "
            f"other side{self._sparse()}"
        )

    def _sparse(self) -> str:
        """Return a remark on a rudder that is recorded too seldom for reversals; else nothing."""
        interval = self._signals.interval("rudder")
        remark = f"; the rudder is recorded every {interval:.0f} s, too seldom for quick reversals"
        return remark if interval > SPARSE_SECS else ""

    def _rejected(self, held: HeldLevel, reason: str) -> NotComputed:
        at, level = held.first * self._dt, degrees(held.level - self._neutral)
        side = "starboard" if level > 0 else "port"
        return NotComputed(f"rudder {abs(level):.0f}° to {side} at {at:.0f} s", reason)

    def _pull_out(self, k: int, turned: float) -> FoundManoeuvre | None:
        """Return the pull-out after the k-th level; None where there is none."""
        if k + 1 >= len(self._levels) or not turned >= MIN_STEADY_TURN:
            return None
        held, after = self._levels[k], self._levels[k + 1]
        midships = abs(after.level - self._neutral) < radians(2.0)
        if not midships or (after.last - after.first) * self._dt < MIN_PULL_OUT_SECS:
            return None
        secs = (after.first - held.last) * self._dt
        if secs > REVERSAL_SECS + abs(held.level - after.level) / SLOWEST_GEAR:
            return None
        settled = after.first + round(PASSING_SECS / self._dt)
        midship = self._signals.rudder[settled : settled + round(MIN_PULL_OUT_SECS / self._dt)]
        noise = min(noise_std(self._signals.rudder), PULL_OUT_HELM)
        if np.percentile(midship, 95) - np.percentile(midship, 5) > PULL_OUT_HELM + 4 * noise:
            return None  # steered
        eighth = max(1, (held.last - held.first) // 8)
        turned_by = np.diff(
            self._signals.heading[[held.last - 2 * eighth, held.last - eighth, held.last]]
        )
        rates = turned_by / (eighth * self._dt)
        if np.ptp(rates) > UNSTEADY_SHARE * abs(float(np.mean(rates))) + UNSTEADY_RATE:
            return None  # not yet steady
        level = held.level - self._neutral
        return FoundManoeuvre(ManoeuvreKind.PULL_OUT, held.last, after.last + 1, level, after.level)

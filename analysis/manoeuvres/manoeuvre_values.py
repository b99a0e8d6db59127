"""Values of a manoeuvre's indices from corrected signals, one function a kind of manoeuvre."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from shiplog.types import FloatArray

from .execute import approach_heading, first_crossing, smooth_heading
from .found_manoeuvre import FoundManoeuvre
from .manoeuvre import ManoeuvreMotion
from .sailed_manoeuvre import ManoeuvreKind
from .spiral_curve import spiral_curve, spiral_loop, steered_loop
from .trial_signals import TrialSignals, chord_ends, slope
from .turning_circle import COURSE_SECS, turning_circle
from .zigzag import zigzag_values

CIRCLE_NAMES = {
    "advance": "advance",
    "transfer": "transfer",
    "tactical_diameter": "tactical diameter",
    "steady_diameter": "steady diameter",
    "drift_angle": "drift angle",
    **{f"time_{angle}_secs": f"time to {angle}°" for angle in (90, 180, 270, 360)},
    **{f"speed_{angle}": f"speed at {angle}°" for angle in (90, 180, 270, 360)},
    "steady_yaw_rate": "steady yaw rate",
    "steady_speed": "steady speed",
}
TRACK_INDICES = (
    "advance", "transfer", "tactical diameter", "steady diameter", "drift angle",
    "track reach", "head reach", "lateral deviation",
)  # fmt: skip
PATH_STEP_SECS = 2.0  # of the chords whose sum is a distance travelled
MAX_TRACK_SMOOTHING_SECS = 10.0
INITIAL_TURN = pi / 18
MEAN_SECS = 10.0  # before an execute, over which speed and revolutions of the approach are taken


@dataclass(frozen=True, eq=False)
class IndexCase:
    """A manoeuvre whose indices are to be computed, with smooth and corrected signals.

    Attributes
    ----------
    signals
        Of the manoeuvre and its approach.
    found
        The manoeuvre; its samples are those of the signals.
    execute
        The sample of the execute, with its fraction.
    approach
        The approach heading, rad.
    switch
        Of a zig-zag the switch heading, rad; else NaN.
    """

    signals: TrialSignals
    found: FoundManoeuvre
    execute: float
    approach: float
    switch: float = np.nan

    @property
    def first(self) -> int:
        """The sample next to the execute."""
        return round(self.execute)

    @property
    def approach_speed(self) -> float:
        """Mean speed before the execute, m/s."""
        return mean_before(self.signals.speed, self.first, self.signals.dt_secs)


def mean_before(values: FloatArray, sample: int, dt: float) -> float:
    """Return the mean of values, (n,), over up to `MEAN_SECS` before a sample."""
    return float(np.mean(values[max(0, sample - round(MEAN_SECS / dt)) : sample + 1]))


def smoothed(signals: TrialSignals, half_secs: float) -> TrialSignals:
    """Return the signals with heading, speed and track smoothed by parabolas.

    Parameters
    ----------
    signals
        Without NaN where measured.
    half_secs
        Half the width of the heading's parabola, s; the track's is half as wide.
    """
    dt, count = signals.dt_secs, len(signals)

    def smooth(values: FloatArray, secs: float) -> FloatArray:
        half = min(round(secs / dt), (count - 1) // 2)
        return values if half < 2 or not np.isfinite(values).all() else smooth_heading(values, half)

    track = min(half_secs / 2, MAX_TRACK_SMOOTHING_SECS)
    return replace(
        signals,
        heading=smooth(signals.heading, half_secs),
        speed=smooth(signals.speed, half_secs),
        sway=smooth(signals.sway, half_secs),
        yaw_rate=smooth(signals.yaw_rate, half_secs),
        positions=np.column_stack([smooth(column, track) for column in signals.positions.T]),
    )


def with_sway(signals: TrialSignals) -> TrialSignals:
    """Return the signals with the sway that their track shows, where none was measured."""
    if signals.has("sway") or not np.isfinite(signals.positions).all() or len(signals) < 3:
        return signals
    velocity = [slope(column, signals.dt_secs, COURSE_SECS) for column in signals.positions.T]
    chords = chord_ends(len(signals), signals.dt_secs, COURSE_SECS)
    # of the instant of the velocity, which at the ends of the log is the centre of a shorter chord
    heading = np.interp(np.mean(chords, axis=0), np.arange(len(signals)), signals.heading)
    across = velocity[1] * np.cos(heading) - velocity[0] * np.sin(heading)
    return replace(signals, sway=across)


def distance_travelled(signals: TrialSignals, first: float, last: float) -> float:
    """Return the distance through the water between two samples, m, by track or else by speed."""
    if not np.isfinite(first + last) or last <= first:
        return np.nan
    count = max(2, round((last - first) * signals.dt_secs / PATH_STEP_SECS) + 1)
    at, samples = np.linspace(first, last, count), np.arange(len(signals))
    if np.isfinite(signals.positions).all():
        places = [np.interp(at, samples, column) for column in signals.positions.T]
        return float(np.sum(np.hypot(*np.diff(places))))
    speeds = np.interp(at, samples, signals.speed)
    return float(np.trapezoid(speeds, at) * signals.dt_secs)


def circle_values(case: IndexCase) -> dict[str, float]:
    """Compute the indices of a turning circle."""
    signals, end = case.signals, case.found.end
    speed = np.hypot(signals.speed, np.nan_to_num(signals.sway))
    motion = ManoeuvreMotion(
        signals.heading[:end], signals.yaw_rate[:end], speed[:end], signals.positions[:end]
    )
    circle = turning_circle(
        motion, signals.rudder[:end], signals.dt_secs, approach=case.approach, execute=case.execute
    )
    values = {name: float(getattr(circle, key)) for key, name in CIRCLE_NAMES.items()}
    values["speed loss"] = 1.0 - values["steady speed"] / case.approach_speed
    return values | initial_turning_values(case)


def initial_turning_values(case: IndexCase) -> dict[str, float]:
    """Compute time and distance to a change of heading of 10°."""
    change = case.found.side * (case.signals.heading - case.approach)
    at = case.first + first_crossing(change[case.first :], INITIAL_TURN)
    return {
        "initial turning time": (at - case.execute) * case.signals.dt_secs,
        "initial turning distance": distance_travelled(case.signals, case.execute, at),
    }


def zigzag_case_values(case: IndexCase) -> dict[str, float]:
    """Compute the indices of a zig-zag, in SI."""
    signals, found = case.signals, case.found
    switch = found.side * case.switch
    values = zigzag_values(
        signals.heading - case.approach, case.execute, found.reversals, found.end, switch
    )
    crossing = case.execute + values["initial turning time"]
    for name in ("initial turning time", "reach", "period"):
        values[name] *= signals.dt_secs
    values["initial turning distance"] = distance_travelled(signals, case.execute, crossing)
    return values


def stopping_values(case: IndexCase) -> dict[str, float]:
    """Compute the indices of a stopping manoeuvre, to the end of the movement ahead."""
    signals, first = case.signals, case.first
    speed = signals.speed[first : case.found.end]
    at = first + first_crossing(-speed, 0.0)
    if not np.isfinite(at) and speed[-1] <= max(0.15, 0.03 * case.approach_speed):
        at = float(case.found.end - 1)
    names = ("stopping time", "track reach", "head reach", "lateral deviation", "heading change")
    if not np.isfinite(at):
        return dict.fromkeys(names, np.nan)
    samples = np.arange(len(signals))
    ends = [
        complex(*(float(np.interp(x, samples, column)) for column in signals.positions.T))
        for x in (case.execute, at)
    ]
    made_good = (ends[1] - ends[0]) * np.exp(-1j * case.approach)
    turned = float(np.interp(at, samples, signals.heading)) - case.approach
    return {
        "stopping time": (at - case.execute) * signals.dt_secs,
        "track reach": distance_travelled(signals, case.execute, at),
        "head reach": float(made_good.real),
        "lateral deviation": float(made_good.imag),
        "heading change": turned,
    }


def pull_out_values(case: IndexCase) -> dict[str, float]:
    """Compute the yaw rates before a pull-out and at its end."""
    signals, first, end = case.signals, case.first, case.found.end
    tail = max(2, (end - first) // 4)
    back = min(first, round(20.0 / signals.dt_secs))
    dt = signals.dt_secs
    residual = (signals.heading[end - 1] - signals.heading[end - tail]) / ((tail - 1) * dt)
    steady = (signals.heading[first] - signals.heading[first - back]) / max(back * dt, dt)
    return {
        "yaw rate before": case.found.side * float(steady),
        "residual yaw rate": case.found.side * float(residual),
    }


def spiral_values(case: IndexCase) -> dict[str, float]:
    """Compute height and width of the loop of a spiral."""
    points = spiral_curve(case.signals, case.found.levels)
    is_reverse = case.found.kind is ManoeuvreKind.REVERSE_SPIRAL
    loop = steered_loop if is_reverse else spiral_loop
    height, width = loop(points - [case.found.approach_level, 0.0])
    return {"loop height": height, "loop width": width}


def acceleration_values(case: IndexCase) -> dict[str, float]:
    """Compute final speed, and time and distance to 90 % of the gain in speed."""
    signals, first, end = case.signals, case.first, case.found.end
    tail = max(1, (end - first) // 10)
    final = float(np.mean(signals.speed[end - tail : end]))
    initial = case.approach_speed
    at = first + first_crossing(signals.speed[first:end], initial + 0.9 * (final - initial))
    return {
        "final speed": final,
        "time to 90 % of the speed gain": (at - case.execute) * signals.dt_secs,
        "distance to 90 % of the speed gain": distance_travelled(signals, case.execute, at),
    }


def straight_values(case: IndexCase) -> dict[str, float]:
    """Compute the mean speeds of a straight run through the water and over the ground."""
    signals, part = case.signals, slice(case.found.execute, case.found.end)
    values = {"speed through the water": float(np.mean(signals.speed[part]))}
    length = np.hypot(*(signals.positions[part][-1] - signals.positions[part][0]))
    secs = (part.stop - 1 - part.start) * signals.dt_secs
    values["speed by track"] = float(length) / secs
    values["revolutions"] = float(np.mean(signals.rpm[part]))
    values["power"] = float(np.mean(signals.power[part]))
    return values


VALUES: Mapping[ManoeuvreKind, Callable[[IndexCase], dict[str, float]]] = {
    ManoeuvreKind.TURNING_CIRCLE: circle_values,
    ManoeuvreKind.ZIGZAG: zigzag_case_values,
    ManoeuvreKind.INITIAL_TURNING: initial_turning_values,
    ManoeuvreKind.PULL_OUT: pull_out_values,
    ManoeuvreKind.DIRECT_SPIRAL: spiral_values,
    ManoeuvreKind.REVERSE_SPIRAL: spiral_values,
    ManoeuvreKind.STOPPING: stopping_values,
    ManoeuvreKind.ACCELERATION: acceleration_values,
    ManoeuvreKind.SPEED_RUN: straight_values,
    ManoeuvreKind.STRAIGHT: straight_values,
}


def index_case(
    signals: TrialSignals,
    found: FoundManoeuvre,
    execute: float,
    half_secs: float,
    switch: float = np.nan,
) -> IndexCase:
    """Return a case with smoothed signals and the approach heading.

    Parameters
    ----------
    signals
        Corrected.
    found, execute, switch
        As in `IndexCase`.
    half_secs
        As in `smoothed`.
    """
    smooth = with_sway(smoothed(signals, half_secs))
    start = max(round(execute), round(1.0 / signals.dt_secs))  # at least a second of samples
    approach = approach_heading(signals.heading, min(start, len(signals) - 1), signals.dt_secs)
    return IndexCase(smooth, found, execute, approach, switch)

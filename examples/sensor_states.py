"""The section of docs/methods.md on sensor errors and disturbances as states of a filter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, radians
from pathlib import Path

import numpy as np
from papers.markdown_page import number, paragraph, table
from scipy.interpolate import CubicSpline

from analysis import Analysis, ReadingOptions, analyse
from analysis.filters.further_parts import CURRENT_WALK, DRIFT_WALK, SENSOR_WALKS
from analysis.replay.sensor_errors import SlowState, further_display
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import Gust
from shiplog import TrialLog, Vessel, load_vessel, read
from shiplog.types import FloatArray

SAMPLE_DATA = Path(__file__).resolve().parents[1] / "sample_data"
LOG_BIAS = 0.2  # m/s, added to its speed
TRANSIENT_SECS = 60.0
STEP_AT_SECS, STEP_RUDDER = 150.0, radians(2)
AUTO = {"filter.sensor_bias": "auto"}
EXTENDED = {"filter.kind": "extended", "filter.smooth": True}
CONDITIONS = {
    "gyro": "a heading",
    "log": "positions, a turn of half a circle",
    "log_scale": "positions, a turn of half a circle; beside a bias of the log also several speeds",
    "rudder": "no slow yaw moment among the disturbances (`--disturbance wave`)",
    "compass": "positions, a turn of half a circle",
}
EQUATIONS = """\
## Sensor errors and disturbances as states

`--sensor-bias auto` adds errors of the sensors to the states of any filter, and takes the heading
as a measurement, and the position too where the ship turns by half a circle or more. With the yaw
rate w and the speed v of the ship, what is measured is, without waves and white noise,

    yaw rate   w + b_gyro
    speed      (1 + s_log) v + b_log
    heading    ψ + b_compass + e    ψ' = w,  e' = −e/T + noise
    north      N                N' = v cos ψ + l w sin ψ + c_north
    east       E                E' = v sin ψ − l w cos ψ + c_east

and the rudder acts as δ − δ0. e is the slow error of the heading, whose standard deviation and
correlation time T are estimated from the log. l is the drift length (the sway is −l w), c the
current; both are states where there are positions. With `--smooth` the disturbances of
`--disturbance` are states too: a random walk of the yaw moment and of the surge force for
`constant`, its integral for `ramp`, a harmonic of random amplitude for `wave`. The errors begin
at zero with the standard deviations of the table, and are random walks:"""
REASONS = """\
`auto` selects the gyro and the speed log where the log determines them; others are added by name,
such as `--sensor-bias auto,compass`. What cannot be distinguished, by Hautus's test, is refused
with the measurement that would resolve it. Summary, JSON and the tab "sensors" of the review show
each error with its interval; where the innovations are much larger than expected, none counts as
determined. The coefficients are fitted to the channels as recorded, a gyro bias included."""


def sensor_states() -> None:
    """Print the section."""
    paragraph(EQUATIONS)
    walks = [(each, CONDITIONS[name], name) for name, each in SENSOR_WALKS.items()]
    walks += [(CURRENT_WALK, "positions, a turn of half a circle", "current_north")]
    walks += [(DRIFT_WALK, "positions, a turn of half a circle", "drift_length")]
    rows = []
    for walk, condition, name in walks:
        unit, factor = further_display(name, walk.unit)
        stds = (number(std * factor, 3) for std in (walk.std, walk.hourly_std))
        rows.append((walk.label, *stds, unit, condition))
    table("", ("state", "σ at the start", "σ of its change in an hour", "unit", "needs"), rows)
    paragraph(REASONS)
    biased_sensors()
    all_filters()
    step_of_yaw_moment()


@dataclass(frozen=True)
class Case:
    """A log of the sample data with its true states, and how it is replayed."""

    label: str
    log: TrialLog
    truth: TrialLog
    settings: Mapping[str, object]
    vessel: Vessel | None = None


def cases() -> tuple[Case, ...]:
    """Return the cases of the table of the smoothed filter."""
    zigzag, circle = (sample(name) for name in ("zigzag_10_10_dropouts", "turning_circle_35"))
    speed = circle[0]["speed"]
    biased = replace(speed, values=speed.values + LOG_BIAS)
    with_bias = replace(circle[0], channels=(biased, *(c for c in circle[0] if c is not speed)))
    no_heading = replace(zigzag[0], channels=tuple(c for c in zigzag[0] if c.name != "heading"))
    gyro = {"filter.sensor_bias": "gyro", "disturbance.models": ["wave"]}
    noise = {"filter.process_ratio": "auto"}
    return (
        Case("gyro with a bias: none", *zigzag, {}),
        Case("the same: auto", *zigzag, AUTO),
        Case("no heading: gyro, no slow yaw moment", no_heading, zigzag[1], gyro),
        Case("wrong model: none", *zigzag, noise, wrong_model()),
        Case("wrong model: auto", *zigzag, noise | AUTO, wrong_model()),
        Case("speed log with a bias: none", with_bias, circle[1], {}),
        Case("the same circle: auto", with_bias, circle[1], AUTO),
    )


def sample(name: str) -> tuple[TrialLog, TrialLog]:
    """Return a log of the sample data and its true states."""
    return read(SAMPLE_DATA / f"{name}.mcap"), read(SAMPLE_DATA / f"{name}.truth.mcap")


def biased_sensors() -> None:
    """Print the errors of the smoothed extended filter, without and with sensor errors."""
    rows = []
    for case in cases():
        options = ReadingOptions(vessel=case.vessel)
        result = analyse(case.log, options, settings=EXTENDED | case.settings)
        findings = result.findings
        rows.append(
            (
                case.label,
                number(degrees(error(result, case.truth, "yaw_rate", 0)) * 1e3, 2),
                number(error(result, case.truth, "speed", 3), 2),
                *(stated(findings.sensor_errors, name) for name in ("gyro", "log")),
                number(degrees(findings.disturbances["rudder"].rms), 2),
                number(findings.residuals[0].mean_nis, 3),
            )
        )
    paragraph(
        "The extended filter, smoothed, with two logs of the sample data: the zig-zag 10/10, whose"
        " gyro has a bias of 0.02 °/s, and the turning circle, with a bias of"
        f" {number(LOG_BIAS)} m/s added to its speed. The wrong model has a T1 20 % and an h 10 %"
        " too large, and its process noise is estimated from the log. Rms errors, sensor errors"
        " with their 95 % intervals, the rms of the yaw moment as rudder, which is none in truth,"
        " and the NIS of the yaw rate:"
    )
    header = (
        "log and sensor errors", "yaw rate (0.001 °/s)", "speed (m/s)", "gyro bias (°/s)",
        "speed log bias (m/s)", "yaw moment (°)", "NIS",
    )  # fmt: skip
    table("", header, rows)


def all_filters() -> None:
    """Print the error of the yaw rate by each filter with sensor errors."""
    log, truth = sample("zigzag_10_10_dropouts")
    rows = []
    for kind in ("pseudo-input", "steady-state", "quality", "per-tick", "extended"):
        result = analyse(log, settings={"filter.kind": kind} | AUTO)
        found = number(degrees(error(result, truth, "yaw_rate", 0)) * 1e3, 2)
        rows.append((kind, found, stated(result.findings.sensor_errors, "gyro")))
    paragraph(
        "The zig-zag by each filter with `auto`, not smoothed. The filters with a gain of their own"
        " keep it for yaw rate and speed; all further states have the optimal gain:"
    )
    table("", ("filter", "yaw rate (0.001 °/s)", "gyro bias (°/s)"), rows)


def step_of_yaw_moment() -> None:
    """Print the error of a step of the yaw moment, by the observer and smoothed."""
    vessel, text = load_vessel("table1")
    gust = Gust(STEP_RUDDER, STEP_AT_SECS)
    trial = simulate(vessel, "zigzag-20-20", duration_secs=600.0, seed=6, gusts=(gust,))
    log = TrialLog("trial.mcap", trial.channels, trial.metadata, text)
    size = float(trial.trajectory.at(np.array([599.0]))["yaw_disturbance"][0])
    rows = []
    for label, smooth in (("the observer", False), ("a state, smoothed", True)):
        result = analyse(log, settings={"filter.kind": "extended", "filter.smooth": smooth})
        at = result.signals.time_secs
        difference = result.disturbance.yaw - trial.trajectory.at(at)["yaw_disturbance"]
        whole = 100 * rms(difference[at >= TRANSIENT_SECS]) / size
        after = 100 * rms(difference[at >= 2 * STEP_AT_SECS]) / size
        rows.append((label, f"{number(whole, 3)} %", f"{number(after, 3)} %"))
    paragraph(
        "A step of the yaw moment of 2° of rudder at 150 s, in a zig-zag of ten minutes with the"
        " noise of the paper: the rms error of the moment in percent of the step. The observer"
        " follows the step late; the smoother uses what came after it as well:"
    )
    header = ("yaw moment by", "from 60 s on", "from 300 s on")
    table("", header, rows)


def wrong_model() -> Vessel:
    """Return the paper's ship with T1 20 % and h 10 % too large."""
    vessel, _ = load_vessel("table1")
    c, T1, T2 = vessel.paper_coefficients, 180.0, 50.0
    scaled = {name: getattr(c, name) / 1.2 for name in ("b1", "b2", "b3", "d", "e")}
    changed = c._replace(a=-(T1 + T2) / (T1 * T2), h=1.1 * c.h, **scaled)
    return replace(vessel, coefficients=changed)


def error(result: Analysis, truth: TrialLog, name: str, state: int) -> float:
    """Compute the rms error of an estimated state after the transient, in SI."""
    true_secs = (truth[name].measured_ns - result.signals.start_ns) * 1e-9
    at = result.signals.time_secs
    kept = (at >= TRANSIENT_SECS) & (at <= true_secs[-1])
    true = CubicSpline(true_secs, truth[name].values)(at)
    return rms((result.estimates.states[:, state] - true)[kept])


def stated(errors: Sequence[SlowState], name: str) -> str:
    """Return a sensor error with its 95 % interval; a dash where there is none."""
    for each in errors:
        if each.name == name and each.determined:
            factor = degrees(1) if each.unit == "rad/s" else 1.0
            value, half = each.value * factor, 1.96 * each.std * factor
            return f"{number(value, 3)} ± {number(half, 2)}"
    return "–"


def rms(values: FloatArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))

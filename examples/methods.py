"""Comparison of all filters and disturbance models on the same logs, with advice which to use.

Prints docs/methods.md and draws its picture. The model tests of the KVLCC2 are read from
../shared/data/kvlcc2; where that folder is missing, their section is omitted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import degrees, nan, radians, sqrt
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from papers.markdown_page import BLUE, RED, number, paragraph, picture, start_page, table
from scipy.signal import tf2ss
from scipy.stats import chi2
from sensor_states import sensor_states
from wind_states import wind_states

from analysis.design.discrete import discretise
from analysis.design.shaping import wave_filter
from analysis.filters.base import STATES
from analysis.filters.noise_model import Wave
from analysis.replay.plan import Plan, plan_replay
from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import Replay
from analysis.replay.replay_results import Findings, ReplayChunk
from analysis.signals.concat import concatenate
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.trajectory import Gust, RandomForcing, WaveMoment
from shiplog import Channel, TrialLog, Vessel, load_vessel, read
from shiplog.layouts.layout import load_layout
from shiplog.ships.paper import rudder_effect
from shiplog.tables.foreign import read_table
from shiplog.types import FloatArray
from shiplog.vessel.settings import FilterSettings
from shiplog.vessel.vessel import with_settings

PROJECT = Path(__file__).resolve().parents[1]
KVLCC2 = PROJECT.parent / "shared" / "data" / "kvlcc2"
SAMPLES = ("zigzag_20_20", "turning_circle_35", "pseudo_random", "zigzag_10_10_dropouts")
VESSEL, VESSEL_TOML = load_vessel("table1")
VESSEL_WITHOUT_NOISE = replace(VESSEL, filter=FilterSettings())  # its noise is not stated
SEEDS = range(12)
TRANSIENT_SECS = 60.0  # at the start of a log; errors are evaluated after it

Settings = Mapping[str, Any]
FILTERS: dict[str, Settings] = {
    "pseudo-input": {},
    "steady-state": {"filter.kind": "steady-state"},
    "quality": {"filter.kind": "quality"},
    "per-tick": {"filter.kind": "per-tick"},
    "extended": {"filter.kind": "extended"},
    "pseudo-input, smoothed": {"filter.smooth": True},
    "extended, smoothed": {"filter.kind": "extended", "filter.smooth": True},
}
SENSOR_ERRORS: Settings = {"filter.sensor_bias": ("auto",)}
WITH_SENSOR_ERRORS: dict[str, Settings] = {
    f"{label}, sensor errors": {**FILTERS[label], **SENSOR_ERRORS}
    for label in ("extended", "extended, smoothed")
}
TRUE_STATES = ("yaw_rate", "yaw_acceleration", "speed")  # the states whose truth is known
RANDOM_FORCING = RandomForcing(rudder=radians(1.0), force=2e-3)
WAVE = Wave(frequency=0.6, damping=0.1, std=radians(0.02), evidence=nan)
DISTURBANCE_MODELS = (["constant"], ["ramp"], ["constant", "wave"], ["ramp", "wave"])
STEP = (Gust(radians(2), 150.0),)
RAMP = tuple(Gust(radians(0.01), float(at)) for at in range(150, 600, 2))
WAVE_MOMENT = WaveMoment(radians(60), 10.0)

INTRODUCTION = """\
This page is made by

    python examples/methods.py > docs/methods.md

It compares every filter of `shiplog replay --filter` and every model of `--disturbance` on the same
logs: simulated ones, where the true states are known, and the model tests of the KVLCC2, where they
are not. All errors are rms values from 60 s on."""
ADVICE = (
    ("the most accurate states of a real ship, after the trial", "`--filter extended --smooth`"),
    (
        "states by the method of the identification paper",
        "the default, `pseudo-input`: nearly as accurate, but its σ are too small",
    ),
    ("the estimates of a fixed-gain filter, as used on board", "`--filter steady-state`"),
    (
        "the same, with the initial error decayed after a given time",
        "`--filter quality --set filter.shift=...`: faster, but noisier",
    ),
    (
        "the same poles of yaw, and of surge, in every state of the ship",
        "`--filter per-tick`: for a ship nearly the same as `steady-state`",
    ),
    (
        "the yaw rate of the ship without that of the waves",
        "`--wave`, with any filter but `pseudo-input`",
    ),
    (
        "no influence of a biased gyro or speed log",
        "`--sensor-bias auto`, with any filter: needs a heading; for the speed log positions",
    ),
    ("a disturbance, or an error of the model", "`--disturbance constant`, the default"),
    (
        "a disturbance without delay, after the trial",
        "`--smooth`: the disturbance is a state, with its σ",
    ),
    (
        "a disturbance that grows linearly",
        "`--disturbance ramp`: twice as noisy, and it overshoots after a step",
    ),
    ("a wave moment in addition", "`--disturbance constant,wave`"),
    (
        "moment and force of the wind by name",
        "`--smooth --disturbance constant,wind`: needs the wind on board, and a turn in it",
    ),
)
CAUTION = """\
The noise settings matter more than the choice of the filter. A small `process_ratio` in the vessel
file states that the model is accurate. Where the model is inaccurate, omit the setting: the process
noise is then estimated from the log. Innovations larger than expected and many
rejected samples show that the process noise is set too small."""


def main() -> None:
    """Print the page and draw its picture."""
    start_page("Which filter and which disturbance model to use", image_folder="methods")
    paragraph(INTRODUCTION)
    table("In short", ("required", "use"), ADVICE)
    paragraph(CAUTION)
    sample_data()
    random_forcing()
    wrong_model()
    waves()
    disturbances()
    sensor_states()
    wind_states()
    if KVLCC2.is_dir():
        kvlcc2_tests()


# ---- replays


class Replays:
    """Replays of one log that share their plans.

    A plan takes passes over the log and a search for the process noise. These do not depend on the
    disturbance models unless one of them is a wave, or the states are smoothed: the disturbances
    are then states of the filter.

    Parameters
    ----------
    log
        The log.
    vessel
        The vessel; None takes the log's own, or else fits a first model to the log.
    """

    def __init__(self, log: TrialLog, vessel: Vessel | None = None) -> None:
        self.log, self._vessel = log, vessel
        self._plans: dict[object, Plan] = {}

    def plan(self, settings: Settings) -> Plan:
        """Return the plan of a replay with the given settings."""
        models = settings.get("disturbance.models", ["constant"])
        settings = {**settings, "disturbance.models": models}
        shared = {name: value for name, value in settings.items() if name != "disturbance.models"}
        smooth = bool(settings.get("filter.smooth"))
        key = frozenset(shared.items()), tuple(models) if smooth else "wave" in models
        if key not in self._plans:
            shared["disturbance.models"] = models
            self._plans[key] = plan_replay(self.log, ReadingOptions(self._vessel), settings=shared)
        plan = self._plans[key]
        vessel = with_settings(plan.vessel, settings)
        frequency = plan.disturbance_settings.wave_frequency
        disturbance = replace(vessel.disturbance, wave_frequency=frequency)
        return replace(plan, vessel=vessel, disturbance_settings=disturbance)

    def series(self, settings: Settings) -> ReplayChunk:
        """Return the time series of a replay.

        The replay is stopped after its last chunk, before the tests of its findings.
        """
        plan = self.plan(settings)
        chunks: list[ReplayChunk] = []
        remaining = plan.clock.count
        for chunk in Replay(self.log, plan).chunks():
            chunks.append(chunk)
            remaining -= len(chunk.signals)
            if remaining == 0:
                break
        return concatenate(chunks)

    def series_and_findings(self, settings: Settings) -> tuple[ReplayChunk, Findings]:
        """Return the time series of a replay and its findings."""
        replay = Replay(self.log, self.plan(settings))
        return concatenate(list(replay.chunks())), replay.findings


def log_of(trial: SimulatedTrial) -> TrialLog:
    """Return a simulated trial as the log that would be read from its file."""
    return TrialLog("trial.mcap", trial.channels, trial.metadata, VESSEL_TOML)


def state_at(series: ReplayChunk, at_secs: FloatArray, name: str) -> FloatArray:
    """Return an estimated state at instants (k,), in seconds from the start of the signals."""
    states = series.estimates.states[:, STATES.index(name)]
    return np.interp(at_secs, series.signals.time_secs, states)


def rms(values: FloatArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def percent(value: float, reference: float) -> str:
    """Format a value in percent of a reference."""
    return f"{100 * value / reference:.3g} %"


# ---- the sample data


def sample_data() -> None:
    """Print the errors of each filter on the sample data, with the noise of the vessel file."""
    paragraph("## The sample data: true model, noise as in the paper")
    paragraph(
        "The rms error of the estimates, in percent of the rms error of the sensor. The yaw"
        " acceleration has no sensor: its error is in percent of its rms value. All filters use the"
        " Q/R of the paper, which is that of the vessel file."
    )
    for name, sensor in (("yaw_rate", True), ("yaw_acceleration", False), ("speed", True)):
        rows = []
        for label in FILTERS:
            errors = [sample_error(log, label, name) for log in SAMPLES]
            rows.append((label, *(percent(error, reference) for error, reference in errors)))
        reference_name = "the sensor's error" if sensor else "its rms value"
        paragraph(f"**{name.replace('_', ' ')}**, in percent of {reference_name}:")
        table("", ("filter", *(log.replace("_", " ") for log in SAMPLES)), rows)
    paragraph(
        "After the transient the steady-state gain is the best: to the filter a ship is nearly"
        " linear. The quality filter forgets its initial error faster than is optimal for this"
        " noise, and is less accurate for it. The gyro of the last log has a bias of 0.02 °/s, five"
        " times its noise; no filter of yaw rate and speed alone can detect it (with a heading see"
        " below). The more a filter"
        " relies on the model, the more it attributes the bias to the gyro, and the larger is its"
        " error in speed. The noise of the paper contains a sine with a period of 63 s. Filters"
        " take it for motion as far as their bandwidth allows, and so does the smoother: where the"
        " noise is not as the filter assumes, smoothing does not always reduce the error. The"
        " smoothers have a disturbance among their states only where Akaike's criterion of the"
        " innovations is lower with it: in the last log, where it stands for the bias of the gyro,"
        " and a surge force in the turning circle and beside the pseudo-input filter."
    )


@cache
def sample_error(log: str, label: str, name: str) -> tuple[float, float]:
    """Compute the rms error of a state of a sample log, and the rms error of its sensor.

    For a state without a sensor the second value is the rms of the state.
    """
    series, truth = sample_series(log, label), sample_truth(log)
    at = (truth[name].measured_ns - series.signals.start_ns) * 1e-9
    kept = (at >= TRANSIENT_SECS) & (at <= series.signals.time_secs[-1])
    true = truth[name].values[kept]
    error = rms(state_at(series, at[kept], name) - true)
    if name not in series.signals:
        return error, rms(true)
    times, measured = series.signals.time_secs, series.signals[name]
    valid = np.isfinite(measured) & (times >= TRANSIENT_SECS)
    return error, rms(measured[valid] - np.interp(times[valid], at, truth[name].values))


@cache
def sample_series(log: str, label: str) -> ReplayChunk:
    """Replay a sample log with one of `FILTERS`."""
    return sample_replays(log).series(FILTERS[label])


@cache
def sample_replays(log: str) -> Replays:
    """Read a sample log, to be replayed with its own vessel."""
    return Replays(read(PROJECT / "sample_data" / f"{log}.mcap"))


@cache
def sample_truth(log: str) -> TrialLog:
    """Read the true motion of a sample log."""
    return read(PROJECT / "sample_data" / f"{log}.truth.mcap")


# ---- a ship with random forcing


def random_forcing() -> None:
    """Print errors and consistency where all noise is as the filters assume."""
    yaw, surge = bandwidths()
    paragraph("## Random forcing: are the standard deviations right?")
    paragraph(
        f"{len(SEEDS)} zig-zags 20/20 with white sensor noise and random forcing of the ship, as by"
        " gusts and sea (`--random-forcing 1,2`: a white yaw moment whose mean over a second is"
        " equivalent to 1° of rudder, and a white surge force of 2 mm/s²). The filters are set to"
        f" this forcing: `filter.yaw_bandwidth` = {number(yaw, 3)}, `filter.surge_bandwidth` ="
        f" {number(surge, 3)} rad/s. The pseudo-input filter has no such settings; its noise ratio"
        " is estimated from the log. Errors are relative to those of the extended filter. NEES is"
        " the mean of the squared error over the variance that the filter returns; it is 1 for a"
        " consistent filter. The last column is the share of instants at which the NEES of all runs"
        " is within its 99 % band."
    )
    trials = random_trials()
    runs = [(trial, Replays(log_of(trial), VESSEL_WITHOUT_NOISE)) for trial in trials]
    results = {
        label: consistency(runs, {**settings, **bandwidth_settings()})
        for label, settings in FILTERS.items()
    }
    reference = results["extended"].errors
    rows = [
        (
            label,
            *(number(e / r, 3) for e, r in zip(result.errors, reference, strict=True)),
            *(number(nees, 3) for nees in result.nees),
            f"{100 * result.share_in_band:.0f} %",
        )
        for label, result in results.items()
    ]
    states = ("yaw rate", "yaw acceleration", "speed")
    errors, nees = (f"error of {s}" for s in states), (f"NEES of {s}" for s in states)
    table("", ("filter", *errors, *nees, "in band"), rows)
    paragraph(
        "The covariance of the pseudo-input filter is that of the paper: it is propagated by A"
        " alone, and its process noise acts on all states rather than as a force on the ship."
        " Therefore its σ are too small, and those of its smoother even more so."
    )
    draw_errors(trials[0])


def random_trials() -> list[SimulatedTrial]:
    """Simulate the zig-zags with random forcing, one per seed."""
    return [
        simulate(
            VESSEL,
            "zigzag-20-20",
            duration_secs=300.0,
            seed=seed,
            sensors=suite("white"),
            random_forcing=RANDOM_FORCING,
        )
        for seed in SEEDS
    ]


@dataclass(frozen=True)
class Consistency:
    """Accuracy of a filter over several runs, and of the variances it returns.

    Attributes
    ----------
    errors
        The rms error of each of `TRUE_STATES` over all runs.
    nees
        The normalised estimation error squared of each, which is 1 for a consistent filter.
    share_in_band
        The share of instants at which the NEES, averaged over the runs, is in its 99 % band.
    """

    errors: list[float]
    nees: list[float]
    share_in_band: float


def consistency(runs: Sequence[tuple[SimulatedTrial, Replays]], settings: Settings) -> Consistency:
    """Compute the accuracy and the consistency of a filter over all runs."""
    states = [STATES.index(name) for name in TRUE_STATES]
    errors, squares = [], []
    for trial, replays in runs:
        series = replays.series(settings)
        at = series.signals.time_secs
        truth = trial.trajectory.at(at)
        error = series.estimates.states[:, states] - np.column_stack(
            [truth[name] for name in TRUE_STATES]
        )
        kept = at >= TRANSIENT_SECS
        errors.append(error[kept])
        squares.append((error[kept] / series.estimates.stds[kept][:, states]) ** 2)
    nees = np.mean(squares, axis=0)
    low, high = chi2.ppf((0.005, 0.995), len(runs)) / len(runs)
    return Consistency(
        [rms(error) for error in np.concatenate(errors).T],
        list(np.mean(nees, axis=0)),
        float(np.mean((nees >= low) & (nees <= high))),
    )


@cache
def bandwidths() -> tuple[float, float]:
    """Compute the filter settings of the random forcing: (q / R)^(1/4) and (q / R)^(1/2)."""
    c, rpm = VESSEL.coefficients, VESSEL.approach_rpm
    moment_per_rudder = c.d * rudder_effect(c, sqrt(c.h * rpm / -c.g), rpm)
    trial = simulate(VESSEL, "zigzag-20-20", duration_secs=300.0, sensors=suite("white"))
    plan = plan_replay(log_of(trial))
    R = plan.noise.measurement_std**2 * plan.stats.interval_secs
    q = np.array([(moment_per_rudder * RANDOM_FORCING.rudder) ** 2, RANDOM_FORCING.force**2])
    yaw, surge = q / R
    return float(yaw**0.25), float(surge**0.5)


def bandwidth_settings() -> Settings:
    """Return the settings that state the random forcing to a filter."""
    yaw, surge = bandwidths()
    return {"filter.yaw_bandwidth": yaw, "filter.surge_bandwidth": surge}


def draw_errors(trial: SimulatedTrial) -> None:
    """Draw the errors of a run, filtered and smoothed, with the ±2σ that the filter returns."""
    figure, plots = plt.subplots(2, 1, figsize=(7.2, 4.8), sharex=True)
    replays = Replays(log_of(trial))
    for label, colour in (("extended", BLUE), ("extended, smoothed", RED)):
        series = replays.series({**FILTERS[label], **bandwidth_settings()})
        at = series.signals.time_secs
        truth = trial.trajectory.at(at)
        for axes, name in zip(plots, ("yaw_rate", "yaw_acceleration"), strict=True):
            state, unit_size = STATES.index(name), radians(1) * 1e-3
            error = (series.estimates.states[:, state] - truth[name]) / unit_size
            two_sigma = 2 * series.estimates.stds[:, state] / unit_size
            axes.plot(at, error, color=colour, lw=1.2, label=label)
            axes.fill_between(at, -two_sigma, two_sigma, color=colour, alpha=0.13, lw=0)
    for axes, name, unit, limit in (
        (plots[0], "yaw rate", "0.001 °/s", 2.5),
        (plots[1], "yaw acceleration", "0.001 °/s²", 0.4),
    ):
        axes.set(ylabel=f"error of {name}\n({unit})", xlim=(60, 240), ylim=(-limit, limit))
    plots[1].set_xlabel("t (s)")
    figure.align_ylabels()
    figure.legend(*plots[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    picture(
        "methods_errors",
        figure,
        "Errors of one of the runs, with the ±2σ that filter and smoother return. The noise of the"
        " gyro has a σ of 5 in the unit of the upper diagram.",
    )
    plt.close(figure)


# ---- a wrong model


def wrong_model() -> None:
    """Print the errors with a wrong model, the process noise being estimated from the log."""
    paragraph("## A wrong model")
    paragraph(
        "The 20/20 zig-zag of the sample data, replayed with a model whose a and d are 20 % too"
        " small and whose h is 10 % too large. No noise is stated: the process noise is the one of"
        " the highest likelihood of the innovations. Errors in percent of the sensor's error, that"
        " of the yaw acceleration in percent of its rms value:"
    )
    c = VESSEL.coefficients
    vessel = replace(
        VESSEL_WITHOUT_NOISE, coefficients=c._replace(a=0.8 * c.a, d=0.8 * c.d, h=1.1 * c.h)
    )
    replays, truth = Replays(sample_replays(SAMPLES[0]).log, vessel), sample_truth(SAMPLES[0])
    rows = []
    for label, settings in FILTERS.items():
        series = replays.series(settings)
        at = (truth["speed"].measured_ns - series.signals.start_ns) * 1e-9
        kept = at >= TRANSIENT_SECS
        cells = []
        for name in TRUE_STATES:
            error = rms(state_at(series, at[kept], name) - truth[name].values[kept])
            cells.append(percent(error, sample_error(SAMPLES[0], "pseudo-input", name)[1]))
        rows.append((label, *cells))
    table("", ("filter", "yaw rate", "yaw acceleration", "speed"), rows)


# ---- waves


def waves() -> None:
    """Print the errors of the yaw rate with waves on the gyro, without and with `--wave`."""
    trial = simulate(
        VESSEL,
        "zigzag-20-20",
        duration_secs=600.0,
        seed=5,
        sensors=suite("white"),
        random_forcing=RANDOM_FORCING,
    )
    replays = Replays(with_waves(log_of(trial)))
    paragraph("## Waves in the yaw rate")
    rows = []
    for label in ("extended", "steady-state", "quality", "per-tick", "extended, smoothed"):
        cells = []
        for wave in (False, True):
            settings = {**bandwidth_settings(), **FILTERS[label], "filter.wave": wave}
            error = yaw_rate_error(replays.series(settings), trial)
            cells.append(number(degrees(error) * 1e3, 3))
        rows.append((label, *cells))
    fit = replays.plan({**bandwidth_settings(), "filter.wave": True}).noise.wave
    if fit is None:
        raise RuntimeError("no wave found in the yaw rate of the simulated log")
    paragraph(
        "A zig-zag as above, ten minutes long, with a narrow-band wave of 0.02 °/s rms at 0.6 rad/s"
        " with a damping of 0.1 added to the gyro. `--wave` fits a wave to the residual of a slow"
        f" filter: {number(degrees(fit.std), 3)} °/s at {number(fit.frequency, 3)} rad/s with"
        f" a damping of {number(fit.damping, 2)}. It then separates the wave from the motion of"
        " the ship. The error of the ship's own yaw rate, in 0.001 °/s:"
    )
    table("", ("filter", "without --wave", "with --wave"), rows)


def with_waves(log: TrialLog) -> TrialLog:
    """Return a log with `WAVE` added to its yaw rate."""
    gyro = log["yaw_rate"]
    disturbed = replace(gyro, values=gyro.values + simulate_wave(len(gyro), 0.1))
    return replace(log, channels=(disturbed, *(c for c in log.channels if c is not gyro)))


def simulate_wave(count: int, dt_secs: float) -> FloatArray:
    """Simulate `WAVE` (count,), rad/s: white noise, held between samples, in a shaping filter."""
    shaping = wave_filter(WAVE.std**2, WAVE.frequency, WAVE.damping)
    A, B, C, _ = tf2ss(shaping.numerator, shaping.denominator)
    F, Q = discretise(A, B @ B.T, dt_secs)
    root = np.linalg.cholesky(Q)
    x, rng, values = np.zeros(2), np.random.default_rng(7), np.empty(count)
    for k in range(count):
        values[k] = C[0] @ x
        x = F @ x + root @ rng.standard_normal(2)
    return values


def yaw_rate_error(series: ReplayChunk, trial: SimulatedTrial) -> float:
    """Compute the rms error of the ship's yaw rate, rad/s."""
    at = series.signals.time_secs
    error = series.estimates.states[:, 0] - trial.trajectory.at(at)["yaw_rate"]
    return rms(error[at >= TRANSIENT_SECS])


# ---- disturbances


def disturbances() -> None:
    """Print the error of each disturbance model in three cases."""
    paragraph("## Disturbances")
    paragraph(
        "A 20/20 zig-zag of ten minutes with the noise of the paper, and a yaw moment from 150 s"
        " on: a step equivalent to 2° of rudder, a ramp to 2.25°, and the step with a wave moment"
        " of 0.63 rad/s, thirty times as large, which moves the ship by 0.1 °/s. The rms error of"
        " the estimated moment from 300 s on is in percent of 2° of rudder, that of the estimated"
        " wave moment in percent of its own rms value:"
    )
    cases = {"step": (STEP, None), "ramp": (RAMP, None), "step and wave": (STEP, WAVE_MOMENT)}
    trials = {
        name: simulate(VESSEL, "zigzag-20-20", duration_secs=600.0, seed=6, gusts=gusts, wave=wave)
        for name, (gusts, wave) in cases.items()
    }
    replays = {name: Replays(log_of(trial)) for name, trial in trials.items()}
    step = trials["step"].trajectory
    step_size = float(step.at(np.array([599.0]))["yaw_disturbance"][0])
    rows = []
    for models in DISTURBANCE_MODELS:
        cells = []
        for name, trial in trials.items():
            series = replays[name].series({"disturbance.models": models})
            at = series.signals.time_secs
            kept = at >= 300
            has_wave = name == "step and wave"
            slow = (step if has_wave else trial.trajectory).at(at)["yaw_disturbance"]
            cells.append(percent(rms((series.disturbance.yaw - slow)[kept]), step_size))
            if has_wave:
                wave, estimate = (
                    trial.trajectory.at(at)["yaw_disturbance"] - slow,
                    series.disturbance.yaw_wave,
                )
                cells.append(
                    "–"
                    if estimate is None
                    else percent(rms((estimate - wave)[kept]), rms(wave[kept]))
                )
        rows.append((", ".join(models), *cells))
    table("", ("models", *cases, "wave moment"), rows)


# ---- model tests of the KVLCC2


def kvlcc2_tests() -> None:
    """Print the results of all filters and disturbance models for the KVLCC2."""
    runs = [Replays(read_kvlcc2(path)) for path in sorted(KVLCC2.glob("*/*.dat"))]
    paragraph("## The KVLCC2, nine runs")
    kvlcc2_filters(runs)
    kvlcc2_disturbances(runs)


def read_kvlcc2(path: Path) -> TrialLog:
    """Read a run of the model tests."""
    layout = PROJECT / "sample_data" / "layouts" / f"simman_{path.parent.name}.toml"
    return read_table(path, load_layout(layout))


def kvlcc2_filters(runs: Sequence[Replays]) -> None:
    """Print how well each filter predicts samples that were withheld from it."""
    paragraph(
        "The true states are not known. In each run yaw rate and speed are withheld for ten seconds"
        " of every minute. The model is a first model, fitted to the whole run. The table shows the"
        " rms deviation of the estimates from the withheld samples, in percent of the standard"
        " deviation of the channel; the normalised innovation squared (NIS), which is 1 for a"
        " consistent filter; and the share of rejected samples. All values are medians over the"
        " runs. With sensor errors (`--sensor-bias auto`) the heading, which is not withheld, is a"
        " measurement too, and the prediction of a sample is the estimate with the bias found."
    )
    tests = [GapTest(run.log, run.plan({}).vessel) for run in runs]
    rows, of_yaw_rate = [], {}
    for label, settings in {**FILTERS, **WITH_SENSOR_ERRORS}.items():
        results = [test.results(settings) for test in tests]
        medians = np.median([result.numbers for result in results], axis=0)
        of_yaw_rate[label] = float(medians[0])
        errors = (f"{100 * error:.3g} %" for error in medians[:2])
        nis = (number(value, 3) for value in medians[2:4])
        rows.append((label, *errors, *nis, f"{100 * medians[4]:.2g} %"))
    header = ("filter", "yaw rate", "speed", "NIS of yaw rate", "NIS of speed", "rejected")
    table("", header, rows)
    smoothed = ", smoothed"
    advantages = [
        of_yaw_rate[label.removesuffix(smoothed)] / error
        for label, error in of_yaw_rate.items()
        if label.endswith(smoothed)
    ]
    paragraph(
        f"Across a gap of ten seconds the smoothers are {number(min(advantages), 2)} to"
        f" {number(max(advantages), 2)} times as accurate in yaw rate as their filters. The filters"
        " hardly differ: these models are so inaccurate that the process noise estimated from the"
        " log makes every filter follow the measurements."
    )
    biases = {run.log.name: result.gyro_bias for run, result in zip(runs, results, strict=True)}
    free, carriage = (
        [degrees(bias) for name, bias in biases.items() if ("MARIN" in name) is is_free]
        for is_free in (True, False)
    )
    paragraph(
        f"The gyro bias found by the smoother is {number(min(free), 2)} to {number(max(free), 2)}"
        f" °/s in the free-running tests, and {number(min(carriage), 2)} to"
        f" {number(max(carriage), 2)} °/s on the carriage. The heading departs from the integral"
        " of the yaw rate by slow errors of some hundredths of a degree, which are a state of the"
        " filter: where the yaw rate has almost no noise, as on the carriage, the heading adds"
        " little to it; in the free-running tests it improves the prediction."
    )


@dataclass(frozen=True)
class GapResult:
    """What a filter makes of a run with gaps.

    Attributes
    ----------
    numbers
        The rms errors of yaw rate and speed over the standard deviations of the channels; the NIS
        of both; the share of their samples that are rejected.
    gyro_bias
        The bias of the gyro at the end, rad/s; 0 where it is not estimated.
    """

    numbers: tuple[float, ...]
    gyro_bias: float


class GapTest:
    """A run of which yaw rate and speed are withheld for ten seconds of every minute.

    Parameters
    ----------
    log
        The log of the run.
    vessel
        The vessel with the model of the filters.
    """

    def __init__(self, log: TrialLog, vessel: Vessel) -> None:
        self._start_ns, _ = log.span_ns
        self._withheld = [log[name] for name in ("yaw_rate", "speed")]
        channels = [
            replace(channel, values=np.where(self._in_gap(channel), np.nan, channel.values))
            if channel.name in ("yaw_rate", "speed")
            else channel
            for channel in log
        ]
        self._replays = Replays(replace(log, channels=tuple(channels)), vessel)

    def results(self, settings: Settings) -> GapResult:
        """Replay the run, and compare the samples withheld with their predictions.

        A prediction is the estimated state with the estimated bias of its sensor.
        """
        series, findings = self._replays.series_and_findings(settings)
        further, times = series.estimates.further, series.signals.time_secs
        errors = []
        for channel, sensor in zip(self._withheld, ("gyro", "log"), strict=True):
            at = (channel.measured_ns - series.signals.start_ns) * 1e-9
            kept = self._in_gap(channel) & np.isfinite(channel.values) & (at >= 0)
            kept &= at <= times[-1]
            predicted = state_at(series, at[kept], channel.name)
            bias = further.of(sensor) if further else None
            if bias is not None:
                predicted = predicted + np.interp(at[kept], times, bias[0])
            error = predicted - channel.values[kept]
            errors.append(rms(error) / float(np.nanstd(channel.values)))
        residuals = findings.residuals[:2]
        rejected = sum(residual.rejected for residual in residuals)
        count = sum(residual.count for residual in residuals)
        nis = (residual.mean_nis for residual in residuals)
        gyro = [error.value for error in findings.sensor_errors if error.name == "gyro"]
        return GapResult((*errors, *nis, rejected / count), gyro[0] if gyro else 0.0)

    def _in_gap(self, channel: Channel) -> np.ndarray:
        """Return for each sample whether it is withheld."""
        return ((channel.measured_ns - self._start_ns) * 1e-9) % 60 >= 50


def kvlcc2_disturbances(runs: Sequence[Replays]) -> None:
    """Print the disturbances that each model finds beside the first model of a run."""
    rows = []
    for models in DISTURBANCE_MODELS:
        settings = {"disturbance.models": models}
        summaries = [run.series_and_findings(settings)[1].disturbances for run in runs]
        yaw = np.median([degrees(summary["rudder"].rms) for summary in summaries])
        yaw_std = np.median([degrees(summary["rudder"].noise_std) for summary in summaries])
        surge = np.median([summary["surge"].rms for summary in summaries]) * 1e3
        cells = [number(float(value), 3) for value in (yaw, yaw_std, surge)]
        rows.append((", ".join(models), *cells))
    paragraph("The disturbances estimated beside the model, medians over the runs:")
    header = (
        "models",
        "rms in yaw, as rudder (°)",
        "std by noise in yaw, as rudder (°)",
        "rms in surge (mm/s²)",
    )
    table("", header, rows)


if __name__ == "__main__":
    main()

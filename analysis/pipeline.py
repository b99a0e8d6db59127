"""From a log to what it says: the order of the steps."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from shiplog import LogError, Signals, TrialLog, Vessel, resample
from shiplog.clock import usual_period_secs
from shiplog.quality import examine
from shiplog.vessel import FilterSettings, parse_vessel

from .disturbance import Disturbance, observe_disturbance
from .doubts import doubtful, possible, silent_ends
from .first_model import fit_first_model
from .kalman import OUTPUT_STATES, OUTPUTS, Estimates, Noise, filter_states, noise_of
from .residuals import OutputResiduals, judge
from .sliding import Identification, identify
from .track import Track, find_track
from .weak_form import weak_form

INPUTS = ("rudder", "rpm")
FITTED = "a first model, fitted to this log"
FEWEST = 4  # samples of an output: their third difference shows its noise
NEEDED = (*OUTPUTS, *INPUTS)
STEPS = ("check", "one clock", "model", "filter", "disturbance", "coefficients")


@dataclass(frozen=True, eq=False)
class Analysis:
    """All that a replay found, on the signals' clock."""

    log: TrialLog
    vessel: Vessel
    model_origin: str  # where the model came from, in words
    signals: Signals  # as measured, NaN where not
    noise: Noise
    estimates: Estimates
    residuals: tuple[OutputResiduals, ...]  # of yaw rate and speed
    disturbance: Disturbance
    yaw: Identification
    surge: Identification
    track: Track
    warnings: tuple[str, ...]


def analyse(
    log: TrialLog, vessel: Vessel | None = None, *, on_step: Callable[[str], None] = lambda _: None
) -> Analysis:
    """Replay a log: check it, filter it, observe what disturbed it, identify the ship.

    The model is `vessel`'s, or the one the log carries, or else a first one fitted to the log.
    `on_step` is told each of `STEPS` as it begins. Raises `LogError` where the log lacks a needed
    channel or cannot be used as it is.
    """
    on_step("check")
    also = tuple(name for name in ("heading", "position") if name in log)
    warnings = [*log.warnings, *examine(log, (*NEEDED, *also))]

    on_step("one clock")
    credible = possible(log)
    signals = resample(credible, channels=NEEDED, optional=("heading",))
    _require_outputs(log, signals)
    known, unknown = _hold_inputs(credible, signals)
    warnings += doubtful(credible, NEEDED)
    warnings += [*silent_ends(credible, signals, NEEDED), *unknown]

    on_step("model")
    vessel, origin = _model(log, vessel, signals)
    model = vessel.coefficients
    if origin == FITTED and not (model.a < 0 and model.g <= 0 and model.h >= 0):
        warnings.append("the model fitted to this log is no ship's: too little moves in it to tell")

    on_step("filter")
    noise = noise_of(known, model, _averaged(vessel.filter, log, signals.dt_secs))
    estimates = filter_states(known, model, noise)
    if not np.all(np.isfinite(estimates.states)):
        raise LogError(
            f"the filter runs away: the model does not fit this log ({origin}); "
            f"give the ship's own with --vessel: {log.name}"
        )
    residuals = tuple(_judged(log, estimates, noise, i) for i in range(len(OUTPUTS)))

    on_step("disturbance")
    disturbance = observe_disturbance(known, model, noise)

    on_step("coefficients")
    yaw_rows, surge_rows = weak_form(signals, model)
    yaw, surge = identify(yaw_rows, constant=True), identify(surge_rows)
    track = find_track(log, signals, *(estimates.states[:, i] for i in OUTPUT_STATES))
    return Analysis(
        log, vessel, origin, signals, noise, estimates, residuals, disturbance, yaw, surge, track,
        tuple(warnings),
    )  # fmt: skip


def _model(log: TrialLog, given: Vessel | None, signals: Signals) -> tuple[Vessel, str]:
    if given is not None:
        return given, "given"
    if log.vessel_toml is not None:
        return parse_vessel(log.vessel_toml, f"vessel.toml in {log.name}"), "carried by the log"
    return fit_first_model(signals, log.name), FITTED


def _require_outputs(log: TrialLog, signals: Signals) -> None:
    for name in OUTPUTS:
        count = int(np.isfinite(signals[name]).sum())
        if count < FEWEST:
            raise LogError(
                f"channel {name!r} has {count} samples while the others are there too, "
                f"and {FEWEST} are needed; check the recorder or choose another log: {log.name}"
            )


def _averaged(settings: FilterSettings, log: TrialLog, dt_secs: float) -> FilterSettings:
    """The noise stated for one sample, as it is in the mean of those that share an instant."""
    stds = []
    for name, std in zip(OUTPUTS, (settings.yaw_rate_std, settings.speed_std), strict=True):
        together = max(1.0, dt_secs / usual_period_secs(log[name]))
        stds.append(None if std is None else std / sqrt(together))
    return replace(settings, yaw_rate_std=stds[0], speed_std=stds[1])


def _judged(log: TrialLog, estimates: Estimates, noise: Noise, output: int) -> OutputResiduals:
    name = OUTPUTS[output]
    return judge(
        name,
        log[name].unit,
        estimates.innovations[:, output],
        estimates.innovation_stds[:, output],
        noise_measured=noise.measured[output],
    )


def _hold_inputs(log: TrialLog, signals: Signals) -> tuple[Signals, list[str]]:
    """Rudder and revolutions at their last known value wherever they were not measured.

    A filter cannot predict without them; what it predicts then is said to be a guess.
    """
    values, said = dict(signals.values), []
    for name in INPUTS:
        missing = np.isnan(values[name])
        if missing.any():
            last = np.maximum.accumulate(np.where(missing, 0, np.arange(len(missing))))
            held = values[name][last]
            if np.isnan(held[0]):  # the clock begins in the midst of a gap
                held = np.where(np.isnan(held), _last_before(log, name, signals), held)
            values[name] = held
            said.append(
                f"{name}: not measured for {missing.sum() * signals.dt_secs:.1f} s in all; "
                "held at its last value there, so that the estimates there are guesses"
            )
    return replace(signals, values=values), said


def _last_before(log: TrialLog, name: str, signals: Signals) -> float:
    """What was known of an input when the clock began."""
    channel = log[name]
    earlier = np.isfinite(channel.values) & (channel.measured_ns <= signals.start_ns)
    return float(channel.values[earlier][np.argmax(channel.measured_ns[earlier])])

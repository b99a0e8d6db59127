"""From a log to what it says: the order of the steps."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from shiplog import LogError, Signals, TrialLog, Vessel, resample
from shiplog.quality import examine, rudder_sign_warning
from shiplog.vessel import parse_vessel

from .disturbance import Disturbance, observe_disturbance
from .first_model import fit_first_model
from .kalman import OUTPUTS, Estimates, Noise, filter_states, noise_of
from .residuals import OutputResiduals, judge
from .sliding import Identification, identify
from .track import Track, find_track
from .weak_form import weak_form

INPUTS = ("rudder", "rpm")
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
    warnings = [*log.warnings, *examine(log, NEEDED)]
    sign = rudder_sign_warning(log)
    warnings += [sign] if sign else []

    on_step("one clock")
    signals = resample(log, channels=(*NEEDED, *(n for n in ("heading",) if n in log)))
    known, unknown = _hold_inputs(signals)
    warnings += unknown

    on_step("model")
    vessel, origin = _model(log, vessel, signals)
    model = vessel.coefficients

    on_step("filter")
    noise = noise_of(known, model, vessel.filter)
    estimates = filter_states(known, model, noise)
    if not np.all(np.isfinite(estimates.states)):
        raise LogError(
            f"the filter runs away: the model does not fit this log ({origin}); "
            f"give the ship's own with --vessel: {log.name}"
        )
    residuals = tuple(
        judge(name, log[name].unit, estimates.innovations[:, i], estimates.innovation_stds[:, i])
        for i, name in enumerate(OUTPUTS)
    )

    on_step("disturbance")
    disturbance = observe_disturbance(known, model, noise)

    on_step("coefficients")
    yaw_rows, surge_rows = weak_form(signals, model)
    yaw, surge = identify(yaw_rows, constant=True), identify(surge_rows)
    track = find_track(log, signals, estimates.states[:, 0], estimates.states[:, 3])
    return Analysis(
        log, vessel, origin, signals, noise, estimates, residuals, disturbance, yaw, surge, track,
        tuple(warnings),
    )  # fmt: skip


def _model(log: TrialLog, given: Vessel | None, signals: Signals) -> tuple[Vessel, str]:
    if given is not None:
        return given, "given"
    if log.vessel_toml is not None:
        return parse_vessel(log.vessel_toml, f"vessel.toml in {log.name}"), "carried by the log"
    return fit_first_model(signals, log.name), "a first model, fitted to this log"


def _hold_inputs(signals: Signals) -> tuple[Signals, list[str]]:
    """Rudder and revolutions at their last known value wherever they were not measured.

    A filter cannot predict without them; what it predicts then is said to be a guess.
    """
    values, said = dict(signals.values), []
    for name in INPUTS:
        missing = np.isnan(values[name])
        if missing.any():
            last = np.maximum.accumulate(np.where(missing, 0, np.arange(len(missing))))
            values[name] = values[name][last]
            said.append(
                f"{name}: not measured for {missing.sum() * signals.dt_secs:.1f} s in all; "
                "held at its last value there, so that the estimates there are guesses"
            )
    return replace(signals, values=values), said

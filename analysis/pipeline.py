"""From a log to what it says: the order of the steps."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from shiplog import LogError, Signals, TrialLog, Vessel, resample
from shiplog.clock import gap_threshold_secs, usual_period_secs
from shiplog.gyro_bias import gyro_bias_warning
from shiplog.quality import examine
from shiplog.rudder_sign import rudder_sign_warning
from shiplog.units import CATALOGUE
from shiplog.vessel import FilterSettings, parse_vessel

from .disturbance import Disturbance, observe_disturbance
from .first_model import fit_first_model
from .kalman import OUTPUTS, Estimates, Noise, filter_states, noise_of
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
    warnings = [*log.warnings, *examine(log, NEEDED)]

    on_step("one clock")
    possible = _possible(log)
    signals = resample(possible, channels=NEEDED, optional=("heading",))
    _require_outputs(log, signals)
    known, unknown = _hold_inputs(signals)
    warnings += [*_doubtful(possible), *_silent_ends(possible, signals), *unknown]

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
    residuals = tuple(
        judge(
            name,
            log[name].unit,
            estimates.innovations[:, i],
            estimates.innovation_stds[:, i],
            noise_measured=noise.measured[i],
        )
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
    return fit_first_model(signals, log.name), FITTED


def _possible(log: TrialLog) -> TrialLog:
    """The log with what no ship does as not measured; `examine` has said where."""
    channels = []
    for channel in log:
        kind = CATALOGUE.get(channel.name)
        if kind is not None and not channel.fields:
            possible = (channel.values >= kind.lowest) & (channel.values <= kind.highest)
            channel = replace(channel, values=np.where(possible, channel.values, np.nan))  # noqa: PLW2901
        channels.append(channel)
    return replace(log, channels=tuple(channels))


def _doubtful(log: TrialLog) -> Iterator[str]:
    """What in a log may not be what it seems."""
    for name in NEEDED:
        sources = [channel.source for channel in log if channel.name == name]
        if len(sources) > 1:
            yield (
                f"{name}: {len(sources)} sources ({', '.join(sources)}), {sources[0]} is used; "
                f"choose another with --source {name}={sources[1]}"
            )
    for name in OUTPUTS:
        if np.nanmin(log[name].values) == np.nanmax(log[name].values):
            yield f"{log[name].topic}: never changes; if the sensor was dead, choose another"
    if np.nanmin(log["speed"].values) < 0 or np.nanmin(log["rpm"].values) < 0:
        yield "the ship goes astern in places, where the model does not hold"
    for warning in (rudder_sign_warning(log), gyro_bias_warning(log)):
        if warning:
            yield warning


def _require_outputs(log: TrialLog, signals: Signals) -> None:
    for name in OUTPUTS:
        count = int(np.isfinite(signals[name]).sum())
        if count < FEWEST:
            raise LogError(
                f"channel {name!r} has {count} samples while the others are there too, "
                f"and {FEWEST} are needed; check the recorder or choose another log: {log.name}"
            )


def _silent_ends(log: TrialLog, signals: Signals) -> Iterator[str]:
    """Parts of the log that are not replayed, or only predicted, for want of a channel."""
    first, last = signals.start_ns, int(signals.stamps_ns[-1])
    spans = {name: log[name].measured_ns[np.isfinite(log[name].values)] for name in NEEDED}
    begun = max(spans, key=lambda name: int(spans[name].min()))
    late = (first - min(int(times.min()) for times in spans.values())) * 1e-9
    if late > gap_threshold_secs(log[begun]):
        yield f"{begun}: sets in {late:.1f} s after the others; the replay begins there"
    ceased = min(INPUTS, key=lambda name: int(spans[name].max()))
    early = (max(int(times.max()) for times in spans.values()) - last) * 1e-9
    if early > gap_threshold_secs(log[ceased]):
        yield f"{ceased}: ends {early:.1f} s before the others; the replay ends there"
    for name in OUTPUTS:
        silent = (last - int(spans[name].max())) * 1e-9
        if silent > gap_threshold_secs(log[name]):
            yield f"{name}: silent for the last {silent:.1f} s, which are only predicted"


def _averaged(settings: FilterSettings, log: TrialLog, dt_secs: float) -> FilterSettings:
    """The noise stated for one sample, as it is in the mean of those that share an instant."""
    stds = []
    for name, std in zip(OUTPUTS, (settings.yaw_rate_std, settings.speed_std), strict=True):
        together = max(1.0, dt_secs / usual_period_secs(log[name]))
        stds.append(None if std is None else std / sqrt(together))
    return replace(settings, yaw_rate_std=stds[0], speed_std=stds[1])


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

"""Design of a replay's filter and disturbance observer, and the cause where it fails."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from analysis.disturbance.observer import ForceObserver, force_models
from analysis.filters.base import Estimates, Filter
from analysis.signals.hold import last_inputs
from shiplog import LogError, Signals
from shiplog.errors import ShiplogError, UsageError
from shiplog.ships.paper import PAPER_OUTPUTS

from .plan import Plan, changed_settings, with_default_settings

DESIGN_ERRORS = (UsageError, np.linalg.LinAlgError, ArithmeticError)


def make_estimators(plan: Plan) -> tuple[Filter, ForceObserver]:
    """Design the filter and the disturbance observer of a replay.

    Parameters
    ----------
    plan
        The plan of the replay.

    Raises
    ------
    UsageError
        A setting is invalid, or the design succeeds without it.
    LogError
        Neither exists for this model, because it diverges.
    """
    settings = plan.disturbance_settings
    # an invalid setting stays a UsageError that names it; only the model can diverge
    force_models(settings, settings.wave_frequency, plan.stats)
    try:
        return _design(plan)
    except DESIGN_ERRORS as error:
        names = _unsuitable_settings(plan, _can_be_designed, changed_settings(plan.vessel))
        if names:
            raise UsageError(
                f"{names} does not suit this log or its model: {error}: {plan.name}"
            ) from error
        raise diverged(plan, f" ({error})") from error


def _design(plan: Plan) -> tuple[Filter, ForceObserver]:
    model, noise, stats = plan.vessel.paper_coefficients, plan.noise, plan.stats
    settings = plan.disturbance_settings
    with np.errstate(all="ignore"):
        filter_ = plan.filter_kind.make(model, noise, stats, plan.vessel.filter)
        return filter_, ForceObserver(
            model,
            noise,
            stats,
            settings,
            settings.wave_frequency,
            rudder_max=plan.vessel.rudder_max,
        )


def _unsuitable_settings(
    plan: Plan, works: Callable[[Plan], bool], changed: Mapping[str, object]
) -> str:
    """Name the settings without which a plan works; "" where it does not without any.

    Parameters
    ----------
    plan
        The plan, which does not work.
    works
        Whether a plan works.
    changed
        The settings to try, with their values; the kind of filter is the last one.
    """
    one_by_one = sorted(changed, key=lambda name: name == "filter.kind")
    for names in (*((name,) for name in one_by_one), tuple(changed)):
        try:
            with np.errstate(all="ignore"):
                suitable = works(with_default_settings(plan, names))
        except (*DESIGN_ERRORS, LogError):
            continue
        if suitable:
            return ", ".join(f"{name} = {changed[name]}" for name in names)
    return ""


def _can_be_designed(plan: Plan) -> bool:
    _design(plan)
    return True


def _stays_finite(plan: Plan) -> bool:
    """Whether the filter is finite on the first part of the trial."""
    filter_, _ = _design(plan)
    estimates = filter_.step(plan.stats.head, last_inputs(plan.stats.head))
    return bool(np.isfinite(estimates.states).all())


def diverged(plan: Plan, reason: str = "") -> ShiplogError:
    """Return the error for estimators that diverge: due to a setting, or else to the model.

    Parameters
    ----------
    plan
        The plan of the replay.
    reason
        Why the design failed, if it did, such as `` (overflow)``.

    Returns
    -------
    UsageError or LogError
        The first names a setting without which the filter does not diverge; the second the model
        and the changed settings. A large process noise follows any log, so that neither it nor the
        kind of filter is tried.
    """
    changed = changed_settings(plan.vessel)
    tried = {n: v for n, v in changed.items() if n not in ("filter.kind", "filter.process_ratio")}
    names = _unsuitable_settings(plan, _stays_finite, tried) if tried else ""
    if names:
        return UsageError(
            f"{names} makes the filter diverge{reason}; remove it or choose another value: "
            f"{plan.name}"
        )
    listed = ", ".join(f"{name} = {value}" for name, value in changed.items())
    settings = f", or remove the settings {listed}" if listed else ""
    return LogError(
        f"the filter or the disturbance observer diverges{reason}: the model "
        f"({plan.model_origin}) or the settings do not fit this log; give another model with "
        f"--vessel{settings}: {plan.name}"
    )


def require_settings_of_observer(plan: Plan) -> None:
    """Require that no setting makes the disturbance observer diverge on this log.

    Where it diverges due to the model, the disturbance alone is unknown, and remains NaN.

    Parameters
    ----------
    plan
        The plan of a replay whose observer has diverged.

    Raises
    ------
    UsageError
        Names the settings of the observer without which it does not diverge.
    """
    settings = changed_settings(plan.vessel).items()
    changed = {name: value for name, value in settings if name.startswith("disturbance.")}
    if not changed or _observer_stays_finite(plan):  # later than in the part that is tried
        return
    names = _unsuitable_settings(plan, _observer_stays_finite, changed)
    if names:
        raise UsageError(
            f"{names} makes the disturbance observer diverge; remove it or choose another value: "
            f"{plan.name}"
        )


def _observer_stays_finite(plan: Plan) -> bool:
    """Whether the disturbances are finite on the first part of the trial."""
    filter_, observer = _design(plan)
    head = plan.stats.head
    following = last_inputs(head)
    estimates = filter_.step(head, following)
    return observer.step(without_rejected(head, estimates), following).is_finite


def without_rejected(held: Signals, estimates: Estimates) -> Signals:
    """Return the signals with the samples that the filter rejected set to NaN."""
    if not estimates.rejected[:, : len(PAPER_OUTPUTS)].any():
        return held
    accepted = {
        name: np.where(estimates.rejected[:, i], np.nan, held[name])
        for i, name in enumerate(PAPER_OUTPUTS)
    }
    return replace(held, values=dict(held.values) | accepted)


def without_sensor_errors(signals: Signals, estimates: Estimates) -> Signals:
    """Return the signals without the sensor errors that the filter has found by each instant."""
    if estimates.further is None:
        return signals
    zero = np.zeros(len(signals))
    gyro, log, scale, rudder = (
        found[0] if (found := estimates.further.of(name)) else zero
        for name in ("gyro", "log", "log_scale", "rudder")
    )
    corrected = {
        "yaw_rate": signals["yaw_rate"] - gyro,
        "speed": (signals["speed"] - log) / (1 + scale),
        "rudder": signals["rudder"] - rudder,
    }
    return replace(signals, values=dict(signals.values) | corrected)

"""Design of a replay's filter and disturbance observer, and the cause where it fails."""

import numpy as np

from analysis.disturbance.observer import ForceObserver, force_models
from analysis.filters.base import Filter
from shiplog import LogError
from shiplog.errors import UsageError

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
        with np.errstate(over="ignore", invalid="ignore"):
            names = _unsuitable_settings(plan)
        if names:
            raise UsageError(
                f"{names} does not suit this log or its model: {error}: {plan.name}"
            ) from error
        raise diverged(plan, f" ({error})") from error


def _design(plan: Plan) -> tuple[Filter, ForceObserver]:
    model, noise, stats = plan.vessel.paper_coefficients, plan.noise, plan.stats
    settings = plan.disturbance_settings
    with np.errstate(over="ignore", invalid="ignore"):
        filter_ = plan.filter_kind.make(model, noise, stats, plan.vessel.filter)
        return filter_, ForceObserver(
            model,
            noise,
            stats,
            settings,
            settings.wave_frequency,
            rudder_max=plan.vessel.rudder_max,
        )


def _unsuitable_settings(plan: Plan) -> str:
    """Name the settings without which the design succeeds; "" where it fails without any."""
    changed = changed_settings(plan.vessel)
    for names in (*((name,) for name in changed), tuple(changed)):
        try:
            _design(with_default_settings(plan, names))
        except (*DESIGN_ERRORS, LogError):
            continue
        return ", ".join(f"{name} = {changed[name]}" for name in names)
    return ""


def diverged(plan: Plan, reason: str = "") -> LogError:
    """Return the error for estimators that diverge; it names the model and the changed settings.

    Parameters
    ----------
    plan
        The plan of the replay.
    reason
        Why the design failed, if it did, such as `` (overflow)``.
    """
    changed = [f"{name} = {value}" for name, value in changed_settings(plan.vessel).items()]
    settings = f", or remove the settings {', '.join(changed)}" if changed else ""
    return LogError(
        f"the filter or the disturbance observer diverges{reason}: the model "
        f"({plan.model_origin}) or the settings do not fit this log; give another model with "
        f"--vessel{settings}: {plan.name}"
    )

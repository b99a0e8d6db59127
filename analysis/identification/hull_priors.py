"""Priors from the hull of the vessel file or of the log, for the models that have any."""

from collections.abc import Sequence
from dataclasses import replace

from analysis.trial.hull_conditions import hull_of_conditions, stated_conditions
from shiplog.ships import Model
from shiplog.ships.hull_form import HullForm
from shiplog.ships.mmg_priors import beyond_regressions, mmg_with_hull
from shiplog.types import Log
from shiplog.vessel.hull import Hull
from shiplog.vessel.vessel import Vessel

MMG = "mmg"  # the model whose priors follow from a hull form


def with_stated_hull(vessel: Vessel | None, logs: Sequence[Log]) -> Vessel | None:
    """Return the vessel with the hull of its file, or else that which the logs state.

    Parameters
    ----------
    vessel
        The vessel; None where neither it nor its length is known.
    logs
        The logs, whose metadata can state the conditions of the trial; the first one with a hull
        counts, since draughts differ a little from run to run.
    """
    if vessel is None or vessel.hull != Hull():
        return vessel
    stated = (hull_of_conditions(stated_conditions(log.metadata), vessel.length) for log in logs)
    return replace(vessel, hull=next((hull for hull in stated if hull != Hull()), Hull()))


def with_hull_priors(
    models: Sequence[Model], vessel: Vessel | None
) -> tuple[list[Model], tuple[str, ...]]:
    """Return the models to fit with the priors of the ship's hull, and warnings.

    Parameters
    ----------
    models
        The models; only the MMG model has priors from a hull.
    vessel
        The ship, whose length the dimensions of its hull are divided by; None where unknown.

    Returns
    -------
    models
        The models in the same order, by the same names.
    warnings
        Why a hull is not used, or not all of it.
    """
    form = HullForm() if vessel is None else vessel.hull.form(vessel.length)
    if form == HullForm() or all(model.name != MMG for model in models):
        return list(models), ()
    beyond = beyond_regressions(form)
    warning = (
        f"the hull is outside the range of the regressions of its derivatives: {beyond}; the model "
        f"{MMG} has the priors of ships in general, but for the mass"
    )
    changed = [mmg_with_hull(model, form) if model.name == MMG else model for model in models]
    return changed, (warning,) if beyond else ()

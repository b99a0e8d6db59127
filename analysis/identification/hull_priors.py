"""Priors from the hull of the vessel file, for the models that have any."""

from collections.abc import Sequence

from shiplog.ships import Model
from shiplog.ships.hull_form import HullForm
from shiplog.ships.mmg_priors import beyond_regressions, mmg_with_hull
from shiplog.vessel.vessel import Vessel

MMG = "mmg"  # the model whose priors follow from a hull form


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

"""A first model, from the log itself, for a ship of which nothing is known."""

from dataclasses import replace

import numpy as np

from shiplog.errors import LogError
from shiplog.ship import SURGE_COEFFICIENTS, Coefficients
from shiplog.types import Signals
from shiplog.vessel import Vessel

from .sliding import fit
from .weak_form import Rows, weak_form, with_constant

# The rudder works in proportion to the speed: without a model nothing is known of the
# slipstream, and d and e take the factor up.
_BARE = Coefficients(
    a=0.0, b1=0.0, b2=0.0, b3=0.0, d=0.0, e=0.0, f=0.0, g=0.0, h=0.0,
    alpha1=1.0, alpha2=0.0, alpha3=0.0,
)  # fmt: skip

YAW_FORMS = (("a", "b1", "b2", "d", "e"), ("a", "b1", "d", "e"), ("a", "d", "e"))
SURGE_FORMS = (SURGE_COEFFICIENTS, ("f", "h"))


def fit_first_model(signals: Signals, name: str) -> Vessel:
    """A vessel whose coefficients are those of the whole log, by least squares in weak form.

    b3 is left out, for on a real ship it cannot be told from b2; and b2 and b1 where the log
    cannot tell them either. A constant takes up the rudder's zero. Raises `LogError` where the
    log is too short or too quiet to tell even so much.
    """
    yaw, surge = weak_form(signals, _BARE)
    found = _richest(yaw, YAW_FORMS, constant=True) | _richest(surge, SURGE_FORMS, constant=False)
    unknown = [part for part, key in (("yaw", "a"), ("surge", "f")) if key not in found]
    if unknown:
        raise LogError(
            f"the log carries no model, and too little moves in it to fit one of "
            f"{' and '.join(unknown)}; give the ship's with --vessel: {name}"
        )
    coefficients = _BARE._replace(**found)
    rpm = float(np.nanmedian(signals["rpm"]))
    return Vessel(f"fitted to {name}", coefficients, approach_rpm=rpm)


def _richest(rows: Rows, forms: tuple[tuple[str, ...], ...], *, constant: bool) -> dict[str, float]:
    """The coefficients of the first of the forms that the rows can tell; none if they cannot."""
    for names in forms:
        chosen = _only(rows, names)
        values = fit(with_constant(chosen) if constant else chosen).values[: len(names)]
        if np.isfinite(values).all():
            return dict(zip(names, values.tolist(), strict=True))
    return {}


def _only(rows: Rows, names: tuple[str, ...]) -> Rows:
    kept = [rows.names.index(name) for name in names]
    return replace(rows, names=names, regressors=rows.regressors[:, kept])

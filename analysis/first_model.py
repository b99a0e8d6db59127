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


def fit_first_model(signals: Signals, name: str) -> Vessel:
    """A vessel whose coefficients are those of the whole log, by least squares in weak form.

    b3 is left out: on a real ship it cannot be told from b2. A constant takes up the rudder's
    zero and the gyro's bias. Raises `LogError` where the log is too short or too quiet to tell.
    """
    yaw, surge = weak_form(signals, _BARE)
    yaw_names = ("a", "b1", "b2", "d", "e")
    found = dict(zip(yaw_names, fit(with_constant(_only(yaw, yaw_names))).values, strict=False))
    found |= dict(zip(SURGE_COEFFICIENTS, fit(surge).values, strict=True))
    if not np.all(np.isfinite(list(found.values()))):
        raise LogError(
            "the log carries no model, and is too short or too quiet to fit one; "
            f"give the ship's with --vessel: {name}"
        )
    coefficients = _BARE._replace(**{key: float(value) for key, value in found.items()})
    rpm = float(np.nanmedian(signals["rpm"]))
    return Vessel(f"fitted to {name}", coefficients, approach_rpm=rpm)


def _only(rows: Rows, names: tuple[str, ...]) -> Rows:
    kept = [rows.names.index(name) for name in names]
    return replace(rows, names=names, regressors=rows.regressors[:, kept])

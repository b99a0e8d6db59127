"""The same filter in filterpy: its extended Kalman filter, `predict_x` written as it asks for."""

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from analysis.filters.noise_model import NoiseModel
from shiplog import Signals
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .textbook import C, Filtered, Input, design, inputs, kink, runge_kutta


class ShipFilter(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy has no types
    """Five states, two outputs; the mean follows the nonlinear ship, the covariance F."""

    x: FloatArray

    def __init__(self, c: Coefficients, dt: float) -> None:
        super().__init__(dim_x=5, dim_z=2)
        self.c, self.dt = c, dt

    def predict_x(self, u: Input) -> None:
        """Where the ship is a step later."""
        self.x = runge_kutta(self.c, self.x, u, self.dt)


def filter_in_filterpy(signals: Signals, c: Coefficients, noise: NoiseModel) -> Filtered:
    """Update, store, predict."""
    ship = ShipFilter(c, signals.dt_secs)
    ship.x, ship.P, ship.F, ship.Q, ship.R, measured = design(signals, c, noise)
    found = Filtered(*(np.full((len(measured), size), np.nan) for size in (5, 5, 2, 2)))
    last_rate = 0.0
    for k, u in enumerate(inputs(signals)):
        ship.x[2] += kink(c, ship.x, u, last_rate)
        last_rate = u.delta_dot
        seen = np.isfinite(measured[k])
        if seen.all():
            ship.update(measured[k], _jacobian, _output)
        elif seen.any():
            H, R = C[seen], ship.R[np.ix_(seen, seen)]
            ship.update(measured[k][seen], lambda _, H=H: H, lambda x, H=H: H @ x, R)
        if seen.any():
            found.innovations[k, seen] = ship.y
            found.innovation_stds[k, seen] = np.sqrt(np.diag(ship.S))
        found.states[k], found.stds[k] = ship.x, np.sqrt(np.diag(ship.P))
        ship.predict(u)
    return found


def _jacobian(_: FloatArray) -> FloatArray:
    return C


def _output(x: FloatArray) -> FloatArray:
    return C @ x

"""The five-state filter by filterpy's `ExtendedKalmanFilter`, with `predict_x` overridden."""

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from analysis.filters.noise_model import NoiseModel
from shiplog import Signals
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .textbook import (
    C,
    FilterResult,
    ShipInput,
    filter_setup,
    runge_kutta_four,
    ship_inputs,
    yaw_jump,
)


class FilterpyShip(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy has no types
    """Five states, two outputs; the mean follows the nonlinear model, the covariance F."""

    x: FloatArray

    def __init__(self, c: Coefficients, dt: float) -> None:
        super().__init__(dim_x=5, dim_z=2)
        self.c, self.dt = c, dt

    def predict_x(self, u: ShipInput) -> None:
        """Move the state by one step of the nonlinear model."""
        self.x = runge_kutta_four(self.c, self.x, u, self.dt)


def filter_in_filterpy(signals: Signals, c: Coefficients, noise: NoiseModel) -> FilterResult:
    """Return the estimates of filterpy, the same as those of `textbook.filter_in_numpy`."""
    ship = FilterpyShip(c, signals.dt_secs)
    ship.x, ship.P, ship.F, ship.Q, ship.R, measured = filter_setup(signals, c, noise)
    result = FilterResult(*(np.full((len(measured), size), np.nan) for size in (5, 5, 2, 2)))
    last_rate = 0.0
    for k, u in enumerate(ship_inputs(signals)):
        ship.x[2] += yaw_jump(c, ship.x, u, last_rate)
        last_rate = u.delta_dot
        measured_now = np.isfinite(measured[k])
        if measured_now.all():
            ship.update(measured[k], _jacobian, _output)
        elif measured_now.any():
            H, R = C[measured_now], ship.R[np.ix_(measured_now, measured_now)]
            ship.update(measured[k][measured_now], lambda _, H=H: H, lambda x, H=H: H @ x, R)
        if measured_now.any():
            result.innovations[k, measured_now] = ship.y
            result.innovation_stds[k, measured_now] = np.sqrt(np.diag(ship.S))
        result.states[k], result.stds[k] = ship.x, np.sqrt(np.diag(ship.P))
        ship.predict(u)
    return result


def _jacobian(_: FloatArray) -> FloatArray:
    return C


def _output(x: FloatArray) -> FloatArray:
    return C @ x

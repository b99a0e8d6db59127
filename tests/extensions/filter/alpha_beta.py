"""An alpha-beta filter of yaw rate and speed, which needs no model of the ship.

Yaw rate and speed each have two states, the value x and its rate x'; the second derivative is white
noise. The gains and the covariance are those of the steady state.

References
----------
Kalata, "The tracking index: a generalized parameter for alpha-beta and alpha-beta-gamma target
trackers", 1984. Bar-Shalom, Li and Kirubarajan, "Estimation with applications to tracking and
navigation", 2001, section 6.5.
"""

from collections.abc import Mapping

import numpy as np

from analysis.filters.base import NOISE_SETTINGS, Estimates, FilterKind
from analysis.filters.noise_model import NoiseModel
from analysis.signals.signal_stats import SignalStats
from shiplog import Signals
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings


class AlphaBetaFilter:
    """The filter at the start of a trial; arrays of two hold yaw rate and speed."""

    def __init__(
        self,
        _model: Coefficients,
        noise: NoiseModel,
        stats: SignalStats,
        _settings: FilterSettings,
    ) -> None:
        T, std = stats.interval_secs, noise.measurement_std
        bandwidth = noise.process_ratio ** np.array([0.25, 0.5])  # rad/s
        index = (bandwidth * T) ** 2  # Kalata's tracking index
        damping = (4 + index - np.sqrt(8 * index + index**2)) / 4
        alpha = 1 - damping**2
        beta = 2 * (2 - alpha) - 4 * np.sqrt(1 - alpha)
        self._gains = alpha, beta / T
        self._x, self._rate = np.array(stats.first, float), np.zeros(2)
        x_std = std * np.sqrt(alpha)
        rate_std = std / T * np.sqrt(beta * (2 * alpha - beta) / (2 * (1 - alpha)))
        jerk_std = std / T**2 * index
        self._stds = np.array([x_std[0], rate_std[0], jerk_std[0], x_std[1], rate_std[1]])
        self._innovation_stds = std / np.sqrt(1 - alpha)

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Estimates:  # noqa: ARG002
        """Filter the next chunk; where a sample is NaN the state is only predicted."""
        measured = np.column_stack([chunk["yaw_rate"], chunk["speed"]])
        n = len(measured)
        states, innovations = np.zeros((n, 5)), np.empty((n, 2))
        alpha, beta_per_second = self._gains
        for k in range(n):
            innovations[k] = measured[k] - self._x
            e = np.nan_to_num(innovations[k])
            self._x = self._x + alpha * e
            self._rate = self._rate + beta_per_second * e
            states[k, [0, 3]], states[k, [1, 4]] = self._x, self._rate
            self._x = self._x + chunk.dt_secs * self._rate
        return Estimates(
            states=states,
            stds=np.tile(self._stds, (n, 1)),
            innovations=innovations,
            innovation_stds=np.tile(self._innovation_stds, (n, 1)),
            rejected=np.zeros((n, 2), bool),
        )


ALPHA_BETA = FilterKind(
    "alpha-beta",
    AlphaBetaFilter,
    settings=(*NOISE_SETTINGS, "yaw_bandwidth", "surge_bandwidth"),
)

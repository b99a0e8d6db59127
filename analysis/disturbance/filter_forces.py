"""Disturbances that are states of the filter, in place of the observer's where it is smoothed."""

import numpy as np

from analysis.filters.base import OUTPUT_STATES, Estimates
from analysis.signals.moments import Moments
from analysis.signals.signal_stats import SignalStats
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray, Signals
from shiplog.vessel.settings import DisturbanceSettings

from .disturbances import RUDDER_MAX, Disturbance, DisturbanceCollector, DisturbanceSummary
from .observer_design import SLOW_SETTLING

# the names of `FurtherStates` by those of the disturbances
STATES = {
    "yaw": "yaw_moment",
    "surge": "surge_force",
    "yaw_wave": "yaw_moment_wave",
    "surge_wave": "surge_force_wave",
}


class FilterForces:
    """Takes the disturbances from the states of a filter, chunk by chunk.

    Parameters
    ----------
    model
        Coefficients of the paper's model.
    stats
        Statistics of the signals.
    settings
        The settings of ``[disturbance]``.
    rudder_max
        The ship's largest rudder angle, rad, for `excess_share`.
    """

    def __init__(
        self,
        model: Coefficients,
        stats: SignalStats,
        settings: DisturbanceSettings,
        *,
        rudder_max: float = RUDDER_MAX,
    ) -> None:
        degree = 1 if "ramp" in settings.models else 0
        yaw = SLOW_SETTLING[degree] / settings.yaw_frequency
        surge = SLOW_SETTLING[degree] / settings.surge_frequency
        settling = {"yaw": yaw, "rudder": yaw, "surge": surge}
        if "wave" in settings.models:
            settling |= {"yaw_wave": yaw, "surge_wave": surge}
        self._collector = DisturbanceCollector(
            model, stats, settling, rudder_max=rudder_max, has_transient=False
        )
        self._variances = {name: Moments() for name in STATES if name in settling}

    def step(self, chunk: Signals, estimates: Estimates) -> Disturbance:
        """Return the disturbances of the next chunk.

        Parameters
        ----------
        chunk
            The signals, with the inputs held.
        estimates
            The estimates of the chunk, with the disturbances among the further states.
        """
        forces, stds = {}, {}
        for name, moments in self._variances.items():
            found = estimates.further.of(STATES[name]) if estimates.further else None
            # a slow part that is not modelled, or a wave too fast for the samples
            forces[name], stds[name] = found or (np.zeros(len(chunk)), np.zeros(len(chunk)))
            moments.add(stds[name])
        slow_stds: FloatArray = np.column_stack((stds["yaw"], stds["surge"]))
        speed = estimates.states[:, OUTPUT_STATES[1]]
        return self._collector.add(forces, speed, chunk["rpm"], slow_stds)

    @property
    def excess_share(self) -> float:
        """Share of the instants at which the yaw disturbance exceeds the largest rudder angle."""
        return self._collector.excess_share

    def result(self) -> dict[str, DisturbanceSummary]:
        """Return the summaries of all disturbances, over all chunks."""
        stds = {name: float(np.sqrt(m.mean_square)) for name, m in self._variances.items()}
        return self._collector.result(stds)

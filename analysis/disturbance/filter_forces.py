"""Disturbances that are states of the filter, in place of the observer's where it is smoothed."""

import numpy as np

from analysis.filters.base import OUTPUT_STATES, Estimates
from analysis.filters.wind_terms import WIND_TERMS
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
    wind
        The terms of the wind among the states, some of `WIND_TERMS`.
    rudder_max
        The ship's largest rudder angle, rad, for `excess_share`.
    """

    def __init__(
        self,
        model: Coefficients,
        stats: SignalStats,
        settings: DisturbanceSettings,
        *,
        wind: tuple[str, ...] = (),
        rudder_max: float = RUDDER_MAX,
    ) -> None:
        degree = 1 if "ramp" in settings.models else 0
        yaw = SLOW_SETTLING[degree] / settings.yaw_frequency
        surge = SLOW_SETTLING[degree] / settings.surge_frequency
        settling = {"yaw": yaw, "rudder": yaw, "surge": surge}
        if "wave" in settings.models:
            settling |= {"yaw_wave": yaw, "surge_wave": surge}
        self._wind = {
            name: tuple(term for term in wind if WIND_TERMS[term].axis == axis)
            for axis, name in enumerate(("yaw_wind", "surge_wind"))
        }
        settling |= {name: yaw if name == "yaw_wind" else surge for name in self._wind if wind}
        self._collector = DisturbanceCollector(
            model, stats, settling, rudder_max=rudder_max, has_transient=False
        )
        self._variances = {name: Moments() for name in (*STATES, *self._wind) if name in settling}

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
            if name in self._wind:
                forces[name], stds[name] = self._force_of_wind(name, chunk, estimates)
            else:
                found = estimates.further.of(STATES[name]) if estimates.further else None
                # a slow part without evidence or not requested, or a wave too fast for the samples
                forces[name], stds[name] = found or (
                    np.zeros(len(chunk)),
                    np.full(len(chunk), np.nan),
                )
            moments.add(stds[name])
        slow_stds: FloatArray = np.column_stack((stds["yaw"], stds["surge"]))
        speed = estimates.states[:, OUTPUT_STATES[1]]
        return self._collector.add(forces, speed, chunk["rpm"], slow_stds)

    def _force_of_wind(
        self, name: str, chunk: Signals, estimates: Estimates
    ) -> tuple[FloatArray, FloatArray]:
        """Return the moment or force of the wind (n,), and its standard deviation at most.

        The standard deviation is that of coefficients that err alike.
        """
        force, std = np.zeros(len(chunk)), np.zeros(len(chunk))
        for term in self._wind[name]:
            found = estimates.further.of(term) if estimates.further else None
            if found is not None:
                force += found[0] * chunk[term]
                std += found[1] * np.abs(chunk[term])
        return force, std

    @property
    def excess_share(self) -> float:
        """Share of the instants at which the yaw disturbance exceeds the largest rudder angle."""
        return self._collector.excess_share

    def result(self) -> dict[str, DisturbanceSummary]:
        """Return the summaries of all disturbances, over all chunks."""
        stds = {name: float(np.sqrt(m.mean_square)) for name, m in self._variances.items()}
        return self._collector.result(stds)

"""Choice of the terms of the wind that a log distinguishes from the other disturbances.

A wind that is steady in speed and angle acts on the ship as a constant moment and a constant force
do: what its regressors have in common with the slow disturbances, and with the terms before, shows
nothing of their coefficients. A term that is not distinguished is a state all the same, so that the
standard deviations of the others allow for it.
"""

import numpy as np

from analysis.filters.further_parts import RandomWalk
from analysis.filters.wind_terms import SURGE, WIND_CHANGE, WIND_TERMS, YAW, wind_prior_std
from analysis.signals.signal_stats import SignalStats
from shiplog.errors import UsageError
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray
from shiplog.vessel.settings import WIND, DisturbanceSettings

BLOCK_SECS = 20.0  # over which a regressor is averaged: the noise of an anemometer is no variation
MIN_WIND_VARIATION = 0.05  # of a regressor's rms: what a slow disturbance cannot imitate
SLOW_FORCES = {YAW: "yaw moment", SURGE: "surge force"}


def choose_wind(
    disturbance: DisturbanceSettings, sensors: tuple[str, ...], stats: SignalStats
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Choose the terms of the wind to estimate.

    Parameters
    ----------
    disturbance
        The settings of ``[disturbance]``.
    sensors
        The sensor errors among the states of the filter.
    stats
        The statistics of the signals, of which the first part has the regressors.

    Returns
    -------
    terms
        The states of the filter, some of `WIND_TERMS`: all that act; none where no wind is asked
        for.
    undetermined
        Those that cannot be distinguished or do not act, each with the reason.

    Raises
    ------
    UsageError
        No term can be distinguished.
    """
    if WIND not in disturbance.models:
        return (), {}
    chosen: list[str] = []
    acting: list[str] = []
    undetermined: dict[str, str] = {}
    bases = {axis: _slow_forces(axis, disturbance, sensors, stats) for axis in SLOW_FORCES}
    for name, term in WIND_TERMS.items():
        regressor, basis = _block_means(stats, stats.head[name]), bases[term.axis]
        size = float(np.sqrt(np.mean(regressor**2)))
        if not size:
            undetermined[name] = "there is no wind"
            continue
        acting.append(name)
        share = _residual_rms(regressor, basis) / size
        if share > MIN_WIND_VARIATION:
            chosen.append(name)
            bases[term.axis] = np.column_stack((basis, regressor))
        else:
            undetermined[name] = (
                f"the wind is too steady in speed and angle: but for {100 * share:.2g} % it acts as"
                f" {_imitators(term.axis, disturbance, sensors, chosen)}"
            )
    if not chosen:
        reasons = "; ".join(
            f"{WIND_TERMS[name].label}: {why}" for name, why in undetermined.items()
        )
        raise UsageError(
            f"disturbance.models has wind, which cannot be distinguished in this log: {reasons}; "
            "it needs a manoeuvre that turns the ship in the wind; remove wind"
        )
    return tuple(acting), undetermined


def wind_walks(c: Coefficients, stats: SignalStats) -> dict[str, RandomWalk]:
    """Return the coefficients of the wind as random walks, by their names."""
    stds = {name: wind_prior_std(term, c, stats) for name, term in WIND_TERMS.items()}
    return {
        name: RandomWalk(term.label, term.unit, stds[name], WIND_CHANGE * stds[name])
        for name, term in WIND_TERMS.items()
    }


def _block_means(stats: SignalStats, values: FloatArray) -> FloatArray:
    """Return the means over blocks of `BLOCK_SECS`; of what is shorter than one, the values."""
    size = max(round(BLOCK_SECS / stats.dt_secs), 1)
    count = len(values) // size
    if count < 2:
        return values
    means: FloatArray = values[: count * size].reshape(count, size).mean(axis=1)
    return means


def _slow_forces(
    axis: int, disturbance: DisturbanceSettings, sensors: tuple[str, ...], stats: SignalStats
) -> FloatArray:
    """Return what slow disturbances and the zero of the rudder are in the blocks, (n, k)."""
    count = len(_block_means(stats, stats.head["rudder"]))
    columns = []
    if {"constant", "ramp"} & set(disturbance.models) or (axis == YAW and "rudder" in sensors):
        columns.append(np.ones(count))
    if "ramp" in disturbance.models:
        columns.append(np.linspace(-1.0, 1.0, count))
    return np.column_stack(columns) if columns else np.zeros((count, 0))


def _imitators(
    axis: int, disturbance: DisturbanceSettings, sensors: tuple[str, ...], chosen: list[str]
) -> str:
    """Name what a term of the wind cannot be distinguished from."""
    names = []
    if {"constant", "ramp"} & set(disturbance.models):
        slow = "a ramp of the" if "ramp" in disturbance.models else "a constant"
        names.append(f"{slow} {SLOW_FORCES[axis]}")
    if axis == YAW and "rudder" in sensors:
        names.append("the rudder zero")
    if any(WIND_TERMS[name].axis == axis for name in chosen):
        names.append("the other term of the wind")
    return " and ".join(names)


def _residual_rms(values: FloatArray, basis: FloatArray) -> float:
    """Return the rms of values (n,) without what is in the columns of a basis (n, k)."""
    fitted = basis @ np.linalg.lstsq(basis, values)[0] if basis.size else 0.0
    return float(np.sqrt(np.mean((values - fitted) ** 2)))

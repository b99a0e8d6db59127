"""An identified ship, with the histories of its parameters by the other methods."""

import pickle
from copy import deepcopy
from functools import cache

import numpy as np
from trial_logs import as_log

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import load_vessel


@cache
def ship_without_sway() -> IdentifiedShip:
    vessel, toml = load_vessel("table1")
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=200.0, sensors=suite("paper"), vessel_toml=toml
    )
    return identify([as_log(trial, "zigzag.mcap")], "drift-lag")


def test_drift_lag_without_sway_has_histories() -> None:
    ship = ship_without_sway()
    assert "Td" in ship.uncertainty.unidentifiable
    assert np.isfinite(ship.histories[0].values[0, 0]).all()


def test_histories_pickle_and_copy() -> None:
    ship = ship_without_sway()
    for again in (pickle.loads(pickle.dumps(ship)), deepcopy(ship)):  # noqa: S301 - our own
        for one, other in zip(again.histories, ship.histories, strict=True):
            assert (one.method, one.names) == (other.method, other.names)
            np.testing.assert_array_equal(one.values, other.values)
            np.testing.assert_array_equal(one.stds, other.stds)

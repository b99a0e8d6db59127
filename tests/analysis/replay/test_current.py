from math import radians

import numpy as np
import pytest

from analysis.replay.current import Current, current_of


@pytest.mark.parametrize(
    ("north", "east", "direction_deg"),
    [(0.5, 0.0, 0.0), (0.0, 0.5, 90.0), (-0.5, 0.0, 180.0), (0.0, -0.5, 270.0), (0.3, -0.3, 315.0)],
)
def test_the_direction_is_the_one_into_which_the_current_flows(
    north: float, east: float, direction_deg: float
) -> None:
    current = Current(north, east, 0.01, 0.01, 0.0, 1.0)
    assert current.direction == pytest.approx(radians(direction_deg))


def test_a_current_within_its_uncertainty_has_no_direction() -> None:
    assert not Current(0.1, 0.0, 0.01, 0.06, 0.0, 1.0).determined
    assert Current(0.1, 0.1, 0.06, 0.06, 0.0, 1.0).determined


def test_where_the_innovations_are_too_large_no_current_is_determined() -> None:
    last = {"current_north": (0.5, 0.01), "current_east": (0.0, 0.01), "drift_length": (60.0, 4.0)}
    found, unsure = current_of(last), current_of(last, "the innovations are larger than expected")
    assert found is not None
    assert unsure is not None
    assert found.determined
    assert not unsure.determined


def test_set_and_drift_are_at_least_as_uncertain_as_in_any_draw() -> None:
    rng = np.random.default_rng(0)
    for correlation in (-1.0, 0.0, 1.0):
        cov = np.array([[0.02**2, correlation * 2e-4], [correlation * 2e-4, 0.01**2]])
        north, east = rng.multivariate_normal([0.4, -0.3], cov, 20_000).T
        current = Current(0.4, -0.3, 0.02, 0.01, 0.0, 1.0)
        assert np.std(np.hypot(north, east)) < 1.02 * current.speed_std
        assert np.std(np.arctan2(east, north)) < 1.02 * current.direction_std
    assert current.speed_std == pytest.approx(0.8 * 0.02 + 0.6 * 0.01)
    assert current.direction_std == pytest.approx((0.6 * 0.02 + 0.8 * 0.01) / 0.5)


def test_without_positions_there_is_no_current() -> None:
    assert current_of({"gyro": (1e-4, 1e-5), "heading": (0.1, 1e-3)}) is None

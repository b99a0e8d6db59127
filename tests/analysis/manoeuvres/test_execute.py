"""The order that begins a manoeuvre, found whatever small helm comes before it."""

from math import radians

import numpy as np
import pytest

from analysis.manoeuvres.execute import first_execute

DT = 0.5
ORDER_SECS = 60.0


def rudder_angle(
    angle: float, helm: float, rate: float = 2.5, noise: float = 0.1, offset: float = 0.0
) -> np.ndarray:
    """Rudder in rad, from degrees and deg/s: slow helm, then one order at `ORDER_SECS`."""
    time = np.arange(0, 200, DT)
    before = offset + helm * np.sin(2 * np.pi * time / 50)
    at = float(before[time == ORDER_SECS][0])
    ramp = at + np.sign(angle) * np.minimum(rate * (time - ORDER_SECS), abs(angle - at))
    values = np.where(time <= ORDER_SECS, before, ramp)
    return np.radians(values + np.random.default_rng(1).normal(0, noise, len(time)))


@pytest.mark.parametrize("angle", [35.0, -35.0, 20.0, -20.0, 10.0, -10.0])
@pytest.mark.parametrize("helm", [0.0, 0.8, 2.0, -2.0])
@pytest.mark.parametrize("rate", [1.0, 2.5, 1000.0])
def test_small_helm_before_the_order_is_not_the_execute(
    angle: float, helm: float, rate: float
) -> None:
    execute = first_execute(rudder_angle(angle, helm, rate), DT)
    assert execute is not None
    assert execute * DT == pytest.approx(ORDER_SECS, abs=1.0)


@pytest.mark.parametrize("offset", [-1.5, 1.5])
def test_a_rudder_zero_that_is_not_zero_moves_no_execute(offset: float) -> None:
    execute = first_execute(rudder_angle(10.0, 0.5, offset=offset), DT)
    assert execute is not None
    assert execute * DT == pytest.approx(ORDER_SECS, abs=1.0)


def test_helm_that_is_held_before_the_order_is_not_the_execute() -> None:
    rudder = np.zeros(400)
    rudder[20:110] = radians(4.0)
    rudder[121:] = radians(35.0)
    assert first_execute(rudder, DT) == 120


def test_a_rudder_that_only_keeps_the_course_is_no_order() -> None:
    assert first_execute(rudder_angle(0.0, 0.0), DT) is None

from math import pi, radians

import numpy as np
import pytest

from recorders.simulated.manoeuvres import APPROACH_SECS, EXAMPLES, manoeuvre
from shiplog import UsageError


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_named_manoeuvre_begins_at_once_and_in_order(name: str) -> None:
    ordered = manoeuvre(name, 900.0, 80.0, np.random.default_rng(1))
    times = [order.time_secs for order in ordered.orders]
    assert times[0] == 0.0
    assert times == sorted(set(times))
    assert max(times) < 900.0


def test_a_turning_circle_is_35_degrees_to_starboard_by_default() -> None:
    assert manoeuvre("turning-circle", 100.0, 80.0).orders[1].rudder == pytest.approx(radians(35))
    assert manoeuvre("turning-circle-20", 100.0, 80.0).orders[1].rudder == pytest.approx(
        radians(20)
    )
    assert manoeuvre("turning-circle-port", 100.0, 80.0).orders[1].rudder == pytest.approx(
        -radians(35)
    )


def test_a_zigzag_takes_its_rudder_and_its_heading_from_the_name() -> None:
    zigzag = manoeuvre("zigzag-10-5.5", 100.0, 80.0).zigzag
    assert zigzag is not None
    assert (zigzag.rudder, zigzag.heading) == pytest.approx((radians(10), radians(5.5)))
    assert zigzag.start_secs == APPROACH_SECS
    port = manoeuvre("zigzag-20-20-port", 100.0, 80.0).zigzag
    assert port is not None
    assert (port.rudder, port.heading) == pytest.approx((-radians(20), radians(20)))


def test_pull_out_and_spiral_are_repeated_until_the_duration_is_filled() -> None:
    for name in ("pull-out", "spiral"):
        ordered = manoeuvre(name, 20_000.0, 80.0)
        rudders = [order.rudder for order in ordered.orders[1:]]
        holds = np.diff([order.time_secs for order in ordered.orders[1:]])
        assert ordered.orders[-1].time_secs > 20_000.0 - 2 * holds[0]
        assert rudders.count(rudders[0]) > 5
        assert min(rudders) == -max(rudders)


def test_a_pseudo_random_run_moves_rudder_and_revolutions_within_bounds() -> None:
    ordered = manoeuvre("pseudo-random", 3000.0, 80.0, np.random.default_rng(5))
    rudder = np.array([order.rudder for order in ordered.orders[1:]])
    rpm = np.array([order.rpm for order in ordered.orders[1:]])
    assert np.all(np.abs(rudder) <= 20 * pi / 180)
    assert len(set(rudder)) > 40
    assert rpm.min() >= 56
    assert rpm.max() <= 96
    assert len(set(rpm)) > 10


def test_the_papers_run_starts_slow_at_100_rpm() -> None:
    ordered = manoeuvre("paper", 500.0, 80.0)
    assert ordered.initial_speed == 2.0
    assert [(o.time_secs, o.rpm) for o in ordered.orders] == [(0.0, 100.0), (200.0, 100.0)]
    assert ordered.orders[0].rudder == -ordered.orders[1].rudder == pytest.approx(radians(20))


@pytest.mark.parametrize("name", ["zigzag", "zigzag-20", "zigzg-20-20", "turning", "", "spiral-3"])
def test_an_unknown_manoeuvre_is_refused_with_the_known_ones(name: str) -> None:
    with pytest.raises(UsageError, match="known are turning-circle"):
        manoeuvre(name, 100.0, 80.0)


@pytest.mark.parametrize("name", ["zigzag-0-20", "turning-circle-95", "pull-out-0"])
def test_a_rudder_angle_out_of_range_is_refused(name: str) -> None:
    with pytest.raises(UsageError, match="cannot be ordered"):
        manoeuvre(name, 100.0, 80.0)

"""Trials of independent ships: every manoeuvre is found, and the true index is in its interval."""

from collections.abc import Callable
from dataclasses import replace
from math import degrees, pi, radians

import numpy as np
import pytest
from sailed_trials import EXECUTE_SECS, sailed_circle, sailed_zigzag, true_indices
from ships.mariner import LENGTH, SPEED
from ships.sea_trial import GOOD, POOR, SHIPS, Sensors, Steering, TrialShip, as_log, sail
from ships.trial_kinds import KINDS

from analysis import TrialAnalysis, analyse_trial
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.replay.reading_options import ReadingOptions
from shiplog import TrialLog

MARINER, KVLCC2, SEIUN_MARU = SHIPS[:3]
NAMES = [MARINER.name, KVLCC2.name, SEIUN_MARU.name]


def analysed(log: TrialLog, ship: TrialShip) -> TrialAnalysis:
    return analyse_trial(log, ReadingOptions(length=ship.length))


def kinds(trial: TrialAnalysis) -> list[ManoeuvreKind]:
    return [each.kind for each in trial.manoeuvres]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_the_mariner_turns_as_its_published_equations() -> None:
    trial, steering = sailed_circle("mariner")
    indices = true_indices(trial, steering)
    # the record of case 22, simulated by others from the same equations
    assert indices["advance"] == pytest.approx(569.1, rel=0.01)
    assert indices["tactical diameter"] == pytest.approx(1031.3, rel=0.01)
    assert indices["time to 90°"] == pytest.approx(116.1, rel=0.01)
    assert trial.speed[0] == pytest.approx(SPEED)
    assert pytest.approx(160.93) == LENGTH


def test_the_tanker_turns_as_the_model_tests_within_the_accuracy_of_the_method() -> None:
    trial, steering = sailed_circle("kvlcc2", -1.0)
    indices = {name: value / 320.0 for name, value in true_indices(trial, steering).items()}
    assert indices["advance"] == pytest.approx(3.12, rel=0.08)
    assert indices["tactical diameter"] == pytest.approx(3.07, rel=0.1)


@pytest.mark.parametrize("sensors", [GOOD, POOR], ids=["good", "poor"])
@pytest.mark.parametrize("ship", NAMES)
def test_the_true_indices_of_circles_in_a_current_are_in_their_intervals(
    ship: str, sensors: Sensors
) -> None:
    sailed, steering = sailed_circle(ship, -1.0, helm_deg=1.0)
    log = as_log(sailed, sensors, rng(3), current=(0.3, -0.4))
    trial = analysed(log, sailed.ship)
    assert kinds(trial) == [ManoeuvreKind.TURNING_CIRCLE]
    for name, true in true_indices(sailed, steering).items():
        index = trial.manoeuvres[0].index(name)
        assert index is not None
        assert abs(index.value - true) < 3.3 * index.std, name  # 1 in 1000 beyond
    assert abs(trial.manoeuvres[0].execute_secs - EXECUTE_SECS) < 0.6


@pytest.mark.parametrize("angle_deg", [10.0, 20.0])
@pytest.mark.parametrize("ship", NAMES)
def test_the_true_overshoots_are_in_their_intervals(ship: str, angle_deg: float) -> None:
    sailed, steering = sailed_zigzag(ship, angle_deg, -1.0, helm_deg=0.8)
    trial = analysed(as_log(sailed, POOR, rng(4), current=(0.2, 0.2)), sailed.ship)
    assert kinds(trial) == [ManoeuvreKind.ZIGZAG]
    found = trial.manoeuvres[0]
    assert degrees(found.switch_heading) == pytest.approx(angle_deg)
    assert degrees(found.rudder) == pytest.approx(-angle_deg)
    for name, true in true_indices(sailed, steering).items():
        index = found.index(name)
        if index is not None:
            assert abs(index.value - true) < 3.3 * index.std, name
    assert found.index("overshoot 1") is not None


def test_the_intervals_contain_the_true_indices_about_as_often_as_stated() -> None:
    inside, total = 0, 0
    for seed in range(8):
        sailed, steering = sailed_circle("seiun-maru", 1.0, helm_deg=1.0)
        noise = rng(seed)
        biased = replace(
            GOOD if seed % 2 else POOR,
            compass_bias=noise.normal(0.0, radians(0.5)),
            speed_scale=noise.normal(0.0, 0.02),
        )
        current = (noise.normal(0.0, 0.4), noise.normal(0.0, 0.4))
        trial = analysed(as_log(sailed, biased, noise, current), sailed.ship)
        for name, true in true_indices(sailed, steering).items():
            index = trial.manoeuvres[0].index(name)
            assert index is not None
            inside, total = inside + (index.low <= true <= index.high), total + 1
    assert total == 40
    assert inside >= 33  # 38 expected; with 95 % each, fewer than 33 once in 10,000


@pytest.mark.parametrize("helm_deg", [0.3, 1.5])
def test_an_order_channel_gives_the_execute_with_a_slow_gear_and_noise(helm_deg: float) -> None:
    slow = replace(MARINER, rudder_rate=radians(0.6))
    steering = Steering(slow, EXECUTE_SECS, radians(-20), radians(20), helm=radians(helm_deg))
    sailed = sail(slow, steering, 400.0)
    noisy = replace(GOOD, rudder=radians(0.8))
    for orders in (True, False):
        trial = analysed(as_log(sailed, noisy, rng(5), orders=orders), slow)
        assert kinds(trial) == [ManoeuvreKind.ZIGZAG]
        found = trial.manoeuvres[0]
        assert found.execute_secs == pytest.approx(EXECUTE_SECS, abs=0.6 if orders else 2.0)
        assert ("channel" in found.start_rule) is orders


@pytest.mark.parametrize("zero_deg", [-2.0, 2.0])
def test_a_wrong_zero_of_the_rudder_s_sensor_hides_no_zigzag(zero_deg: float) -> None:
    sailed, _ = sailed_zigzag("seiun-maru", 10.0, -1.0, helm_deg=0.8)
    log = as_log(sailed, GOOD, rng(6))
    shifted = [
        replace(each, values=each.values + radians(zero_deg)) if each.name == "rudder" else each
        for each in log
    ]
    trial = analysed(replace(log, channels=tuple(shifted)), sailed.ship)
    assert kinds(trial) == [ManoeuvreKind.ZIGZAG]
    assert degrees(trial.manoeuvres[0].rudder) == pytest.approx(-10.0)


def keeping(ship: TrialShip, course: float = 0.0, limit: float = 0.15) -> Callable[..., float]:
    def helmsman(_time: float, heading: float, yaw_rate: float, _rudder: float) -> float:
        keep = -0.5 * (heading - course) - 15.0 * yaw_rate
        return ship.neutral + max(-limit, min(limit, keep))

    return helmsman


def programme(ship: TrialShip, steps: list[tuple[float, float]]) -> Callable[..., float]:
    def helmsman(time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        orders = [angle for start, angle in steps if start <= time]
        return orders[-1] if orders else keeping(ship)(time, heading, yaw_rate, rudder)

    return helmsman


def test_a_pull_out_is_found_after_its_turn() -> None:
    orders = programme(SEIUN_MARU, [(80.0, radians(20)), (330.0, 0.0)])
    trial = analysed(as_log(sail(SEIUN_MARU, orders, 520.0), GOOD, rng()), SEIUN_MARU)
    assert kinds(trial) == [ManoeuvreKind.TURNING_CIRCLE, ManoeuvreKind.PULL_OUT]
    residual = trial.manoeuvres[1].index("residual yaw rate")
    assert residual is not None
    assert abs(degrees(residual.value)) < 0.05  # stable


def test_the_spiral_of_an_unstable_ship_has_a_loop() -> None:
    angles = [15, 10, 5, 3, 1, -1, -3, -5, -10, -15, -10, -5, -3, -1, 1, 3, 5, 10, 15]
    orders = programme(KVLCC2, [(60.0 + 120.0 * k, radians(a)) for k, a in enumerate(angles)])
    trial = analysed(as_log(sail(KVLCC2, orders, 60.0 + 120.0 * 19), GOOD, rng()), KVLCC2)
    assert kinds(trial) == [ManoeuvreKind.DIRECT_SPIRAL]
    assert len(trial.manoeuvres[0].spiral) == len(angles)
    height = trial.manoeuvres[0].index("loop height")
    assert height is not None
    assert degrees(height.value) > 0.1


def test_a_stopping_manoeuvre_ends_where_the_ship_stops() -> None:
    def astern(time: float) -> float:
        return max(-0.6, 1.0 - max(0.0, time - 100.0) / 20.0) * SEIUN_MARU.rpm

    sailed = sail(SEIUN_MARU, keeping(SEIUN_MARU), 400.0, revolutions=astern)
    trial = analysed(as_log(sailed, GOOD, rng()), SEIUN_MARU)
    (stop,) = (each for each in trial.manoeuvres if each.kind is ManoeuvreKind.STOPPING)
    true = float(np.interp(0.0, -sailed.speed[400:], sailed.time[400:])) - 100.0
    reach, time = stop.index("track reach"), stop.index("stopping time")
    assert reach is not None
    assert time is not None
    assert time.value == pytest.approx(true, abs=2.0)
    assert reach.criterion is not None
    assert reach.value == pytest.approx(
        float(np.trapezoid(sailed.speed[400:], dx=0.25) if sailed.speed[-1] > 0 else reach.value),
        rel=0.05,
    )


def test_an_acceleration_is_found() -> None:
    def faster(time: float) -> float:
        return min(1.0, 0.5 + max(0.0, time - 100.0) / 60.0) * SEIUN_MARU.rpm

    sailed = sail(SEIUN_MARU, keeping(SEIUN_MARU), 400.0, revolutions=faster, speed=4.2)
    trial = analysed(as_log(sailed, GOOD, rng()), SEIUN_MARU)
    assert kinds(trial) == [ManoeuvreKind.ACCELERATION]


def test_two_straight_runs_of_reciprocal_courses_are_a_double_run() -> None:
    def there_and_back(time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        return keeping(SEIUN_MARU, 0.0 if time < 400.0 else pi)(time, heading, yaw_rate, rudder)

    sailed = sail(SEIUN_MARU, there_and_back, 1000.0)
    trial = analysed(as_log(sailed, GOOD, rng(), current=(0.6, 0.1)), SEIUN_MARU)
    assert kinds(trial) == [ManoeuvreKind.SPEED_RUN, ManoeuvreKind.SPEED_RUN]
    current = trial.conditions.current
    assert current is not None
    assert current.north == pytest.approx(0.6, abs=3 * current.std + 0.02)


@pytest.mark.parametrize(
    ("kind", "ship"),
    [
        ("initial turning 10°", MARINER),
        ("pull-out after a circle 20°", MARINER),
        ("reverse spiral, moving rudder", SEIUN_MARU),
        ("acceleration", SEIUN_MARU),
    ],
)
def test_the_manoeuvre_sailed_is_found_and_no_other(kind: str, ship: TrialShip) -> None:
    approach = Steering(ship, EXECUTE_SECS, -1.0, course=2.0, helm=radians(1.0))
    sailed = KINDS[kind].sail(approach)
    trial = analysed(as_log(sailed.trial, POOR, rng(7), (0.3, 0.2)), ship)
    assert tuple(kinds(trial)) == KINDS[kind].expected


def test_a_zigzag_sampled_every_ten_seconds_has_its_switch_heading_and_wider_intervals() -> None:
    sailed, steering = sailed_zigzag("mariner", 20.0, -1.0, helm_deg=0.8)
    (found,) = analysed(as_log(sailed, replace(GOOD, interval=10.0), rng(8)), MARINER).manoeuvres
    assert degrees(found.switch_heading) == pytest.approx(20.0)
    assert any("is assumed" in note for note in found.notes)
    time = found.index("initial turning time")
    assert time is not None
    assert time.std > 1.0
    for name, true in true_indices(sailed, steering).items():
        index = found.index(name)
        assert index is None or abs(index.value - true) < 3.3 * index.std, name


def test_a_zigzag_with_too_few_samples_of_the_rudder_has_no_indices() -> None:
    sailed, _ = sailed_zigzag("mariner", 20.0, -1.0, helm_deg=0.8)
    log = as_log(sailed, replace(GOOD, interval=20.0), rng(9))
    (found,) = analysed(log, sailed.ship).manoeuvres
    assert found.indices == ()
    assert "recorded every 20 s" in found.not_computed[0].reason


def test_a_zigzag_whose_last_angle_is_kept_for_a_turn_is_no_initial_turning() -> None:
    zigzag = Steering(SEIUN_MARU, EXECUTE_SECS, radians(10.0), radians(10.0))

    def helmsman(time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        if len(zigzag.executes) < 3:
            return zigzag(time, heading, yaw_rate, rudder)
        return (
            radians(-10.0)
            if heading > -pi / 2
            else keeping(SEIUN_MARU, -pi / 2)(time, heading, yaw_rate, rudder)
        )

    trial = analysed(as_log(sail(SEIUN_MARU, helmsman, 420.0), GOOD, rng()), SEIUN_MARU)
    assert kinds(trial) == [ManoeuvreKind.ZIGZAG]


def test_like_counter_rudder_after_a_zigzag_is_none_of_its_reversals() -> None:
    zigzag = Steering(SEIUN_MARU, EXECUTE_SECS, radians(10.0), radians(10.0))

    def helmsman(time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        if len(zigzag.executes) < 2 or heading < radians(-1.0):
            return zigzag(time, heading, yaw_rate, rudder)
        zigzag.executes.append(time)
        counter = yaw_rate > radians(0.05)
        return radians(-10.0) if counter else keeping(SEIUN_MARU)(time, heading, yaw_rate, rudder)

    trial = analysed(as_log(sail(SEIUN_MARU, helmsman, 420.0), GOOD, rng()), SEIUN_MARU)
    assert kinds(trial) == [ManoeuvreKind.ZIGZAG]


def test_half_a_manoeuvre_is_named_with_its_reason() -> None:
    steering = Steering(KVLCC2, EXECUTE_SECS, radians(35.0))
    trial = analysed(as_log(sail(KVLCC2, steering, 160.0), GOOD, rng()), KVLCC2)
    assert trial.manoeuvres == ()
    assert any("a turning circle needs 90°" in each.reason for each in trial.not_computed)


def test_a_stopped_ship_is_named() -> None:
    sailed = sail(SEIUN_MARU, lambda *_: 0.0, 120.0, revolutions=lambda _: 0.01, speed=0.05)
    trial = analysed(as_log(sailed, replace(GOOD, speed=0.01), rng()), SEIUN_MARU)
    assert trial.manoeuvres == ()
    assert any("stopped" in each.reason for each in trial.not_computed)


def test_the_mean_of_a_double_run_is_free_of_the_current() -> None:
    def there_and_back(time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        return keeping(MARINER, 0.0 if time < 300.0 else pi)(time, heading, yaw_rate, rudder)

    sailed = sail(MARINER, there_and_back, 1100.0)
    log = as_log(sailed, GOOD, rng(), current=(0.6, 1.5))
    at = log["rpm"]
    power = replace(at, name="power", unit="W", values=5e6 + 0.0 * at.values)
    trial = analysed(replace(log, channels=(*log.channels, power)), MARINER)
    speed = trial.manoeuvres[-1].index("speed of the double run")
    shaft = trial.manoeuvres[-1].index("power of the double run")
    assert speed is not None
    assert shaft is not None
    assert speed.value == pytest.approx(MARINER.speed, rel=0.01)
    assert shaft.value == pytest.approx(5e6)

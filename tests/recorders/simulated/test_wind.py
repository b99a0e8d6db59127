"""A simulated wind, against another integrator and against plain trigonometry."""

from dataclasses import replace
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from recorders.simulated.manoeuvres import Manoeuvre, Order, manoeuvre
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import Trajectory, compute_trajectory
from recorders.simulated.wind import APPARENT_WIND, REFERENCE_WIND, Wind
from shiplog import UsageError, Vessel, read
from shiplog.cli.main import main

GALE = Wind(15.0, radians(45))


def sailed(vessel: Vessel, wind: Wind | None, name: str = "zigzag-20-20") -> Trajectory:
    return compute_trajectory(vessel, manoeuvre(name, 120.0, vessel.approach_rpm), 120.0, wind=wind)


def test_a_ship_in_a_wind_moves_as_another_integrator_computes(vessel: Vessel) -> None:
    c, rpm = vessel.paper_coefficients, vessel.approach_rpm
    straight = Manoeuvre("straight", (Order(0.0, 0.0, rpm),))
    trajectory = compute_trajectory(vessel, straight, 120.0, wind=GALE)
    speed = trajectory.at(np.zeros(1))["speed"][0]
    per_rudder = trajectory.ship.moment_per_rudder(trajectory.constants)[0] / REFERENCE_WIND**2

    def rates(_: float, x: np.ndarray) -> list[float]:
        w, w_dot, v, psi = x
        # the wind's velocity relative to the ship, as where it blows from
        relative = GALE.speed * np.exp(1j * (GALE.direction - psi)) + v
        V, gamma = np.abs(relative), np.angle(relative)
        moment = GALE.oblique * np.sin(2 * gamma) + GALE.beam * np.sin(gamma)
        hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w**3
        force = GALE.drag * (v**2 - V**2 * np.cos(gamma))
        surge = c.f * w**2 + c.g * v**2 + c.h * rpm + force
        return [w_dot, hull + per_rudder * V**2 * moment, surge, w]

    expected = solve_ivp(rates, (0, 120), [0, 0, speed, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    truth = trajectory.at(np.array([120.0]))
    assert degrees(abs(expected[3])) > 3
    # the wind is held over steps of 0.1 s
    assert truth["heading"][0] == pytest.approx(expected[3], rel=2e-3)
    assert truth["yaw_rate"][0] == pytest.approx(expected[0], rel=2e-3)
    assert truth["speed"][0] == pytest.approx(expected[2], rel=1e-5)


def test_a_ship_without_a_response_to_the_wind_moves_as_in_a_calm(vessel: Vessel) -> None:
    times = np.linspace(0, 120, 50)
    deaf = sailed(vessel, replace(GALE, oblique=0.0, beam=0.0, drag=0.0)).at(times)
    calm = sailed(vessel, None).at(times)
    for name in ("yaw_rate", "speed", "heading", "yaw_disturbance"):
        assert np.array_equal(deaf[name], calm[name])
    assert "wind_speed" not in calm


def test_a_head_wind_brakes_and_does_not_turn(vessel: Vessel) -> None:
    times = np.array([0.0, 60.0])
    truth = sailed(vessel, Wind(10.0, 0.0), "turning-circle").at(times)
    assert truth["surge_disturbance"][0] < -1e-3
    assert truth["yaw_disturbance"][0] == pytest.approx(0.0, abs=1e-15)
    following = sailed(vessel, Wind(10.0, np.pi), "turning-circle").at(times)
    assert following["surge_disturbance"][0] > 0


def test_the_bow_falls_off_from_an_oblique_wind(vessel: Vessel) -> None:
    starboard, port = (
        sailed(vessel, Wind(10.0, radians(side * 40), beam=0.0)).at(np.zeros(1)) for side in (1, -1)
    )
    assert starboard["yaw_disturbance"][0] < 0
    assert port["yaw_disturbance"][0] == pytest.approx(-starboard["yaw_disturbance"][0])


def test_the_anemometer_measures_the_wind_relative_to_the_ship(vessel: Vessel) -> None:
    sensors = suite("none", {"wind_direction.rate_hz": 2.0}, also=APPARENT_WIND)
    trial = simulate(vessel, "turning-circle", duration_secs=60.0, sensors=sensors, wind=GALE)
    channels = {channel.name: channel for channel in trial.channels}
    truth = trial.trajectory.at(np.arange(61.0))
    angle = GALE.direction - truth["heading"]
    ahead = GALE.speed * np.cos(angle) + truth["speed"]
    starboard = GALE.speed * np.sin(angle) + truth["sway"]
    measured = channels["apparent_wind_speed"].values * np.exp(
        1j * channels["apparent_wind_angle"].values
    )
    assert np.allclose(measured, ahead + 1j * starboard, atol=1e-9)
    assert np.allclose(channels["wind_direction"].values, radians(45))


def test_a_wind_that_is_not_there_cannot_be_measured(vessel: Vessel) -> None:
    with pytest.raises(UsageError, match="apparent_wind_angle is measured in a wind only"):
        simulate(vessel, "spiral", duration_secs=60.0, sensors=suite("none", also=APPARENT_WIND))


@pytest.mark.parametrize("wind", [Wind(-1.0, 0.0), Wind(500.0, 0.0), Wind(5.0, float("nan"))])
def test_an_impossible_wind_is_refused(vessel: Vessel, wind: Wind) -> None:
    with pytest.raises(UsageError, match="a wind must have 0 to 100 m/s"):
        sailed(vessel, wind)


def test_the_command_records_the_wind_and_its_truth(tmp_path: Path) -> None:
    log, truth = tmp_path / "wind.mcap", tmp_path / "truth.mcap"
    command = ["record", "simulate", "turning-circle", "--duration", "30", "--wind", "12,45"]
    assert main([*command, "-o", str(log), "--truth", str(truth)]) == 0
    recorded = read(log)
    assert len(recorded["apparent_wind_speed"]) == 31
    assert np.allclose(read(truth)["wind_direction"].values, radians(45))
    assert "surge_disturbance" in {channel.name for channel in read(truth)}


@pytest.mark.parametrize("text", ["12", "12,north", "12;45", ""])
def test_a_wind_that_cannot_be_parsed_is_a_usage_error(
    tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["record", "simulate", "spiral", f"--wind={text}", "-o", str(tmp_path / "w.mcap")]
    assert main(command) == 2
    assert "--wind takes SPEED,FROM" in capsys.readouterr().err

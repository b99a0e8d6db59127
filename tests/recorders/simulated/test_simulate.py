from dataclasses import replace
from math import inf, nan, radians
from pathlib import Path

import numpy as np
import pytest
from model_ships import vessel_of
from places import SAMPLE_DATA

from recorders.record import record
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import RandomForcing
from shiplog import UsageError, Vessel, read

FORCING = RandomForcing(rudder=radians(0.5), force=0.01)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(
    vessel: Vessel, tmp_path: Path
) -> None:
    def bytes_of(seed: int, name: str) -> bytes:
        trial = simulate(vessel, "pseudo-random", duration_secs=120.0, seed=seed)
        record(trial, tmp_path / name)
        return (tmp_path / name).read_bytes()

    assert bytes_of(7, "a.mcap") == bytes_of(7, "b.mcap")
    assert bytes_of(7, "a.mcap") != bytes_of(8, "c.mcap")


def test_changing_one_sensor_leaves_the_others_noise_alone(vessel: Vessel) -> None:
    plain = simulate(vessel, "spiral", duration_secs=60.0, sensors=suite("paper"))
    changed = simulate(
        vessel, "spiral", duration_secs=60.0, sensors=suite("paper", {"yaw_rate.dropout": 0.3})
    )
    speeds = [
        next(c for c in trial.channels if c.name == "speed").values for trial in (plain, changed)
    ]
    assert np.array_equal(*speeds)


@pytest.mark.parametrize(
    ("name", "ordered", "duration", "seed"),
    [
        ("turning_circle_35", "turning-circle", 500.0, 1),
        ("zigzag_20_20", "zigzag-20-20", 600.0, 2),
        ("pseudo_random", "pseudo-random", 600.0, 4),
    ],
)
def test_a_seed_still_gives_the_samples_of_the_sample_data(
    vessel: Vessel, name: str, ordered: str, duration: float, seed: int
) -> None:
    trial = simulate(vessel, ordered, duration_secs=duration, seed=seed)
    made, truth = read(SAMPLE_DATA / f"{name}.mcap"), read(SAMPLE_DATA / f"{name}.truth.mcap")
    for kept, given in ((made, trial.channels), (truth, trial.truth(2.0))):
        for one, other in zip(kept, given, strict=True):
            assert one.name == other.name
            assert np.array_equal(one.measured_ns, other.measured_ns)
            assert np.array_equal(one.received_ns, other.received_ns)
            assert one.values == pytest.approx(other.values, rel=1e-9, abs=1e-9)


def test_a_random_forcing_repeats_with_its_seed_and_leaves_sensor_noise_alone(
    vessel: Vessel,
) -> None:
    def given(seed: int, random_forcing: RandomForcing | None) -> dict[str, np.ndarray]:
        trial = simulate(
            vessel, "pseudo-random", duration_secs=60.0, seed=seed, random_forcing=random_forcing
        )
        times = {c.name: (c.measured_ns - c.measured_ns[0]) * 1e-9 for c in trial.channels}
        noise = {
            c.name: c.values - trial.trajectory.at(times[c.name])[c.name] for c in trial.channels
        }
        pushed = trial.truth()["yaw_disturbance"].values
        return {"pushed": pushed, "speed": noise["speed"], "rudder": noise["rudder"]}

    one, again, other, calm = (
        given(3, FORCING),
        given(3, FORCING),
        given(4, FORCING),
        given(3, None),
    )
    assert np.array_equal(one["pushed"], again["pushed"])
    assert not np.isin(one["pushed"], other["pushed"]).any()
    assert np.ptp(calm["pushed"]) == 0
    assert one["speed"] == pytest.approx(calm["speed"], abs=1e-12)
    assert one["rudder"] == pytest.approx(calm["rudder"], abs=1e-12)


def test_a_random_forcing_gives_the_same_bytes_for_a_seed(vessel: Vessel, tmp_path: Path) -> None:
    def bytes_of(seed: int) -> bytes:
        path = tmp_path / "a.mcap"
        record(
            simulate(vessel, "spiral", duration_secs=60.0, seed=seed, random_forcing=FORCING), path
        )
        return path.read_bytes()

    assert bytes_of(7) == bytes_of(7) != bytes_of(8)


def test_a_random_forcing_of_zero_changes_no_sample(vessel: Vessel) -> None:
    calm = simulate(vessel, "zigzag-20-20", duration_secs=150.0)
    still = simulate(vessel, "zigzag-20-20", duration_secs=150.0, random_forcing=RandomForcing())
    for one, other in zip(calm.channels, still.channels, strict=True):
        assert np.array_equal(one.values, other.values)


def test_the_truth_has_a_surge_force_only_with_a_random_forcing(vessel: Vessel) -> None:
    calm = simulate(vessel, "spiral", duration_secs=20.0).truth()
    pushed = simulate(vessel, "spiral", duration_secs=20.0, random_forcing=FORCING).truth()
    assert "surge_disturbance" not in [c.name for c in calm]
    assert pushed["surge_disturbance"].unit == "m/s²"
    assert len(pushed["surge_disturbance"]) == 201


def test_a_longer_trial_starts_with_the_random_forcing_of_the_shorter(vessel: Vessel) -> None:
    short, long = (
        simulate(vessel, "spiral", duration_secs=duration, random_forcing=FORCING).truth()
        for duration in (30.0, 60.0)
    )
    for name in ("yaw_disturbance", "surge_disturbance"):
        assert np.array_equal(short[name].values, long[name].values[:301])


@pytest.mark.parametrize("size", [-0.1, nan, inf])
def test_an_invalid_random_forcing_is_refused(vessel: Vessel, size: float) -> None:
    for random_forcing in (RandomForcing(rudder=size), RandomForcing(force=size)):
        with pytest.raises(UsageError, match="must be finite and not negative"):
            simulate(vessel, "spiral", duration_secs=10.0, random_forcing=random_forcing)


def test_chunks_hold_every_sample_once_in_the_order_of_reception(
    vessel: Vessel, tmp_path: Path
) -> None:
    trial = simulate(vessel, "pull-out", duration_secs=1500.0)
    count = record(trial, tmp_path / "a.mcap").samples
    log = read(tmp_path / "a.mcap")
    assert count == sum(map(len, log)) == sum(map(len, trial.channels))
    for kept, made in zip(log, trial.channels, strict=True):
        assert np.array_equal(kept.values, made.values)
        assert np.array_equal(kept.measured_ns, made.measured_ns)


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), float("inf")])
def test_an_invalid_duration_is_refused(vessel: Vessel, duration: float) -> None:
    with pytest.raises(UsageError, match="duration must be positive"):
        simulate(vessel, "spiral", duration_secs=duration)


def test_a_diverging_simulation_is_refused_with_the_ships_name(vessel: Vessel) -> None:
    wild = replace(vessel, name="wild", coefficients=vessel.coefficients._replace(b3=1e4, a=0.5))
    with pytest.raises(UsageError, match="simulation of wild diverges"):
        simulate(wild, "turning-circle", duration_secs=500.0)


def test_sway_is_measured_and_true_only_for_a_model_with_sway(vessel: Vessel) -> None:
    asked = suite("none", {"sway.white": 0.0})
    rich, plain = (
        simulate(ship, "zigzag-20-20", duration_secs=60.0, sensors=asked)
        for ship in (vessel_of("three-dof"), vessel)
    )
    sway = {trial: {c.name: c for c in trial.channels}["sway"].values for trial in (rich, plain)}
    assert np.ptp(sway[rich]) > 0.1
    assert np.array_equal(sway[rich], rich.truth()["sway"].values)
    assert not sway[plain].any()
    assert "sway" not in plain.truth()
    units = [trial.truth()["yaw_disturbance"].unit for trial in (rich, plain)]
    assert units == ["rad/s²", "rad/s³"]
    assert "sway" not in {c.name for c in simulate(vessel, "paper", duration_secs=9.0).channels}

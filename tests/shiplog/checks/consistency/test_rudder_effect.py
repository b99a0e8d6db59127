"""A reversed rudder sign gives a warning; a right one, or too little motion, gives none."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from channels import channel
from places import KVLCC2, LAYOUTS
from tanker_logs import tanker_log

from shiplog.checks.consistency.consistency_check import consistency_findings
from shiplog.layouts.layout import load_layout
from shiplog.tables.foreign import read_table
from shiplog.types import TrialLog

Steering = Callable[[float, float, float], float]  # time, heading, yaw rate -> rudder, rad


def simulated_log(
    steering: Steering, *, secs: float = 600.0, seed: int = 0, waves: float = 0.0
) -> TrialLog:
    """A ship of first order, K = 0.05 1/s and T = 40 s, with noise and a disturbance."""
    rng = np.random.default_rng(seed)
    dt, heading, rate, rudder, swell = 0.1, 0.0, 0.0, 0.0, 0.0
    rates, rudders = [], []
    for step in range(int(secs / dt)):
        ordered = steering(step * dt, heading, rate)
        rudder += min(max(ordered - rudder, -0.04 * dt), 0.04 * dt)
        swell += dt * (-swell / 5) + waves * rng.normal(0, np.sqrt(dt))
        rate += dt * ((0.05 * rudder - rate) / 40 + swell)
        heading += dt * rate
        rates.append(rate + rng.normal(0, 1e-3))
        rudders.append(rudder + rng.normal(0, 1e-3))
    return TrialLog("t", (channel(np.array(rates)), channel(np.array(rudders), name="rudder")))


def rudder_sign_warning(log: TrialLog) -> str | None:
    """Return the text of the finding about the rudder's sign."""
    texts = [finding.text for finding in consistency_findings(log) if finding.kind == "sign"]
    return next((text for text in texts if text.startswith("/rudder")), None)


def with_reversed_rudder(log: TrialLog) -> TrialLog:
    turned = [replace(c, values=-c.values) if c.name == "rudder" else c for c in log]
    return replace(log, channels=tuple(turned))


def zigzag() -> Steering:
    side = 1.0

    def order(_: float, heading: float, __: float) -> float:
        nonlocal side
        if side * heading > np.radians(10):
            side = -side
        return side * np.radians(10)

    return order


def circle(time_secs: float, _: float, __: float) -> float:
    return 0.6 if 30 < time_secs < 400 else 0.0


def autopilot(_: float, heading: float, rate: float) -> float:
    return float(np.clip(-1.0 * heading - 10 * rate, -0.6, 0.6))


@pytest.mark.parametrize("seed", range(5))
def test_a_reversed_rudder_is_found_in_a_zigzag_and_the_right_one_is_not(seed: int) -> None:
    log = simulated_log(zigzag(), seed=seed, waves=1e-5)
    assert rudder_sign_warning(log) is None
    warning = rudder_sign_warning(with_reversed_rudder(log))
    assert warning is not None
    assert "/rudder/a: its sign is reversed, a positive rudder turns the bow to port" in warning
    assert "sign = -1" in warning
    assert "\n" not in warning


def test_a_reversed_rudder_is_found_in_a_turning_circle() -> None:
    log = simulated_log(circle)
    assert rudder_sign_warning(log) is None
    assert rudder_sign_warning(with_reversed_rudder(log)) is not None


@pytest.mark.parametrize("waves", [0.0, 1e-5, 1e-4])
@pytest.mark.parametrize("seed", range(10))
def test_a_straight_run_gives_no_warning_whichever_the_sign(seed: int, waves: float) -> None:
    log = simulated_log(lambda *_: 0.0, seed=seed, waves=waves)
    assert rudder_sign_warning(log) is None
    assert rudder_sign_warning(with_reversed_rudder(log)) is None


@pytest.mark.parametrize("waves", [1e-5, 1e-4, 3e-4])
@pytest.mark.parametrize("seed", range(10))
def test_an_autopilot_in_waves_gives_no_warning_where_the_sign_is_right(
    seed: int, waves: float
) -> None:
    assert rudder_sign_warning(simulated_log(autopilot, seed=seed, waves=waves)) is None


@pytest.mark.parametrize("seed", range(20))
def test_a_rudder_unrelated_to_the_turning_gives_no_warning(seed: int) -> None:
    log = simulated_log(lambda *_: 0.0, seed=seed, waves=1e-4)
    rng = np.random.default_rng(100 + seed)
    wander = np.cumsum(rng.normal(0, 0.005, 6000))
    assert (
        rudder_sign_warning(
            replace(log, channels=(log.channels[0], channel(wander, name="rudder")))
        )
        is None
    )


def test_gaps_and_missing_samples_do_not_hide_a_reversed_rudder() -> None:
    rate, rudder = with_reversed_rudder(simulated_log(zigzag())).channels
    values = rate.values.copy()
    values[1000:1300] = np.nan
    kept = np.r_[0:3000, 3300:6000]
    cut = replace(
        rudder,
        measured_ns=rudder.measured_ns[kept],
        received_ns=rudder.received_ns[kept],
        values=rudder.values[kept],
    )
    assert rudder_sign_warning(TrialLog("t", (replace(rate, values=values), cut))) is not None


def test_without_the_channels_or_their_samples_there_is_no_warning() -> None:
    rate, rudder = with_reversed_rudder(simulated_log(zigzag())).channels
    later = replace(rudder, measured_ns=rudder.measured_ns + 10**13)
    empty = channel(np.zeros(0), name="rudder")
    unmeasured = replace(rudder, values=np.full(len(rudder), np.nan))
    for channels in ((rate,), (rudder,), (rate, later), (rate, empty), (rate, unmeasured)):
        assert rudder_sign_warning(TrialLog("t", channels)) is None


def test_a_dead_speed_log_does_not_hide_a_reversed_rudder() -> None:
    log = with_reversed_rudder(simulated_log(zigzag()))
    for dead in (np.zeros(6000), np.full(6000, np.nan)):
        speed = channel(dead, name="speed")
        assert rudder_sign_warning(replace(log, channels=(*log.channels, speed))) is not None


RUNS = [pytest.param(path, id=path.stem) for path in sorted(KVLCC2.glob("*/*.dat"))] or [
    pytest.param(Path(), marks=pytest.mark.skip("the SIMMAN data are not in ../shared/data/kvlcc2"))
]


@pytest.mark.parametrize("path", RUNS)
def test_the_reversed_sign_of_every_kvlcc2_run_is_found(path: Path) -> None:
    layout = load_layout(LAYOUTS / f"simman_{path.parent.name}.toml")
    assert rudder_sign_warning(tanker_log(path)) is None
    as_printed = replace(layout.columns["rudder"], sign=1)
    reversed_layout = replace(layout, columns={**layout.columns, "rudder": as_printed})
    assert rudder_sign_warning(read_table(path, reversed_layout)) is not None

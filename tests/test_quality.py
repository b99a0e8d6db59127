"""What is wrong with data must be said; what is right must be passed over in silence."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shiplog.errors import LogError
from shiplog.foreign import read_table
from shiplog.layout import load_layout
from shiplog.quality import examine, rudder_sign_warning
from shiplog.types import Channel, TrialLog

KVLCC2 = Path(__file__).parents[2] / "shared" / "data" / "kvlcc2"
LAYOUTS = Path(__file__).parents[1] / "sample_data" / "layouts"
START = 1_700_000_000 * 10**9
RNG = np.random.default_rng(20)

Values = np.ndarray[tuple[int], np.dtype[np.float64]]


def channel(
    values: Values, times: Values | None = None, name: str = "yaw_rate", lag: float = 0.0
) -> Channel:
    """A channel of 10 Hz, or of the given times in seconds."""
    at = 0.1 * np.arange(len(values)) if times is None else times
    stamps = START + np.round(at * 1e9).astype(np.int64)
    return Channel(name, "a", "1", stamps, stamps + int(lag * 1e9), values)


def noise(count: int = 600, std: float = 0.01) -> Values:
    return RNG.normal(0, std, count)


def said(*channels: Channel) -> list[str]:
    log = TrialLog("trial.mcap", channels)
    return examine(log, tuple(c.name for c in channels))


def error(its: Channel) -> str:
    with pytest.raises(LogError) as caught:
        said(its)
    message = str(caught.value)
    assert "\n" not in message
    assert message.endswith(": trial.mcap")
    return message


def test_good_channels_are_passed_over() -> None:
    steady = np.full(600, 0.3)
    assert said(channel(noise()), channel(steady, name="rudder"), channel(steady, name="rpm")) == []


def test_only_what_is_asked_for_is_examined() -> None:
    bad = channel(noise(), name="speed", lag=-1.0)
    log = TrialLog("trial.mcap", (channel(noise()), bad))
    assert examine(log, ("yaw_rate",)) == []
    assert len(examine(log, ("speed/a",))) == 1


def test_a_missing_channel_is_an_error() -> None:
    with pytest.raises(LogError, match="no channel 'speed'"):
        examine(TrialLog("trial.mcap", (channel(noise()),)), ("speed",))


def test_gaps_are_counted_and_the_longest_is_placed() -> None:
    times = 0.1 * np.arange(600)
    times[200:] += 3
    times[400:] += 12
    assert said(channel(noise(), times)) == [
        "/yaw_rate/a: 2 gaps, the longest 12.1 s, 42.9 s after its start"
    ]


def test_equal_times_are_counted() -> None:
    times = 0.1 * np.arange(600)
    times[[10, 11]] = times[9]
    assert "/yaw_rate/a: 2 samples with the time of the one before" in said(channel(noise(), times))


def test_samples_not_measured_are_counted() -> None:
    values = noise()
    values[30:36] = np.nan
    assert said(channel(values)) == ["/yaw_rate/a: 6 samples (1 %) not measured (NaN)"]


def test_a_channel_without_samples_is_said_so() -> None:
    assert said(channel(np.zeros(0))) == ["/yaw_rate/a: no samples"]


def test_a_channel_of_nan_alone_is_no_stuck_one() -> None:
    assert said(channel(np.full(600, np.nan))) == [
        "/yaw_rate/a: 600 samples (1e+02 %) not measured (NaN)"
    ]


def test_a_value_that_stands_still_is_stuck() -> None:
    values = noise()
    values[100:300] = np.radians(0.5)
    assert said(channel(values)) == [
        "/yaw_rate/a: stuck once, longest at 0.5 deg/s for 19.9 s, 10.0 s after its start"
    ]


def test_a_commanded_channel_may_stand_still() -> None:
    values = noise()
    values[100:300] = 0.2
    assert said(channel(values, name="rudder"), channel(values, name="rpm")) == []


def test_a_short_standstill_or_a_channel_that_never_varies_is_not_called_stuck() -> None:
    values = noise()
    values[100:140] = 0.0
    assert said(channel(values), channel(np.zeros(600), name="speed")) == []


@pytest.mark.parametrize("digit", [0.001, 0.01, 0.05])
def test_a_coarse_print_at_the_crest_of_a_slow_wave_is_not_stuck(digit: float) -> None:
    times = np.arange(0, 900, 0.1)
    values = np.round(0.3 * np.sin(times / 30) / digit) * digit
    assert said(channel(values)) == []


def test_a_sensor_that_prints_coarsely_and_freezes_is_stuck() -> None:
    times = np.arange(0, 900, 0.1)
    values = np.round(0.3 * np.sin(times / 30) / 0.001) * 0.001
    values[4000:6000] = values[4000]
    assert "stuck once" in said(channel(values))[0]


def test_a_position_that_stands_still_is_stuck() -> None:
    stamps = START + 10**8 * np.arange(600)
    places = np.cumsum(RNG.normal(0.5, 0.1, (600, 2)), axis=0)
    places[100:300] = places[100]
    gps = Channel("position", "gps", "m", stamps, stamps, places, ("north", "east"))
    (fault,) = examine(TrialLog("trial.mcap", (gps,)), ("position",))
    assert fault.startswith("/position/gps: stuck once")


def test_impossible_values_are_told_in_the_unit_of_the_bridge() -> None:
    values = noise()
    values[5], values[6] = 2.0, -3.0
    assert said(channel(values)) == [
        (
            "/yaw_rate/a: 2 impossible values, such as -171.9 deg/s; "
            "between -57.3 deg/s and 57.3 deg/s is possible"
        )
    ]


def test_a_latitude_beyond_the_pole_is_impossible() -> None:
    stamps = START + 10**8 * np.arange(3)
    fixes = np.array([[59.0, 24, np.nan], [95, 24, np.nan], [59, 190, 1]])
    fields = ("latitude", "longitude", "altitude")
    gps = Channel("position", "gps", "deg", stamps, stamps, fixes, fields)
    assert examine(TrialLog("t", (gps,)), ("position",)) == [
        "/position/gps: 2 impossible positions, beyond 90 or 180 deg"
    ]


def test_an_irregular_rate_is_told_and_jitter_is_not() -> None:
    irregular = np.cumsum(np.where(np.arange(600) % 3, 0.1, 0.4))
    (fault,) = said(channel(noise(), irregular))
    assert fault.startswith("/yaw_rate/a: irregular: 33 % of its intervals")
    jitter = 0.1 * np.arange(600) + RNG.uniform(-0.02, 0.02, 600)
    assert said(channel(noise(), jitter)) == []


def test_what_was_received_before_it_was_measured_is_told() -> None:
    (fault,) = said(channel(noise(), lag=-0.25))
    assert "600 samples received before measured, by up to 0.25 s" in fault
    assert said(channel(noise(), lag=0.25)) == []


def test_an_infinite_value_is_an_error_with_place_and_remedy() -> None:
    values = noise()
    values[[50, 70]] = np.inf, -np.inf
    message = error(channel(values))
    assert "/yaw_rate/a has 2 infinite values, the first 5.000 s after its start" in message
    assert "make it nan" in message


def test_times_that_run_backwards_are_an_error_with_the_remedy() -> None:
    times = 0.1 * np.arange(600)
    times[[100, 200]] -= 0.35
    message = error(channel(noise(), times))
    assert "/yaw_rate/a run backwards 2 times, first by 0.250 s, 9.900 s after" in message
    assert "`shiplog convert IN.mcap OUT.mcap` sorts them" in message


# ---- the rudder's sign

Steering = Callable[[float, float, float], float]  # time, heading, yaw rate -> rudder, rad


def sailed(
    steering: Steering, *, secs: float = 600.0, seed: int = 0, waves: float = 0.0
) -> TrialLog:
    """A ship of first order, K = 0.05 1/s and T = 40 s, with noise and a disturbance."""
    rng = np.random.default_rng(seed)
    dt, heading, rate, rudder, swell = 0.1, 0.0, 0.0, 0.0, 0.0
    rates, rudders = [], []
    for step in range(int(secs / dt)):
        wanted = steering(step * dt, heading, rate)
        rudder += np.clip(wanted - rudder, -0.04 * dt, 0.04 * dt)
        swell += dt * (-swell / 5) + waves * rng.normal(0, np.sqrt(dt))
        rate += dt * ((0.05 * rudder - rate) / 40 + swell)
        heading += dt * rate
        rates.append(rate + rng.normal(0, 1e-3))
        rudders.append(rudder + rng.normal(0, 1e-3))
    return TrialLog("t", (channel(np.array(rates)), channel(np.array(rudders), name="rudder")))


def contrary(log: TrialLog) -> TrialLog:
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
def test_a_contrary_rudder_is_found_in_a_zigzag_and_the_right_one_is_not(seed: int) -> None:
    log = sailed(zigzag(), seed=seed, waves=1e-5)
    assert rudder_sign_warning(log) is None
    warning = rudder_sign_warning(contrary(log))
    assert warning is not None
    assert "/rudder/a: its sign is contrary, positive turns the bow to port" in warning
    assert "sign = -1" in warning
    assert "\n" not in warning


def test_a_contrary_rudder_is_found_in_a_turning_circle() -> None:
    log = sailed(circle)
    assert rudder_sign_warning(log) is None
    assert rudder_sign_warning(contrary(log)) is not None


@pytest.mark.parametrize("waves", [0.0, 1e-5, 1e-4])
@pytest.mark.parametrize("seed", range(10))
def test_a_straight_run_gives_no_warning_whichever_the_sign(seed: int, waves: float) -> None:
    log = sailed(lambda *_: 0.0, seed=seed, waves=waves)
    assert rudder_sign_warning(log) is None
    assert rudder_sign_warning(contrary(log)) is None


@pytest.mark.parametrize("waves", [1e-5, 1e-4, 3e-4])
@pytest.mark.parametrize("seed", range(10))
def test_an_autopilot_in_waves_gives_no_warning_where_the_sign_is_right(
    seed: int, waves: float
) -> None:
    assert rudder_sign_warning(sailed(autopilot, seed=seed, waves=waves)) is None


@pytest.mark.parametrize("seed", range(20))
def test_a_rudder_that_has_nothing_to_do_with_the_turning_gives_no_warning(seed: int) -> None:
    log = sailed(lambda *_: 0.0, seed=seed, waves=1e-4)
    rng = np.random.default_rng(100 + seed)
    wander = np.cumsum(rng.normal(0, 0.005, 6000))
    assert (
        rudder_sign_warning(
            replace(log, channels=(log.channels[0], channel(wander, name="rudder")))
        )
        is None
    )


def test_gaps_and_samples_not_measured_do_not_hide_a_contrary_rudder() -> None:
    rate, rudder = contrary(sailed(zigzag())).channels
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


def test_without_the_channels_or_their_samples_nothing_is_said() -> None:
    rate, rudder = contrary(sailed(zigzag())).channels
    later = replace(rudder, measured_ns=rudder.measured_ns + 10**13)
    empty = channel(np.zeros(0), name="rudder")
    unmeasured = replace(rudder, values=np.full(len(rudder), np.nan))
    for channels in ((rate,), (rudder,), (rate, later), (rate, empty), (rate, unmeasured)):
        assert rudder_sign_warning(TrialLog("t", channels)) is None


def test_a_speed_log_that_is_dead_does_not_hide_a_contrary_rudder() -> None:
    log = contrary(sailed(zigzag()))
    for dead in (np.zeros(6000), np.full(6000, np.nan)):
        speed = channel(dead, name="speed")
        assert rudder_sign_warning(replace(log, channels=(*log.channels, speed))) is not None


RUNS = [pytest.param(path, id=path.stem) for path in sorted(KVLCC2.glob("*/*.dat"))] or [
    pytest.param(Path(), marks=pytest.mark.skip("the SIMMAN data are not in ../shared/data/kvlcc2"))
]


@pytest.mark.parametrize("path", RUNS)
def test_the_contrary_sign_of_every_kvlcc2_run_is_found(path: Path) -> None:
    layout = load_layout(LAYOUTS / f"simman_{path.parent.name}.toml")
    assert rudder_sign_warning(read_table(path, layout)) is None
    as_printed = replace(layout.columns["rudder"], sign=1)
    contrary_layout = replace(layout, columns={**layout.columns, "rudder": as_printed})
    assert rudder_sign_warning(read_table(path, contrary_layout)) is not None

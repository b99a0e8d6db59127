import copy
import pickle
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise
from math import pi, radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from places import KVLCC2, PROJECT
from scipy.integrate import solve_ivp
from tanker_logs import tanker_log

from analysis.disturbance.loop import observe_chunk
from analysis.disturbance.observer import (
    DISTURBANCE_UNITS,
    Disturbance,
    ForceObserver,
    observe_disturbance,
)
from analysis.filters.noise_model import NoiseModel
from analysis.filters.tuning import noise_of
from analysis.replay.plan import plan_replay
from analysis.replay.replay import analyse
from analysis.signals.hold import InputHold, held_throughout
from analysis.signals.signal_stats import SignalStats, signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import Gust, WaveMoment
from shiplog import Signals, TrialLog, UsageError, Vessel, read, resample
from shiplog.resampling import resample_chunks
from shiplog.ships.paper import Coefficients
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.settings import DISTURBANCES, DisturbanceSettings

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
STEP = radians(2)
PARTS = ("yaw", "surge", "rudder", "yaw_wave", "surge_wave")
SUBSETS = [subset for size in (1, 2, 3) for subset in combinations(DISTURBANCES, size)]
OMEGA = 0.6  # rad/s


def observed(vessel: Vessel, manoeuvre: str, noise: str, gusts: tuple[Gust, ...], **settings):  # noqa: ANN003, ANN201
    sensors = suite(noise, {k.replace("__", "."): v for k, v in settings.items()})
    trial = simulate(vessel, manoeuvre, duration_secs=600.0, seed=5, sensors=sensors, gusts=gusts)
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    noise_model = noise_of(
        signal_stats(signals, vessel.coefficients), vessel.coefficients, vessel.filter
    )
    truth = trial.trajectory.at(signals.time_secs)["yaw_disturbance"]
    estimated, summaries = observe_disturbance(signals, vessel.coefficients, noise_model)
    return signals, estimated, summaries, truth


@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "turning-circle", "pseudo-random"])
@pytest.mark.parametrize("noise", ["white", "paper"])
def test_a_step_in_yaw_moment_is_found_within_5_percent(
    vessel: Vessel, manoeuvre: str, noise: str
) -> None:
    _, estimated, _, truth = observed(vessel, manoeuvre, noise, (Gust(STEP, 200.0),))
    settled = slice(4000, None)  # 200 s after its onset: four of the observer's periods
    assert np.mean(estimated.yaw[settled]) == pytest.approx(truth[-1], rel=0.05)
    assert np.max(np.abs(estimated.yaw[settled] / truth[-1] - 1)) < 0.15


def test_a_gust_comes_and_goes(vessel: Vessel) -> None:
    _, estimated, _, truth = observed(vessel, "zigzag-20-20", "white", (Gust(STEP, 150.0, 200.0),))
    size = truth.max()
    assert np.mean(estimated.yaw[3000:3490]) == pytest.approx(size, rel=0.05)
    assert np.mean(estimated.yaw[5000:]) == pytest.approx(0, abs=0.05 * size)


def test_without_a_disturbance_the_estimate_is_the_sensors_noise(vessel: Vessel) -> None:
    _, estimated, summaries, _ = observed(vessel, "zigzag-20-20", "white", ())
    assert np.std(estimated.yaw[1500:]) == pytest.approx(summaries["yaw"].noise_std, rel=0.4)
    assert np.std(estimated.surge[3000:]) == pytest.approx(summaries["surge"].noise_std, rel=0.6)


def test_a_slow_sensor_is_corrected_as_fast_as_a_quick_one(vessel: Vessel) -> None:
    _, estimated, _, truth = observed(
        vessel, "zigzag-20-20", "white", (Gust(STEP, 200.0),), yaw_rate__rate_hz=1.0
    )
    assert np.mean(estimated.yaw[320:]) == pytest.approx(truth[-1], rel=0.1)


def test_where_nothing_is_measured_the_disturbance_is_held(vessel: Vessel) -> None:
    signals, *_ = observed(vessel, "zigzag-20-20", "white", (Gust(STEP, 100.0),))
    values = dict(signals.values)
    values["yaw_rate"] = values["yaw_rate"].copy()
    values["yaw_rate"][4000:4300] = np.nan
    gapped: Signals = replace(signals, values=values)
    noise = noise_of(signal_stats(gapped, vessel.coefficients), vessel.coefficients, vessel.filter)
    estimated, _ = observe_disturbance(gapped, vessel.coefficients, noise)
    assert np.ptp(estimated.yaw[4000:4300]) == 0


def test_the_moment_is_converted_to_the_rudder_of_the_same_effect(vessel: Vessel) -> None:
    straight = (Gust(STEP, 100.0),)
    _, estimated, *_ = observed(vessel, "turning-circle-1", "white", straight)
    # at the approach speed two degrees, and little else while the ship goes nearly straight
    assert np.degrees(np.mean(estimated.rudder[2200:2600])) == pytest.approx(2.0, rel=0.08)


def test_a_force_is_found_in_surge(vessel: Vessel) -> None:
    c = vessel.coefficients
    trial = simulate(vessel, "zigzag-20-20", duration_secs=900.0, sensors=suite("white"))
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    noise = noise_of(signal_stats(signals, c), c, vessel.filter)
    # a model with 2 % more thrust estimates a force that holds the ship back by that much
    estimated, _ = observe_disturbance(signals, c._replace(h=1.02 * c.h), noise)
    assert np.mean(estimated.surge[6000:]) == pytest.approx(-0.02 * c.h * 80, rel=0.1)


# ---- ramps and waves


Push = Callable[[float], float]


def nothing(_t: float) -> float:
    return 0.0


@cache
def sailed(
    c: Coefficients,
    moment: Push = nothing,
    force: Push = nothing,
    *,
    secs: float = 600.0,
    dt: float = 0.1,
    stds: tuple[float, float] = (0.0, 0.0),
    rudder: float = radians(10),
) -> Signals:
    """Integrate the paper's model with scipy, with disturbances and an oscillating rudder."""

    def steering(t: float) -> tuple[float, float]:
        turn = 2 * pi / 120
        return rudder * np.sin(turn * t), rudder * turn * np.cos(turn * t)

    def motion(t: float, x: np.ndarray) -> list[float]:
        w, w_dot, v = x
        delta, delta_dot = steering(t)
        ks = c.alpha1 * v + c.alpha2 * 80.0 * np.exp(-c.alpha3 * v)
        hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w**3
        w_ddot = hull + ks * (c.d * delta + c.e * delta_dot) + moment(t)
        return [w_dot, w_ddot, c.f * w**2 + c.g * v**2 + c.h * 80.0 + force(t)]

    times = np.arange(round(secs / dt) + 1) * dt
    start = [0.0, 0.0, np.sqrt(-c.h * 80.0 / c.g)]
    x = solve_ivp(motion, (0, secs), start, "DOP853", times, max_step=2.0, rtol=1e-8, atol=1e-10).y
    rng = np.random.default_rng(7)
    values = {
        "yaw_rate": x[0] + stds[0] * rng.standard_normal(len(times)),
        "speed": x[2] + stds[1] * rng.standard_normal(len(times)),
        "rudder": steering(times)[0],
        "rpm": np.full(len(times), 80.0),
    }
    return Signals(0, dt, values)


def chosen_models(*models: str, **other: object) -> DisturbanceSettings:
    return DisturbanceSettings(models, **other)


def quiet(stds: tuple[float, float] = (1e-9, 1e-9)) -> NoiseModel:
    return NoiseModel(np.array(stds), np.ones(2))


def ramp_moment(start: float, slope: float) -> Push:
    return lambda t: slope * max(t - start, 0.0)


@pytest.mark.parametrize("spectrum", ["butterworth", "binomial"])
def test_a_ramp_is_found_and_a_constant_lags_behind_it(vessel: Vessel, spectrum: str) -> None:
    slope, pull = 2e-9, -2e-5
    push = ramp_moment(100.0, slope), ramp_moment(100.0, pull)
    signals = sailed(vessel.coefficients, *push, secs=900.0)
    last, noise = slice(8000, None), quiet()
    ramp, _ = observe_disturbance(
        signals, vessel.coefficients, noise, chosen_models("ramp", spectrum=spectrum)
    )
    constant, _ = observe_disturbance(
        signals, vessel.coefficients, noise, chosen_models("constant", spectrum=spectrum)
    )
    times = signals.time_secs[last] - 100.0
    assert ramp.yaw[last] == pytest.approx(slope * times, rel=0.01)
    assert ramp.surge[last] == pytest.approx(pull * times, rel=0.01)
    # of poles s1, s2, ... a constant lags by -1/s1 - 1/s2 - ..., the plant's own pole not counted
    lags = {"butterworth": (2 / 0.05, np.sqrt(2) / 0.02), "binomial": (3 / 0.05, 2 / 0.02)}
    yaw_lag, surge_lag = lags[spectrum]
    assert constant.yaw[last] == pytest.approx(slope * (times - yaw_lag), rel=0.01)
    assert constant.surge[last] == pytest.approx(pull * (times - surge_lag), rel=0.02)


def test_a_ramp_of_many_small_gusts_is_found_under_white_noise(vessel: Vessel) -> None:
    gusts = tuple(Gust(radians(0.02), 100.0 + k) for k in range(300))
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=600.0, sensors=suite("white"), gusts=gusts
    )
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    truth = trial.trajectory.at(signals.time_secs)["yaw_disturbance"]
    c = vessel.coefficients
    estimated, summaries = observe_disturbance(
        signals, c, noise_of(signal_stats(signals, c), c, vessel.filter), chosen_models("ramp")
    )
    up = slice(2800, 4000)
    assert np.std(estimated.yaw[up] - truth[up]) < 2 * summaries["yaw"].noise_std + 0.05 * truth[-1]
    assert np.mean(estimated.yaw[5800:]) == pytest.approx(truth[-1], rel=0.1)


WAVE = radians(0.15) * OMEGA**2  # rad/s^3: a yaw rate of 0.15 deg/s
SURGING = 0.05  # m/s^2


def wave(t: float) -> float:
    return WAVE * np.sin(OMEGA * t + 0.4)


def surging(t: float) -> float:
    return SURGING * np.sin(OMEGA * t - 1.0)


def phasor(values: np.ndarray, times: np.ndarray) -> tuple[complex, float]:
    """Amplitude and phase of what turns with the wave, and what is constant: by least squares."""
    shapes = np.column_stack((np.sin(OMEGA * times), np.cos(OMEGA * times), np.ones(len(times))))
    sine, cosine, constant = np.linalg.lstsq(shapes, values, rcond=None)[0]
    return complex(sine, cosine), float(constant)


@pytest.mark.parametrize("models", [s for s in SUBSETS if "wave" in s], ids="+".join)
def test_a_wave_is_found_in_amplitude_and_phase(vessel: Vessel, models: tuple[str, ...]) -> None:
    stds = radians(0.005), 0.02
    signals = sailed(vessel.coefficients, wave, surging, secs=1000.0, stds=stds)
    estimated, summaries = observe_disturbance(
        signals, vessel.coefficients, quiet(stds), chosen_models(*models), OMEGA
    )
    settled = slice(5000, None)
    times = signals.time_secs[settled]
    for seen, amplitude, phase, name in (
        (estimated.yaw_wave, WAVE, 0.4, "yaw_wave"),
        (estimated.surge_wave, SURGING, -1.0, "surge_wave"),
    ):
        turning, _ = phasor(seen[settled], times)
        assert abs(turning) == pytest.approx(amplitude, rel=0.03)
        assert np.angle(turning) == pytest.approx(phase, abs=0.03)
        residual = seen[settled] - amplitude * np.sin(OMEGA * times + phase)
        assert np.std(residual) < 0.03 * amplitude + 1.5 * summaries[name].noise_std
        assert summaries[name].amplitude == pytest.approx(amplitude, rel=0.03)
        assert summaries[name].unit == DISTURBANCE_UNITS[name][0]


def test_on_a_clock_of_one_second_a_wave_is_found_as_well(vessel: Vessel) -> None:
    signals = sailed(vessel.coefficients, wave, surging, secs=1000.0, dt=1.0)
    estimated, _ = observe_disturbance(
        signals, vessel.coefficients, quiet(), chosen_models("constant", "wave"), OMEGA
    )
    times = signals.time_secs[500:]
    yaw, surge = (
        phasor(seen[500:], times)[0] for seen in (estimated.yaw_wave, estimated.surge_wave)
    )
    assert (abs(yaw), abs(surge)) == pytest.approx((WAVE, SURGING), rel=0.04)
    assert (np.angle(yaw), np.angle(surge)) == pytest.approx((0.4, -1.0), abs=0.04)


@pytest.mark.parametrize("models", [("constant", "wave"), ("ramp", "wave")], ids="+".join)
def test_step_and_wave_are_separated(vessel: Vessel, models: tuple[str, ...]) -> None:
    step = 1e-6
    stds = radians(0.005), 0.02
    signals = sailed(
        vessel.coefficients, lambda t: step * (t >= 500) + wave(t), surging, secs=1000.0, stds=stds
    )
    estimated, summaries = observe_disturbance(
        signals, vessel.coefficients, quiet(stds), chosen_models(*models), OMEGA
    )
    before, after = slice(4500, 4990), slice(7000, None)
    assert np.max(np.abs(estimated.yaw[before])) < 0.1 * step
    assert np.mean(estimated.yaw[after]) == pytest.approx(step, rel=0.05)
    assert np.std(estimated.yaw[after]) < 2 * summaries["yaw"].noise_std
    assert np.mean(estimated.yaw_wave[after]) == pytest.approx(0, abs=0.01 * WAVE)
    # without a wave in the exosystem the wave appears in the moment itself
    alone, _ = observe_disturbance(signals, vessel.coefficients, quiet(stds))
    assert np.std(alone.yaw[after]) > 0.3 * step


def test_gust_and_wave_of_a_simulated_log_are_both_estimated(vessel: Vessel) -> None:
    c = vessel.coefficients
    trial = simulate(
        vessel,
        "zigzag-20-20",
        duration_secs=600.0,
        sensors=suite("paper"),
        gusts=(Gust(STEP, 200.0),),
        wave=WaveMoment(radians(300), 2 * pi / OMEGA),
    )
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    truth = trial.trajectory.at(signals.time_secs)["yaw_disturbance"]
    noise = noise_of(signal_stats(signals, c), c, vessel.filter)
    estimated, _ = observe_disturbance(signals, c, noise, chosen_models("constant", "wave"), OMEGA)
    settled = slice(4000, None)
    _, size = phasor(truth[settled], signals.time_secs[settled])
    assert np.mean(estimated.yaw[settled]) == pytest.approx(size, rel=0.05)
    rest = truth[settled] - size
    assert np.std(estimated.yaw_wave[settled] - rest) < 0.05 * np.std(rest)


def test_the_amplitude_is_found_within_a_minute(vessel: Vessel) -> None:
    signals = sailed(vessel.coefficients, lambda t: wave(t) * (t >= 100), stds=(radians(0.005), 0))
    estimated, _ = observe_disturbance(
        signals, vessel.coefficients, quiet(), chosen_models("constant", "wave"), OMEGA
    )
    period = round(2 * pi / OMEGA / 0.1)
    tops = [np.ptp(estimated.yaw_wave[k : k + period]) / 2 for k in range(1500, 5500, period)]
    assert tops == pytest.approx([WAVE] * len(tops), rel=0.1)


@pytest.mark.parametrize("models", SUBSETS, ids="+".join)
def test_the_error_due_to_noise_in_each_part_is_the_one_reported(
    vessel: Vessel, models: tuple[str, ...]
) -> None:
    # a ship that hardly turns is as linear as the observer assumes
    stds = radians(0.02), 0.1
    signals = sailed(vessel.coefficients, secs=4000.0, stds=stds, rudder=radians(0.1))
    estimated, summaries = observe_disturbance(
        signals, vessel.coefficients, quiet(stds), chosen_models(*models), OMEGA
    )
    for name, summary in summaries.items():
        seen = getattr(estimated, name)[6000:]
        if summary.noise_std == 0:
            assert not seen.any()
            assert "wave" in models
        else:
            assert np.std(seen) == pytest.approx(summary.noise_std, rel=0.35)
            if name.endswith("wave"):
                assert summary.amplitude < np.std(seen)  # noise has no wave


def test_the_std_of_a_wave_is_that_of_its_amplitude(vessel: Vessel) -> None:
    stds = radians(0.02), 0.1
    signals = sailed(vessel.coefficients, wave, secs=4000.0, stds=stds, rudder=radians(0.1))
    estimated, summaries = observe_disturbance(
        signals, vessel.coefficients, quiet(stds), chosen_models("constant", "wave"), OMEGA
    )
    period = round(2 * pi / OMEGA / 0.1)
    cut = estimated.yaw_wave[6000:]
    times = signals.time_secs[6000:]
    amplitudes = [
        abs(phasor(cut[k : k + period], times[k : k + period])[0])
        for k in range(0, len(cut) - period, period)
    ]
    assert np.mean(amplitudes) == pytest.approx(WAVE, rel=0.02)
    assert np.std(amplitudes) == pytest.approx(summaries["yaw_wave"].noise_std, rel=0.35)


def test_the_observer_does_not_diverge_in_waves_on_a_nonlinear_ship(vessel: Vessel) -> None:
    size = radians(0.15)  # of 1 rad/s: they begin at once, and the estimate swings out far
    signals = sailed(
        vessel.coefficients, lambda t: size * np.sin(t) * (t >= 100), rudder=radians(35)
    )
    estimated, _ = observe_disturbance(
        signals, vessel.coefficients, quiet(), chosen_models("ramp", "wave"), 1.0
    )
    assert np.std(estimated.yaw[4500:]) < 1e-6
    times = signals.time_secs[4500:]
    assert estimated.yaw_wave[4500:] == pytest.approx(size * np.sin(times), abs=0.03 * size)


def poles_at(c: Coefficients, observer: ForceObserver, w: float, every: int) -> np.ndarray:
    """Poles of yaw's error at a yaw rate, from differences of the loop itself, 1/s."""
    state, dt = observer._state, 0.1

    def after(x: np.ndarray) -> np.ndarray:
        start = state._replace(w=x[0], w_dot=x[1], moment=x[2:].copy())
        measured = np.full(every, np.nan)
        measured[0] = w
        still = np.zeros(every + 1)
        _, end = observe_chunk(
            c, observer._observer, start, measured, np.full(every, np.nan), still, still, dt
        )
        return np.array([end.w, end.w_dot, *end.moment])

    base = np.array([w, *np.zeros(1 + len(state.moment))])
    small = 1e-7
    columns = [
        (after(base + small * row) - after(base - small * row)) / (2 * small)
        for row in np.eye(len(base))
    ]
    return np.log(np.linalg.eigvals(np.column_stack(columns)).astype(complex)) / (every * dt)


@pytest.mark.parametrize("models", SUBSETS, ids="+".join)
@pytest.mark.parametrize("every", [1, 10])
def test_in_a_turn_the_poles_stay_where_they_were_placed(
    vessel: Vessel, models: tuple[str, ...], every: int
) -> None:
    c = vessel.coefficients
    signals = sailed(c, secs=300.0)
    values = dict(signals.values)
    values["yaw_rate"] = np.where(np.arange(len(signals)) % every, np.nan, values["yaw_rate"])
    stats = signal_stats(replace(signals, values=values), c)
    observer = ForceObserver(c, quiet(), stats, chosen_models(*models), OMEGA)
    as_designed = np.sort(poles_at(c, observer, stats.yaw_rate_rms, every).real)
    for turning in (0.0, 0.5, 1.0):
        estimated = np.sort(poles_at(c, observer, radians(turning), every).real)
        exact = "wave" in models
        slack = 0.003 if exact else 0.2 * every**0.5 * 0.05
        assert estimated == pytest.approx(as_designed, rel=0.06, abs=slack), turning


# ---- gaps


def gapped(signals: Signals, name: str, gap: slice) -> Signals:
    values = dict(signals.values)
    values[name] = values[name].copy()
    values[name][gap] = np.nan
    return replace(signals, values=values)


@pytest.mark.parametrize(
    ("part", "sensor", "memory"), [("yaw", "yaw_rate", 20.0), ("surge", "speed", 50.0)]
)
def test_a_ramp_continues_for_the_observers_memory_and_is_then_held(
    vessel: Vessel, part: str, sensor: str, memory: float
) -> None:
    push = ramp_moment(50.0, 2e-9), ramp_moment(50.0, 2e-5)
    signals = gapped(sailed(vessel.coefficients, *push), sensor, slice(4000, 5000))
    estimated, _ = observe_disturbance(signals, vessel.coefficients, quiet(), chosen_models("ramp"))
    seen = getattr(estimated, part)[3999:5000]
    steps, last = np.diff(seen), round(memory / 0.1)
    assert steps[:last] == pytest.approx(np.full(last, steps[0]), rel=1e-6)
    assert steps[0] > 0
    assert not steps[last + 1 :].any()


@pytest.mark.parametrize(
    "models", [("wave",), ("constant", "wave"), ("ramp", "wave")], ids="+".join
)
def test_without_samples_a_wave_continues(vessel: Vessel, models: tuple[str, ...]) -> None:
    signals = gapped(sailed(vessel.coefficients, wave, surging), "yaw_rate", slice(4000, 5000))
    estimated, _ = observe_disturbance(
        signals, vessel.coefficients, quiet(), chosen_models(*models), OMEGA
    )
    times, seen = signals.time_secs[4000:5000], estimated.yaw_wave[4000:5000]
    turning, _ = phasor(seen, times)
    assert abs(turning) == pytest.approx(WAVE, rel=0.02)
    again = turning.real * np.sin(OMEGA * times) + turning.imag * np.cos(OMEGA * times)
    assert seen == pytest.approx(again, abs=1e-9 * WAVE)


# ---- chunks


@pytest.fixture(scope="module")
def broken(vessel: Vessel) -> Signals:
    """A trial with gaps, single samples lost and a slower speed log."""
    signals = sailed(vessel.coefficients, wave, surging, secs=300.0, stds=(1e-4, 0.05))
    values = {name: array.copy() for name, array in signals.values.items()}
    rng = np.random.default_rng(3)
    values["yaw_rate"][rng.random(len(signals)) < 0.1] = np.nan
    values["yaw_rate"][1000:1400] = np.nan
    values["speed"][np.arange(len(signals)) % 5 > 0] = np.nan
    values["speed"][1900:2700] = np.nan
    return replace(signals, values=values)


def in_chunks(
    signals: Signals, cuts: list[int], make: Callable[[], ForceObserver]
) -> tuple[dict[str, np.ndarray], dict]:
    observer, edges, estimated = make(), [0, *sorted(cuts), len(signals)], []
    for start, stop in pairwise(edges):
        if stop > start:
            after = min(stop, len(signals) - 1)
            following = {name: float(signals[name][after]) for name in ("rudder", "rpm")}
            estimated.append(observer.step(signals.part(start, stop), following))
    arrays = {
        part: np.concatenate([getattr(chunk, part) for chunk in estimated])
        for part in PARTS
        if getattr(estimated[0], part) is not None
    }
    return arrays, observer.result()


@pytest.mark.parametrize("models", SUBSETS, ids="+".join)
@settings(derandomize=True, max_examples=15, deadline=None)
@given(cuts=st.lists(st.integers(0, 3000), max_size=12))
def test_where_a_log_is_cut_does_not_change_a_bit(
    vessel: Vessel, broken: Signals, models: tuple[str, ...], cuts: list[int]
) -> None:
    stats = signal_stats(broken, vessel.coefficients)

    def make() -> ForceObserver:
        return ForceObserver(vessel.coefficients, quiet(), stats, chosen_models(*models), OMEGA)

    (whole, summaries), (parts, part_summaries) = (
        in_chunks(broken, [], make),
        in_chunks(broken, cuts, make),
    )
    assert whole.keys() == parts.keys()
    for part, values in whole.items():
        assert values.tobytes() == parts[part].tobytes()
    assert summaries == part_summaries


# ---- settings


@pytest.mark.parametrize("models", SUBSETS, ids="+".join)
def test_only_the_disturbances_requested_are_estimated(
    vessel: Vessel, models: tuple[str, ...]
) -> None:
    signals = sailed(vessel.coefficients, wave, surging, secs=100.0)
    estimated, summaries = observe_disturbance(
        signals, vessel.coefficients, quiet(), chosen_models(*models), OMEGA
    )
    waves = "wave" in models
    assert (estimated.yaw_wave is not None) == (estimated.surge_wave is not None) == waves
    assert list(summaries) == ["yaw", "rudder", "surge", *(["yaw_wave", "surge_wave"] * waves)]
    slow = models != ("wave",)
    assert estimated.yaw.any() == estimated.surge.any() == estimated.rudder.any() == slow
    if not slow:
        assert (
            summaries["yaw"].noise_std
            == summaries["rudder"].noise_std
            == summaries["surge"].noise_std
            == 0
        )


def test_the_union_of_the_models_is_observed(vessel: Vessel) -> None:
    signals = sailed(vessel.coefficients, wave, secs=100.0)

    def seen(*models: str) -> Disturbance:
        return observe_disturbance(
            signals, vessel.coefficients, quiet(), chosen_models(*models), OMEGA
        )[0]

    assert np.array_equal(seen("ramp").yaw, seen("constant", "ramp").yaw)
    assert np.array_equal(seen("ramp", "wave").yaw_wave, seen(*DISTURBANCES).yaw_wave)
    assert np.array_equal(seen("constant", "constant").yaw, seen("constant").yaw)


def test_the_frequency_is_ignored_without_a_wave(vessel: Vessel) -> None:
    signals = sailed(vessel.coefficients, secs=100.0)
    estimated, _ = observe_disturbance(
        signals, vessel.coefficients, quiet(), chosen_models("constant"), 1e9
    )
    assert estimated.yaw_wave is None


def test_an_observer_that_diverges_returns_nan(vessel: Vessel) -> None:
    signals = sailed(vessel.coefficients, secs=300.0)
    c = vessel.coefficients._replace(h=-10 * vessel.coefficients.h)  # backwards, hard
    estimated, summaries = observe_disturbance(
        signals, c, quiet(), chosen_models("constant", yaw_frequency=1e-4, surge_frequency=1e-4)
    )
    assert np.isnan(estimated.surge[-1])
    assert np.nanmax(np.abs(estimated.surge)) < 1e6
    assert np.isfinite(summaries["surge"].rms)


def slowly(stats: SignalStats, interval: float) -> SignalStats:
    return replace(stats, intervals=np.array([1.0, interval]) / stats.dt_secs)


@pytest.mark.parametrize(
    ("change", "frequency", "message"),
    [
        ({"models": ()}, None, r"disturbance.models must be a list of some of constant, ramp, wa"),
        ({"models": ("tide",)}, None, r"disturbance.models must be .* got \('tide',\)"),
        ({"spectrum": "bessel"}, None, "disturbance.spectrum must be one of butterworth, binomial"),
        ({"yaw_frequency": -1.0}, None, "disturbance.yaw_frequency must be positive, got -1"),
        ({"surge_frequency": np.nan}, None, "disturbance.surge_frequency must be finite, got nan"),
        ({"models": ("wave",)}, None, "a wave without a frequency; set disturbance.wave_frequency"),
        ({"models": ("wave",)}, 0.0, "disturbance.wave_frequency must be positive, got 0"),
        ({"models": ("wave",)}, np.inf, "disturbance.wave_frequency must be finite, got inf"),
        ({"models": ("wave",)}, "0.6", "disturbance.wave_frequency must be a number, got '0.6'"),
        (
            {"models": ("wave",)},
            3.0,
            "yaw every 1 s are too slow for a wave of 3 rad/s; lower disturbance.wave_frequency",
        ),
        (
            {"models": ("ramp", "wave")},
            0.05,
            "yaw a wave of 0.05 .* at 0.05 rad/s; lower disturbance.yaw_frequency, raise",
        ),
        (
            {"models": ("constant", "wave"), "surge_frequency": 0.7},
            0.6,
            "in surge a wave of 0.6 .* followed at 0.7 rad/s; lower disturbance.surge_frequency",
        ),
        (
            {"surge_frequency": 8.0},
            None,
            "surge_frequency of 8 rad/s is too high for samples every 2 s; lower it below 5",
        ),
        (
            {"yaw_frequency": 1e-9},
            None,
            "disturbance.yaw_frequency must lie between 1e-06 and 1000, got 1e-09",
        ),
    ],
)
def test_what_cannot_be_estimated_is_rejected_in_one_line(
    vessel: Vessel, change: dict, frequency: float | None, message: str
) -> None:
    stats = slowly(signal_stats(sailed(vessel.coefficients, secs=60.0), vessel.coefficients), 2.0)
    with pytest.raises(UsageError, match=message) as raised:
        ForceObserver(vessel.coefficients, quiet(), stats, DisturbanceSettings(**change), frequency)
    assert "\n" not in str(raised.value)


def test_a_model_that_is_not_finite_is_rejected(vessel: Vessel) -> None:
    stats = signal_stats(sailed(vessel.coefficients, secs=60.0), vessel.coefficients)
    with pytest.raises(UsageError, match="NaN or infinities"):
        ForceObserver(vessel.coefficients._replace(a=np.nan), quiet(), stats)


# ---- real logs


SAMPLES = PROJECT / "sample_data"
SAMPLE_LOGS = [p for p in sorted(SAMPLES.glob("*.mcap")) if p.name.count(".") == 1]


@pytest.mark.parametrize(
    "path", [*SAMPLE_LOGS, *sorted(KVLCC2.glob("*/*.dat"))], ids=lambda path: path.stem
)
def test_every_log_is_observed_by_every_model(path: Path) -> None:
    log = tanker_log(path) if path.suffix == ".dat" else read(path)
    plan = plan_replay(log)
    holding = InputHold(plan.clock)
    for chunk in log.chunks():
        holding.add_raw(chunk)
    chunks = list(held_throughout(resample_chunks(log.chunks(), plan.clock), holding))
    for models in SUBSETS:
        for spectrum in ("butterworth", "binomial"):
            observer = ForceObserver(
                plan.vessel.coefficients,
                plan.noise,
                plan.stats,
                chosen_models(*models, spectrum=spectrum),
                OMEGA if "wave" in models else None,
            )
            for _, held, following in chunks:
                estimated = observer.step(held, following)
                for part in ("yaw", "surge", "yaw_wave", "surge_wave"):
                    if getattr(estimated, part) is not None:
                        assert np.isfinite(getattr(estimated, part)).all(), (models, spectrum, part)
            for summary in observer.result().values():
                assert np.isfinite(
                    [summary.mean, summary.rms, summary.at_end, summary.noise_std]
                ).all()


def test_a_wave_too_fast_for_one_sensor_is_estimated_in_the_other_alone(vessel: Vessel) -> None:
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=300.0, sensors=suite("white", {"speed.rate_hz": 0.2})
    )
    log = TrialLog("trial", trial.channels, vessel_toml=PRESETS["table1"])
    estimated = analyse(log, settings={"disturbance.models": ["constant", "wave"]})
    assert estimated.disturbance.yaw_wave is not None
    assert estimated.disturbance.surge_wave is None
    assert "surge_wave" not in estimated.findings.disturbances
    assert any("no wave is estimated in surge" in text for text in estimated.findings.warnings)


def test_summaries_survive_pickling_and_deepcopy(vessel: Vessel) -> None:
    signals = sailed(vessel.coefficients, wave, secs=100.0)
    chosen = chosen_models("constant", "wave")
    _, summaries = observe_disturbance(signals, vessel.coefficients, quiet(), chosen, OMEGA)
    pickled = pickle.loads(pickle.dumps(summaries))  # noqa: S301 - our own bytes
    assert pickled == summaries
    assert copy.deepcopy(summaries) == summaries

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from filter_runs import (
    FILTERS,
    disturbed,
    estimates_of,
    five_states,
    signals_of,
    straight,
    three_states,
)

from analysis.filters.factory import filter_states, make_filter
from analysis.filters.noise_model import ForceNoise, FurtherModel, NoiseModel
from analysis.filters.tuning import PAPER_RATIO, golden_section, noise_of
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.trajectory import Gust
from shiplog import Signals, TrialLog, Vessel, resample
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
STDS = np.array([1e-4, 0.1])
LIKELIEST = ("pseudo-input", "extended")
RATIO = 1e-3


@pytest.fixture(scope="module")
def signals(zigzag: SimulatedTrial) -> Signals:
    return resample(TrialLog("trial", zigzag.channels), channels=NAMES)


def noise_from_log(signals: Signals, c: Coefficients, **settings: object) -> NoiseModel:
    return noise_of(signal_stats(signals, c), c, FilterSettings(**settings))


@pytest.mark.parametrize("kind", FILTERS)
def test_what_the_vessel_file_states_is_taken(signals: Signals, vessel: Vessel, kind: str) -> None:
    noise = noise_from_log(
        signals,
        vessel.coefficients,
        kind=kind,
        process_ratio=RATIO,
        yaw_rate_std=1e-4,
        speed_std=0.2,
    )
    assert noise.measurement_std == pytest.approx([1e-4, 0.2])
    expected = [RATIO, RATIO] if kind == "pseudo-input" else [RATIO**2, RATIO]
    np.testing.assert_allclose(noise.process_ratio, expected, rtol=1e-12)
    assert noise.measured == (False, False)
    assert noise.tuned == (False, False)
    assert noise.wave is None


@pytest.mark.parametrize("kind", FILTERS[1:])
def test_a_bandwidth_is_the_fourth_root_of_yaws_ratio_and_the_square_root_of_surges(
    signals: Signals, vessel: Vessel, kind: str
) -> None:
    c = vessel.coefficients
    noise = noise_from_log(signals, c, kind=kind, yaw_bandwidth=0.3, surge_bandwidth=0.05)
    np.testing.assert_allclose(noise.process_ratio, [0.3**4, 0.05**2], rtol=1e-12)
    assert noise.tuned == (False, False)
    noise = noise_from_log(signals, c, kind=kind, yaw_bandwidth=0.3, process_ratio=RATIO)
    np.testing.assert_allclose(noise.process_ratio, [0.3**4, RATIO], rtol=1e-12)


def test_the_papers_filter_has_a_ratio_and_no_bandwidths(signals: Signals, vessel: Vessel) -> None:
    given = {"process_ratio": RATIO, "yaw_bandwidth": 0.3, "surge_bandwidth": 0.05}
    noise = noise_from_log(signals, vessel.coefficients, kind="pseudo-input", **given)
    np.testing.assert_allclose(noise.process_ratio, [RATIO, RATIO], rtol=1e-12)


@pytest.mark.parametrize("output", [0, 1])
def test_what_one_output_lacks_the_log_tells_and_the_others_is_kept(
    signals: Signals, vessel: Vessel, output: int
) -> None:
    c = vessel.coefficients
    given = (
        {"surge_bandwidth": 0.2, "speed_std": 0.2},
        {"yaw_bandwidth": 0.2, "yaw_rate_std": 1e-4},
    )
    noise = noise_from_log(signals, c, kind="extended", **given[output])
    assert noise.tuned == noise.measured == (output == 0, output == 1)
    assert noise.process_ratio[1 - output] == pytest.approx((0.2**4, 0.2**2)[1 - output])
    assert noise.measurement_std[1 - output] == (1e-4, 0.2)[1 - output]
    assert noise.measurement_std[output] == signal_stats(signals, c).noise_std[output]


def unlikelihood(
    stats: SignalStats, c: Coefficients, noise: NoiseModel, kind: str, output: int, ratio: float
) -> float:
    """-2 log of the likelihood of one output's innovations, for a ratio of that output."""
    ratios = noise.process_ratio.copy()
    ratios[output] = ratio
    tuned = replace(noise, process_ratio=ratios)
    filtering = make_filter(c, tuned, stats, FilterSettings(kind=kind))
    result = filtering.step(stats.head, last_inputs(stats.head))
    e, s = result.innovations[:, output], result.innovation_stds[:, output]
    known = np.isfinite(e)
    return float(np.sum((e[known] / s[known]) ** 2 + np.log(2 * np.pi * s[known] ** 2)))


@pytest.mark.parametrize("kind", LIKELIEST)
def test_what_nobody_states_makes_the_innovations_likeliest(
    signals: Signals, vessel: Vessel, kind: str
) -> None:
    """Against every ratio of a grid of three to the decade, and the ratio's neighbours."""
    c = vessel.coefficients
    stats = signal_stats(signals, c)
    noise = noise_of(stats, c, FilterSettings(kind=kind))
    assert noise.tuned == noise.measured == (True, True)
    # the yaw's ratio was found while the surge's was still the least
    for output, others in ((0, replace(noise, process_ratio=np.full(2, PAPER_RATIO))), (1, noise)):
        power = 2 if kind == "extended" and output == 0 else 1
        grid = 10.0 ** (power * np.arange(np.log10(PAPER_RATIO), 8.0, 1 / 3))
        near = noise.process_ratio[output] * np.array([0.8, 1.25])
        tried = [*grid, *near[near > grid[0]]]
        score = [unlikelihood(stats, c, others, kind, output, ratio) for ratio in tried]
        result = unlikelihood(stats, c, others, kind, output, noise.process_ratio[output])
        assert result < min(score) + 0.5  # the search ends within a twentieth of the ratio


@pytest.mark.parametrize("kind", LIKELIEST)
@pytest.mark.parametrize("seed", range(2))
def test_a_ratio_that_a_run_was_drawn_with_is_found_again(
    vessel: Vessel, kind: str, seed: int
) -> None:
    c, dt, count = straight(vessel.coefficients), 0.5, 4000
    first, inputs = np.array([1e-3, 0.0, 8.0]), np.tile([0.0, 80.0], (count, 1))
    still = signals_of(np.tile(first[[0, 2]], (count, 1)), *inputs.T, dt)
    stats = replace(signal_stats(still, c), std=np.array([1e-3, 0.5]))
    noise = NoiseModel(STDS, np.array([1e-3 if kind == "pseudo-input" else 1e-4, 1e-2]))
    path = disturbed(c, first[None], inputs, dt, np.zeros((1, count, 3)))[0]
    if kind == "pseudo-input":
        run = replace(
            five_states(c, noise, stats, *inputs[:1].T), mean=estimates_of(c, path, *inputs.T, dt)
        )
    else:
        run = replace(three_states(c, noise, stats, *inputs[:1].T), mean=path)
    _, measured = run.drawn(np.random.default_rng(seed))
    settings = FilterSettings(kind=kind, yaw_rate_std=STDS[0], speed_std=STDS[1])
    result = noise_of(signal_stats(signals_of(measured, *inputs.T, dt), c), c, settings)
    log_error = np.log10(result.process_ratio / noise.process_ratio)
    assert log_error == pytest.approx([0.0, 0.0], abs=0.15)


@pytest.mark.parametrize("kind", FILTERS[1:4])
def test_where_the_gain_is_not_the_best_the_noise_is_the_extended_filters(
    signals: Signals, vessel: Vessel, kind: str
) -> None:
    head = signals.part(0, 1500)
    result = noise_from_log(head, vessel.coefficients, kind=kind)
    expected = noise_from_log(head, vessel.coefficients, kind="extended")
    assert np.array_equal(result.process_ratio, expected.process_ratio)
    assert np.array_equal(result.measurement_std, expected.measurement_std)


@pytest.mark.parametrize("kind", LIKELIEST)
def test_a_wrong_model_is_given_more_process_noise_than_the_true_one(
    signals: Signals, vessel: Vessel, kind: str
) -> None:
    c = vessel.coefficients
    wrong = c._replace(d=0.7 * c.d, a=0.7 * c.a)
    ratios = [noise_from_log(signals, model, kind=kind).process_ratio[0] for model in (c, wrong)]
    if kind == "pseudo-input":
        assert ratios[0] < 3 * PAPER_RATIO
        assert ratios[1] > 10 * ratios[0]
    else:  # fourth powers of a bandwidth; the true model's is slower than the ship
        assert ratios[0] ** 0.25 < abs(c.a)
        assert ratios[1] > 10**2 * ratios[0]


@pytest.mark.parametrize("kind", LIKELIEST)
def test_spikes_make_no_process_noise(signals: Signals, vessel: Vessel, kind: str) -> None:
    rng, c = np.random.default_rng(3), vessel.coefficients
    values = {name: array.copy() for name, array in signals.values.items()}
    for name, std in zip(("yaw_rate", "speed"), signal_stats(signals, c).noise_std, strict=True):
        values[name][rng.choice(len(signals), 25)] += 40 * std
    clean, spiked = (
        noise_from_log(s, c, kind=kind) for s in (signals, replace(signals, values=values))
    )
    assert np.all(spiked.process_ratio < 3 * clean.process_ratio)
    estimates = filter_states(replace(signals, values=values), c, spiked, FilterSettings(kind=kind))
    assert estimates.rejected.sum(axis=0).tolist() == pytest.approx([25, 25], abs=3)


def waved(signals: Signals, std: float) -> Signals:
    """A swell of the gyro's, that comes and goes."""
    t = signals.time_secs
    wave = std * np.sqrt(2) * np.sin(0.6 * t + 0.5 * np.sin(0.05 * t)) * (1 + 0.3 * np.sin(t / 30))
    values = dict(signals.values) | {"yaw_rate": signals["yaw_rate"] + wave}
    return replace(signals, values=values)


def test_a_wave_is_reported_where_it_is_asked_for_and_stands_out(
    signals: Signals, vessel: Vessel
) -> None:
    c = vessel.coefficients
    rough, given = waved(signals, 5e-4), {"kind": "extended", "process_ratio": RATIO}
    assert noise_from_log(rough, c, **given).wave is None
    assert noise_from_log(signals, c, **given, wave=True).wave is None
    wave = noise_from_log(rough, c, **given, wave=True).wave
    assert wave is not None
    assert wave.frequency == pytest.approx(0.6, rel=0.05)
    assert wave.std == pytest.approx(5e-4, rel=0.25)


def test_a_wave_that_is_stated_is_reported_as_stated(signals: Signals, vessel: Vessel) -> None:
    given = {"wave_frequency": 0.7, "wave_damping": 0.2, "wave_std": 1e-5}
    noise = noise_from_log(
        signals, vessel.coefficients, kind="extended", process_ratio=RATIO, wave=True, **given
    )
    assert noise.wave is not None
    result = noise.wave.frequency, noise.wave.damping, noise.wave.std
    assert result == pytest.approx((0.7, 0.2, 1e-5))


def test_with_its_wave_stated_a_log_takes_less_process_noise(
    signals: Signals, vessel: Vessel
) -> None:
    """A filter that must follow the waves follows the sensor's noise, too."""
    rough, c = waved(signals, 5e-4), vessel.coefficients
    plain, knowing = (
        noise_from_log(rough, c, kind="extended", surge_bandwidth=0.05, wave=wave)
        for wave in (False, True)
    )
    assert knowing.wave is not None
    assert knowing.process_ratio[0] < 0.01 * plain.process_ratio[0]


@pytest.mark.parametrize("minimum", [-2.0, -0.99, -0.7, -0.31, -0.02, 0.5])
def test_a_minimum_is_found_within_the_tolerance_and_a_bound_exactly(minimum: float) -> None:
    tried = []

    def function(at: float) -> float:
        tried.append(at)
        return abs(at - minimum) ** 1.5

    found = golden_section(function, (-1.0, 0.0), 0.05)
    assert found == pytest.approx(np.clip(minimum, -1.0, 0.0), abs=0.05)
    if not -0.95 < minimum < -0.05:
        assert found in (-1.0, 0.0)
    assert len(tried) == 7  # 0.618⁵ < 2 · 0.05, and two to begin with


SLOW = FurtherModel(yaw=ForceNoise(0, 0.05), surge=ForceNoise(0, 0.02))


def slow_forces(
    vessel: Vessel,
    seed: int,
    rudder_deg: float,
    further: FurtherModel = SLOW,
    *,
    later: int = 0,
    **settings: object,
) -> FurtherModel:
    """The moment and the force estimated in a zig-zag with a step of the yaw moment.

    The trial is longer than what is used of it by `later` instants.
    """
    gusts = (Gust(radians(rudder_deg), 60.0),) if rudder_deg else ()
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=200.0, seed=seed, sensors=suite("white"), gusts=gusts
    )
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    stats = signal_stats(signals, vessel.coefficients)
    stats = replace(stats, count=stats.count + later)
    chosen = FilterSettings(kind="extended", **settings)
    return noise_of(stats, vessel.coefficients, chosen, further=further).further


@pytest.mark.parametrize("seed", range(3))
def test_a_log_without_a_disturbance_has_no_slow_part(vessel: Vessel, seed: int) -> None:
    further = slow_forces(vessel, seed, 0.0, process_ratio=2.5e-5)
    for force in (further.yaw, further.surge):
        assert force is not None
        assert force.degree is None
        assert force.reduction > 0


@pytest.mark.parametrize("seed", range(3))
def test_a_small_step_of_the_yaw_moment_is_a_slow_part(vessel: Vessel, seed: int) -> None:
    further = slow_forces(vessel, seed, 0.1, process_ratio=2.5e-5)
    assert (further.yaw.degree, further.yaw.reduction) == (0, 0.0)
    assert further.surge.degree is None


def test_beside_process_noise_that_was_estimated_the_slow_part_stays(vessel: Vessel) -> None:
    further = slow_forces(vessel, 0, 0.0, surge_bandwidth=5e-3)
    assert further.yaw.degree == 0
    assert further.surge.degree is None


def test_beside_a_wave_of_the_same_force_the_slow_part_stays(vessel: Vessel) -> None:
    waved = replace(SLOW, yaw=ForceNoise(0, 0.05, wave=0.6))
    further = slow_forces(vessel, 0, 0.0, waved, process_ratio=2.5e-5)
    assert (further.yaw.degree, further.yaw.wave) == (0, 0.6)
    assert further.surge.degree is None


def test_a_trial_longer_than_what_the_noise_is_estimated_from_keeps_its_slow_parts(
    vessel: Vessel,
) -> None:
    further = slow_forces(vessel, 0, 0.0, later=1, process_ratio=2.5e-5)
    assert further.yaw.degree == further.surge.degree == 0

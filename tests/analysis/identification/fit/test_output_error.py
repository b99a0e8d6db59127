"""Output error: the true parameters are estimated, with correct uncertainty."""

from functools import cache
from math import radians

import numpy as np
import pytest
from trial_logs import as_log

from analysis.identification.fit.nuisance import Nuisance
from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.residual_noise import OutputResiduals, fit_residual_noise
from analysis.identification.fit.segment import Segment, split_into_segments
from analysis.identification.fit.swell import swell_frequency
from analysis.identification.fit.uncertainty import uncertainty
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import LogError, Signals, UsageError, load_vessel, resample
from shiplog.ships import ship_model

VESSEL = load_vessel("table1")[0]
TRUTH = VESSEL.coefficients._asdict() | {"T3": 0.5}
CHANNELS = ("yaw_rate", "speed", "rudder", "rpm")


@cache
def simulated(
    manoeuvre: str = "zigzag-20-20", seed: int = 0, noise: str = "paper", seconds: float = 500.0
) -> Signals:
    trial = simulate(VESSEL, manoeuvre, duration_secs=seconds, seed=seed, sensors=suite(noise))
    return resample(as_log(trial), channels=CHANNELS)


def a_trial(*args: object, **settings: object) -> Segment:
    name = f"{args}{settings}.mcap"  # segments of one name belong to one run
    return split_into_segments(simulated(*args, **settings), name)[0]  # type: ignore[arg-type]


@cache
def free_fit(seed: int) -> OutputError:
    return output_error([a_trial(seed=seed)], ship_model("burylin"))


def errors(fit: OutputError) -> dict[str, float]:
    """Return the errors of the free parameters, % of their true values."""
    estimates = dict(zip(fit.problem.model.names, fit.parameters, strict=True))
    return {name: 100 * abs(estimates[name] / TRUTH[name] - 1) for name in fit.problem.free_names}


# ---- estimates


@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "turning-circle-35", "pseudo-random"])
def test_noise_free_data_give_the_true_parameters_from_any_start(manoeuvre: str) -> None:
    fit = output_error([a_trial(manoeuvre, noise="none")], ship_model("burylin"))
    assert max(errors(fit).values()) < 1e-2
    assert fit.minimum.converged


def test_tied_fits_of_zigzags_reach_the_required_accuracy() -> None:
    model, seeds = ship_model("burylin-tied"), range(5)
    rng = np.random.default_rng(3)
    wrong = [{n: TRUTH[n] * rng.choice([0.5, 1.5]) for n in model.names[:8]} for _ in seeds]
    for starts in ([None] * 5, [{n: v for n, v in o.items() if n != "T3"} for o in wrong]):
        fit_errors = [
            errors(output_error([a_trial(seed=s)], model, fixed={"T3": 0.5}, start=start))
            for s, start in zip(seeds, starts, strict=True)
        ]
        median = {name: np.median([f[name] for f in fit_errors]) for name in fit_errors[0]}
        assert max(median[name] for name in ("a", "d")) <= 0.1
        assert max(median[name] for name in ("b2", "b3")) <= 0.5
        assert max(median[name] for name in ("f", "g", "h")) <= 1.5


def test_free_fits_reach_the_cramer_rao_bound_and_their_intervals_hold_the_truth() -> None:
    fits = [free_fit(seed) for seed in range(8)]
    estimates = [uncertainty(fit) for fit in fits]
    truth = np.array([TRUTH[name] for name in estimates[0].names])
    error = np.array([u.values - truth for u in estimates])
    bound = np.median([u.bound for u in estimates], axis=0)
    ratios = np.sqrt(np.mean(error**2, axis=0)) / bound
    assert np.sqrt(np.mean(ratios**2)) < 1.2
    assert ratios.max() < 1.8  # the largest of nine, over eight seeds
    inside = [(u.interval[:, 0] < truth) & (truth < u.interval[:, 1]) for u in estimates]
    assert 0.88 < np.mean(inside) <= 1.0


def test_each_segment_has_its_own_rudder_offset_and_gyro_bias() -> None:
    offsets, biases = (radians(0.4), radians(-0.3)), (radians(0.003), radians(-0.002))
    segments = []
    for seed, (offset, bias) in enumerate(zip(offsets, biases, strict=True)):
        s = simulated(seed=seed)
        values = dict(s.values) | {
            "rudder": s["rudder"] - offset, "yaw_rate": s["yaw_rate"] + bias
        }  # fmt: skip
        segments += split_into_segments(Signals(s.start_ns, s.dt_secs, values), f"{seed}.mcap")
    fit = output_error(segments, ship_model("burylin-tied"), fixed={"T3": 0.5})
    z = fit.minimum.unknowns
    own = [fit.problem.own(z, i) for i in (0, 1)]
    zeros = [fit.problem.rudder_zero(z) + each.rudder for each in own]
    assert zeros == pytest.approx(offsets, abs=radians(0.03))
    assert [each.biases[0] for each in own] == pytest.approx(biases, abs=radians(0.001))
    assert max(errors(fit).values()) < 3


def test_fixed_parameters_are_kept_and_freed_ones_estimated() -> None:
    fit = output_error(
        [a_trial("pseudo-random", noise="none")], ship_model("burylin"),
        fixed={"b3": TRUTH["b3"]}, free=["alpha2"], nuisance=Nuisance.none(),
    )  # fmt: skip
    assert "b3" not in fit.problem.free_names
    assert errors(fit)["alpha2"] < 1


def test_missing_samples_have_no_effect() -> None:
    s = simulated(noise="none")
    values = {name: np.array(v) for name, v in s.values.items()}
    values["yaw_rate"][100:900] = np.nan
    values["speed"][::3] = np.nan
    trial = split_into_segments(Signals(s.start_ns, s.dt_secs, values), "holes.mcap")[0]
    assert max(errors(output_error([trial], ship_model("burylin"))).values()) < 1e-2


def test_one_outlier_in_a_hundred_samples_changes_little() -> None:
    s = simulated(seed=4)
    values = {name: np.array(v) for name, v in s.values.items()}
    values["yaw_rate"][::100] += radians(0.3)
    spiked = split_into_segments(Signals(s.start_ns, s.dt_secs, values), "spikes.mcap")[0]
    fit = output_error([spiked], ship_model("burylin-tied"), fixed={"T3": 0.5})
    assert errors(fit)["d"] < 1
    assert errors(fit)["b2"] < 2


# ---- uncertainty


def test_b1_is_unidentifiable_from_one_turning_circle() -> None:
    fit = output_error([a_trial("turning-circle-35")], ship_model("burylin"))
    unidentifiable = uncertainty(fit).unidentifiable
    assert "b1" in unidentifiable
    assert not {"a", "d", "f", "g", "h"} & set(unidentifiable)
    tied = output_error(
        [a_trial("turning-circle-35")], ship_model("burylin-tied"), fixed={"T3": 0.5}
    )
    assert uncertainty(tied).unidentifiable == ()


def test_alphas_are_unidentifiable_at_constant_revolutions() -> None:
    segments = [a_trial("turning-circle-35")]
    fit = output_error(segments, ship_model("burylin"), free=["alpha1", "alpha2", "alpha3"])
    assert {"alpha1", "alpha2", "alpha3"} <= set(uncertainty(fit).unidentifiable)


def test_prior_share_of_an_undetermined_parameter_is_large() -> None:
    segments = [a_trial("turning-circle-35", noise="white")]
    fit = output_error(segments, ship_model("three-dof"), length=200.0)
    estimates = uncertainty(fit)
    share = dict(zip(estimates.names, estimates.prior_share, strict=True))
    assert share["p"] > 0.5
    assert "p" in estimates.unidentifiable
    assert np.all((estimates.prior_share > -1e-9) & (estimates.prior_share < 1 + 1e-9))


def test_runs_of_different_ships_widen_the_intervals() -> None:
    s = simulated(seed=1)
    other = Signals(s.start_ns, s.dt_secs, dict(s.values) | {"rudder": 0.8 * s["rudder"]})
    same = [a_trial(seed=0), a_trial(seed=1)]
    mixed = [a_trial(seed=0), split_into_segments(other, "other.mcap")[0]]
    model, fixed = ship_model("burylin-tied"), {"T3": 0.5}
    of_one, of_two = (uncertainty(output_error(t, model, fixed=fixed)) for t in (same, mixed))
    assert of_one.enlargement == 1.0
    assert np.all(of_two.std > 2 * of_one.std)


def test_four_runs_give_jackknife_errors() -> None:
    runs = [a_trial(seed=s, seconds=200.0) for s in range(4)]
    estimates = uncertainty(output_error(runs, ship_model("burylin-tied"), fixed={"T3": 0.5}))
    assert np.isfinite(estimates.between_runs).all()
    assert estimates.enlargement == 1.0
    # three degrees of freedom: uncertain, but of the order of the others
    assert np.all(estimates.between_runs < 8 * estimates.bound)


# ---- noise


def test_white_proportional_and_slow_noise_are_separated() -> None:
    rng = np.random.default_rng(0)
    level = np.sin(np.arange(20_000) / 300)
    white = 0.02 * rng.standard_normal(20_000) + 0.05 * level * rng.uniform(-1, 1, 20_000) * 3**0.5
    noise_fit = fit_residual_noise(
        [OutputResiduals(white, level, 0.1)], proportional=True, least=1e-9
    )
    assert noise_fit.white == pytest.approx(0.02, rel=0.05)
    assert noise_fit.relative == pytest.approx(0.05, rel=0.05)
    assert noise_fit.slow == 0
    slow = np.convolve(rng.standard_normal(20_200), np.ones(201) / 201**0.5, "valid") * 0.03
    noise_fit = fit_residual_noise(
        [OutputResiduals(white + slow, level, 0.1)], proportional=True, least=1e-9
    )
    assert noise_fit.slow == pytest.approx(0.03, rel=0.3)
    assert 10 < noise_fit.slow_secs < 40


def test_a_wave_is_detected_and_none_in_white_noise() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(5000) * 0.1
    noise, std = rng.standard_normal((5000, 2)), np.ones((5000, 2))
    assert swell_frequency(noise, std, 0.1) is None
    noise[:, 1] += 0.3 * np.sin(time / 10 + 1)
    noise[500:900] = np.nan
    assert swell_frequency(noise, std, 0.1) == pytest.approx(0.1, rel=0.03)


def test_a_fitted_swell_does_not_count_as_slow_noise() -> None:
    fit = free_fit(6)
    assert len(fit.problem.waves[0]) == 1
    omega = fit.minimum.unknowns[fit.problem.own_slice(0)][-5]
    assert omega == pytest.approx(0.1, rel=0.01)
    assert fit.noises[1].slow < 0.02
    assert not output_error([a_trial(seed=6, noise="white")], ship_model("burylin")).problem.waves


# ---- segments and errors


def test_no_segments_unknown_names_and_a_rudder_at_rest_are_rejected() -> None:
    with pytest.raises(UsageError, match="at least one log"):
        output_error([], ship_model("nomoto"))
    with pytest.raises(UsageError, match="no parameter 'T4'; it has a, b2"):
        output_error([a_trial()], ship_model("burylin-tied"), fixed={"T4": 1.0})
    s = simulated()
    at_rest = Signals(s.start_ns, s.dt_secs, dict(s.values) | {"rudder": np.zeros(len(s))})
    with pytest.raises(LogError, match=r"the rudder moves by 0.0° in all.*still\.mcap"):
        output_error(split_into_segments(at_rest, "still.mcap"), ship_model("nomoto"))


def test_short_runs_are_rejected_and_gaps_split_a_run() -> None:
    s = simulated()
    with pytest.raises(LogError, match=r"less than 60 s at a time.*short\.mcap"):
        split_into_segments(s.part(0, 100), "short.mcap")
    rudder = np.array(s["rudder"])
    rudder[2000:2300] = np.nan
    values = dict(s.values) | {"rudder": rudder}
    segments = split_into_segments(Signals(s.start_ns, s.dt_secs, values), "gap.mcap")
    assert [len(segment) for segment in segments] == [2000, len(s) - 2300]
    assert all(np.isfinite(segment.signals["rudder"]).all() for segment in segments)


def test_a_sparse_run_does_not_hide_slow_noise_in_another() -> None:
    rng = np.random.default_rng(0)
    slow = np.zeros(6000)
    for k in range(1, len(slow)):
        slow[k] = 0.99 * slow[k - 1] + 0.1 * np.sqrt(1 - 0.99**2) * rng.standard_normal()
    dense = OutputResiduals(slow + 0.01 * rng.standard_normal(6000), np.zeros(6000), 0.1)
    sparse = OutputResiduals(0.1 * rng.standard_normal(2), np.zeros(2), 600.0)
    alone = fit_residual_noise([dense], proportional=False, least=1e-9)
    beside = fit_residual_noise([dense, sparse], proportional=False, least=1e-9)
    assert beside.slow == pytest.approx(alone.slow, rel=0.05)
    assert beside.slow_secs == pytest.approx(alone.slow_secs, rel=0.3)

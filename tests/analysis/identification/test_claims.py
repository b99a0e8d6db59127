"""identification.md, sections 1, 2 and 4: what becomes of the paper's method as the paper has it.

The filter is shiplog's, the paper's own reading (`as_printed`) of it or ours; the regression (7) is
written out here. Where the page does not say on which run it measured, the runs are named here.
"""

from dataclasses import replace
from functools import cache
from math import degrees

import numpy as np
import pytest

from analysis.filters.factory import filter_states
from analysis.filters.noise_model import NoiseModel
from recorders.simulated.manoeuvres import manoeuvre
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import compute_trajectory
from shiplog import Signals, TrialLog, Vessel, load_vessel, resample
from shiplog.ships.paper import (
    PAPER_INPUTS,
    PAPER_OUTPUTS,
    Coefficients,
    rudder_effects,
    steady_speed,
    surge_acceleration,
    yaw_acceleration_rate,
)
from shiplog.vessel.settings import FilterSettings

NINE = Coefficients._fields[:9]  # what is identified; the alphas are known
YAW, SURGE = slice(0, 6), slice(6, 9)  # of the nine
DURATION, DT, WINDOW, STRIDE = 500.0, 0.1, 2000, 20  # s, s, samples, samples
Q, R = 0.01, 400.0
PRIORS_OFF = 0.2 * np.random.default_rng(1).choice((-1.0, 1.0), (8, 9))
RUNS = ("paper", "turning-circle", "zigzag-20-20")


@cache
def ship(preset: str) -> Vessel:
    return load_vessel(preset)[0]


@cache
def measured(preset: str, noise: str, run: str, seed: int = 0) -> Signals:
    sensors = suite(noise, angle_unit=ship(preset).angle_unit)
    trial = simulate(ship(preset), run, duration_secs=DURATION, seed=seed, sensors=sensors)
    return resample(TrialLog("run", trial.channels), channels=(*PAPER_OUTPUTS, *PAPER_INPUTS))


def estimated(signals: Signals, model: Coefficients, *, printed: bool) -> np.ndarray:
    """w, w', w'', v, v', (n, 5), by the paper's Q and R, which are intensities."""
    noise = NoiseModel(np.full(2, np.sqrt(R / DT)), np.full(2, Q / R))
    settings = FilterSettings(kind="pseudo-input", as_printed=printed)
    return filter_states(signals, model, noise, settings).states


def equations(
    signals: Signals, model: Coefficients, x: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Regressors and target of both equations of (7); of the model only the alphas are used."""
    w, w_dot, w_ddot, v, v_dot = np.ascontiguousarray(x.T)
    delta, n = signals["rudder"], signals["rpm"]
    ks, rate = rudder_effects(model, v, n), np.diff(delta, append=delta[-1]) / DT
    of_yaw = np.column_stack((w_dot, w, w * abs(w), w**3, ks * delta, ks * rate))
    return (of_yaw, w_ddot), (np.column_stack((w * w, v * v, n)), v_dot)


def solved(regressors: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Least squares by the pseudo-inverse, of scaled columns."""
    scale = np.linalg.norm(regressors, axis=0)
    scale[scale == 0] = 1
    return np.linalg.pinv(regressors / scale, rcond=1e-13) @ target / scale


def identified(signals: Signals, prior: Coefficients, *, printed: bool) -> np.ndarray:
    """The nine coefficients of all of a run, (9,), with `prior` in the filter."""
    x = estimated(signals, prior, printed=printed)
    return np.concatenate([solved(*rows) for rows in equations(signals, prior, x)])


def windowed(signals: Signals, prior: Coefficients) -> tuple[np.ndarray, np.ndarray]:
    """When windows of 200 s end, (k,), the first ones growing, and their coefficients, (k, 9)."""
    both = equations(signals, prior, estimated(signals, prior, printed=True))
    ends = np.arange(STRIDE, len(signals), STRIDE)
    found = [
        np.concatenate(
            [solved(*(part[max(0, end - WINDOW) : end] for part in rows)) for rows in both]
        )
        for end in ends
    ]
    return ends * DT, np.array(found)


def percent(found: np.ndarray, c: Coefficients) -> np.ndarray:
    """Errors in % of the true values."""
    return 100 * (found / np.array(c[:9]) - 1)


def with_nine(c: Coefficients, values: np.ndarray) -> Coefficients:
    return c._replace(**dict(zip(NINE, values.tolist(), strict=True)))


def truth(vessel: Vessel, run: str) -> np.ndarray:
    """w'', w', w, v', v every 0.1 s just after the instant, where a rudder may start, (n, 5)."""
    c, times = vessel.coefficients, np.arange(int(DURATION / DT)) * DT + 1e-9
    at = compute_trajectory(vessel, manoeuvre(run, DURATION, vessel.approach_rpm), DURATION).at(
        times
    )
    w, w_dot, v, n, delta = (
        at[k] for k in ("yaw_rate", "yaw_acceleration", "speed", "rpm", "rudder")
    )
    rate = np.diff(delta, append=delta[-1]) / DT
    each = zip(w, w_dot, v, n, delta, rate, strict=True)
    w_ddot = [yaw_acceleration_rate(c, *one) for one in each]
    v_dot = [surge_acceleration(c, *one) for one in zip(w, v, n, strict=True)]
    return np.column_stack((w_ddot, w_dot, w, v_dot, v))


# ---- section 1: what Table 1 means


@pytest.mark.parametrize(
    ("preset", "rate", "diameter", "kept"),
    # °/s, m and % of the speed: 35° of rudder at 80 rpm; in radians hard over costs 1 % of speed
    [("table1", 0.511, 992, 43), ("table1-rad", None, None, 99)],
)
def test_hard_over_is_a_ship_of_200_m_in_degrees_and_hardly_felt_in_radians(
    preset: str, rate: float | None, diameter: float | None, kept: float
) -> None:
    vessel = ship(preset)
    sailed = compute_trajectory(vessel, manoeuvre("turning-circle-35", 4000.0, 80.0), 4000.0)
    end = sailed.at(np.array([3999.0]))
    w, v = end["yaw_rate"][0], end["speed"][0]
    assert 100 * v / steady_speed(vessel.coefficients, 80.0) == pytest.approx(kept, abs=0.5)
    if rate is not None:
        assert degrees(w) == pytest.approx(rate, abs=5e-4)
        assert 2 * v / w == pytest.approx(diameter, abs=0.5)


# ---- section 2: the jump that saves e


@pytest.mark.parametrize("preset", ["table1", "table1-rad"])
def test_on_clean_data_the_jump_takes_the_error_of_e_from_minus_97_percent_to_3e_8(
    preset: str,
) -> None:
    signals, c = measured(preset, "none", "turning-circle"), ship(preset).coefficients
    printed, ours = (percent(identified(signals, c, printed=how), c) for how in (True, False))
    assert printed[5] == pytest.approx(-97, abs=2.5)
    assert abs(ours[5]) < 3e-8
    assert np.abs(ours).max() < 2e-7


@pytest.mark.parametrize("preset", ["table1", "table1-rad"])
@pytest.mark.parametrize("run", [*RUNS, "zigzag-10-10", "pseudo-random"])
def test_as_printed_e_is_lost_on_every_run(preset: str, run: str) -> None:
    signals, c = measured(preset, "none", run), ship(preset).coefficients
    printed, ours = (percent(identified(signals, c, printed=how), c) for how in (True, False))
    assert printed[5] == pytest.approx(-100, abs=5)
    assert abs(ours[5]) < 2e-3


# ---- section 4: what of the claims holds


@cache
def histories(run: str) -> tuple[np.ndarray, np.ndarray]:
    """Five runs under the paper's noise: the windows' ends, and their errors in %, (5, k, 9)."""
    c = ship("table1").coefficients
    found = [windowed(measured("table1", "paper", run, seed), c) for seed in range(5)]
    return found[0][0], np.array([percent(values, c) for _, values in found])


@pytest.mark.parametrize("run", ["paper", "zigzag-20-20"])
def test_coefficients_of_yaw_jump_in_the_first_50_s_by_1e4_percent_and_more(run: str) -> None:
    ends, off = histories(run)
    spikes = np.abs(off[:, ends <= 50, YAW]).max(axis=(1, 2))
    assert spikes.min() > 1e4


def test_coefficients_of_surge_settle_smoothly_where_those_of_yaw_jump() -> None:
    """From window to window, 2 s on; before 20 s hardly anything has turned for f to show."""
    ends, off = histories("paper")
    between = (ends[1:] > 20) & (ends[1:] <= 50)
    jumps = np.abs(np.diff(off, axis=1)[:, between]).max(axis=1)
    assert jumps[:, SURGE].max() < 0.5
    assert jumps[:, YAW].max(axis=1).min() > 50


@pytest.mark.parametrize(("run", "latest"), [("paper", 350), ("zigzag-20-20", 380)])
def test_not_all_coefficients_settle_by_200_s(run: str, latest: float) -> None:
    """From when on each is within a tenth of the truth, in the median of five runs.

    The page has b1 settle at 110 to 350 s, on no run that it names; the zig-zag's takes 374 s.
    """
    ends, off = histories(run)
    told = ends <= 400  # beyond, the paper's run has windows without a moving rudder
    away = np.abs(off[:, told]) > 10
    last = np.where(away, ends[told][:, None], 0.0).max(axis=1)
    settled = dict(zip(NINE, np.median(last, axis=0).tolist(), strict=True))
    assert max(settled[name] for name in "adfgh") <= 80
    assert 110 <= settled["b1"] <= latest
    assert max(settled["b2"], settled["b3"]) <= 260
    assert last[:, NINE.index("e")].min() == ends[told][-1]  # never


@pytest.mark.parametrize("noise", ["none", "paper"])
def test_taken_algebraically_the_result_is_the_prior_whatever_the_data(noise: str) -> None:
    signals, c = measured("table1", noise, "paper"), ship("table1").coefficients
    for off in PRIORS_OFF:
        prior = np.array(c[:9]) * (1 + off)
        x = estimated(signals, with_nine(c, prior), printed=True)
        for of, (regressors, _) in zip((YAW, SURGE), equations(signals, c, x), strict=True):
            found = solved(regressors, regressors @ prior[of])
            assert found == pytest.approx(prior[of], rel=3e-13)


@pytest.mark.parametrize(
    ("run", "radius"), [("turning-circle", 1.34), ("zigzag-20-20", 1.24), ("pseudo-random", 1.11)]
)
def test_errors_of_the_prior_are_amplified(run: str, radius: float) -> None:
    """The spectral radius of identified against prior; the page's runs differ a little."""
    signals, c = measured("table1", "none", run), ship("table1").coefficients
    base, step = np.array(c[:9]), 1e-4
    ends = [
        [
            identified(signals, with_nine(c, base * (1 + side * move)), printed=True)
            for move in step * np.eye(9)
        ]
        for side in (1, -1)
    ]
    jacobian = (np.array(ends[0]) - np.array(ends[1])).T / (2 * step) / base[:, None]
    assert np.abs(np.linalg.eigvals(jacobian)).max() == pytest.approx(radius, abs=0.02)


@pytest.mark.parametrize("noise", ["none", "paper"])
@pytest.mark.parametrize("run", RUNS)
def test_a_prior_wrong_by_20_percent_makes_b1_wrong_by_hundreds(run: str, noise: str) -> None:
    signals, c = measured("table1", noise, run), ship("table1").coefficients
    priors = np.array(c[:9]) * (1 + PRIORS_OFF)
    found = [
        percent(identified(signals, with_nine(c, prior), printed=True), c)[1] for prior in priors
    ]
    assert np.median(np.abs(found)) > 100
    assert np.max(np.abs(found)) > 200


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize("start", [0.2, 0.01, 0.001])
def test_coefficients_fed_back_into_the_filter_diverge(run: str, start: float) -> None:
    """Clean data and the jump added, so that the truth itself would be found again."""
    signals, c = measured("table1", "none", run), ship("table1").coefficients
    found = np.array(c[:9]) * (1 + start / 0.2 * PRIORS_OFF[0])
    for _ in range(28):
        x = estimated(signals, with_nine(c, found), printed=False)
        if not np.abs(x).max() < 1e6:
            return  # the model in the filter has run away
        found = np.concatenate([solved(*rows) for rows in equations(signals, c, x)])
    assert np.abs(percent(found, c)).max() > 100


# ---- Table 2: w'', w', w, v', v in rad and m
TABLE2 = [5.3e-9, 1.3e-6, 0.05, 1.6e-6, 0.014]


@pytest.mark.parametrize("run", ["paper", "turning-circle"])
def test_table_2_in_radians_on_clean_data(run: str) -> None:
    vessel = ship("table1-rad")
    found = identified(measured("table1-rad", "none", run), vessel.coefficients, printed=True)
    restored = replace(vessel, coefficients=with_nine(vessel.coefficients, found))
    off = truth(restored, run) - truth(vessel, run)
    w_ddot, w_dot, w, v_dot, v = np.sqrt(np.mean(off**2, axis=0))
    assert 1.0e-7 < w_ddot < 1.9e-7
    assert w_dot == pytest.approx(1.3e-6, rel=0.2)
    assert w == pytest.approx(5e-5, rel=0.25)
    assert 2e-7 < v_dot < 2.6e-6
    assert 1.5e-5 < v < 4e-4
    longest = DURATION / np.sqrt(2)
    assert w < longest * w_dot
    assert v < longest * v_dot


def test_table_2_contradicts_itself() -> None:
    """An error that begins at zero is in rms at most T/√2 times its rate's."""
    _, w_dot, w, v_dot, v = TABLE2
    assert w > 100 * DURATION / np.sqrt(2) * w_dot
    assert v > 20 * DURATION / np.sqrt(2) * v_dot


@pytest.mark.parametrize("run", [*RUNS, "zigzag-10-10"])
@pytest.mark.parametrize("free", ["gh", "fgh"])
def test_its_surge_lies_7_to_30_times_below_the_cramer_rao_bound(run: str, free: str) -> None:
    """Of the restored v', of ±0.2 m/s on the log at 10 Hz; f known or not."""
    vessel = ship("table1-rad")
    c, std = vessel.coefficients, 0.2 / np.sqrt(3)
    slopes = []
    for name in free:
        value = getattr(c, name)
        above, below = (
            truth(replace(vessel, coefficients=c._replace(**{name: value * (1 + side)})), run)
            for side in (1e-4, -1e-4)
        )
        slopes.append((above - below)[:, 3:].T / (2e-4 * value))
    of_rate, of_speed = np.moveaxis(np.array(slopes), 1, 0)
    covariance = np.linalg.inv(of_speed @ of_speed.T) * std**2
    bound = np.sqrt(np.mean(np.einsum("ik,ij,jk->k", of_rate, covariance, of_rate)))
    assert 7 < bound / TABLE2[3] < 30

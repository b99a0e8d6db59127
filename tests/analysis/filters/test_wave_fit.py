from collections.abc import Callable
from math import pi

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov
from scipy.signal import butter, freqs, lfilter, sosfilt, tf2ss, welch
from scipy.stats import gamma

from analysis.design.shaping import wave_filter
from analysis.filters import wave_fit
from analysis.filters.noise_model import MIN_CONTRAST, Wave
from analysis.filters.wave_fit import _likeliest, fit_wave
from analysis.filters.whittle import (
    Spectrum,
    mean_periodogram,
    negative_log_likelihood,
    spectrum_of,
)
from shiplog import UsageError
from shiplog.types import FloatArray

Noise = Callable[[np.random.Generator, int, float], FloatArray]

# duration s, step s, frequency rad/s, damping, standard deviation in that of the white noise
CLEAR = [
    (1000.0, 0.4, 0.8, 0.1, 1.0),
    (3000.0, 1.0, 0.8, 0.3, 3.0),
    (1000.0, 0.5, 1.5, 0.1, 3.0),
    (3000.0, 0.5, 1.0, 0.05, 0.5),
    (3000.0, 1.0, 2.0, 0.05, 1.0),
]
SHORT = [
    (300.0, 0.2, 2.0, 0.05, 3.0),
    (300.0, 0.5, 1.0, 0.1, 1.0),
    (300.0, 0.2, 2.0, 0.3, 0.7),
    (1000.0, 0.4, 0.5, 0.3, 1.0),
    (3000.0, 1.0, 0.3, 0.05, 0.3),
]
MOST = 7 / 8  # of the seeds


def discrete(
    frequency: float, damping: float, std: float, dt: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """F, Q, C and P of the shaping filter, exactly from sample to sample."""
    shaping = wave_filter(std**2, frequency, damping)
    A, B, C, _ = tf2ss(shaping.numerator, shaping.denominator)
    F, P = expm(A * dt), solve_continuous_lyapunov(A, -B @ B.T)
    return F, P - F @ P @ F.T, C, P


def wave_of(
    rng: np.random.Generator, n: int, dt: float, frequency: float, damping: float, std: float
) -> FloatArray:
    F, Q, C, P = discrete(frequency, damping, std, dt)
    drive = rng.standard_normal((n, 2)) @ np.linalg.cholesky(Q).T
    drive[0] = np.linalg.cholesky(P) @ rng.standard_normal(2)
    poles, V = np.linalg.eig(F)
    modes = [
        lfilter([1], [1, -pole], d)
        for pole, d in zip(poles, np.linalg.solve(V, drive.T), strict=True)
    ]
    return np.real(C @ V @ np.array(modes))[0]


def red_of(rng: np.random.Generator, n: int, dt: float, rate: float, std: float) -> FloatArray:
    decay = np.exp(-rate * dt)
    drive = rng.standard_normal(n) * std * np.sqrt(1 - decay**2)
    drive[0] /= np.sqrt(1 - decay**2)
    return lfilter([1], [1, -decay], drive)


def at_sea(
    seed: int, secs: float, dt: float, frequency: float, damping: float, std: float
) -> FloatArray:
    rng, n = np.random.default_rng(seed), int(secs / dt)
    return wave_of(rng, n, dt, frequency, damping, std) + rng.standard_normal(n)


def fitted(residual: FloatArray, dt: float, interval: float = 1.0, **stated: float) -> Wave:
    result = fit_wave(residual, dt, interval, **stated)
    assert result is not None
    return result


def log_errors(result: Wave, frequency: float, damping: float, std: float) -> FloatArray:
    """Logarithms of the estimates over the true values."""
    return np.log([result.frequency / frequency, result.damping / damping, result.std / std])


def share_within(errors: FloatArray, frequency: float, damping: float, std: float) -> FloatArray:
    return np.mean(np.abs(errors) <= np.log([frequency, damping, std]), axis=0)


# ---- what is estimated


def information(n: int, dt: float, true: FloatArray) -> FloatArray:
    """Whittle's, of the logarithms of frequency, damping, std and white noise's variance, (4, 4).

    The sum over n frequencies about the circle of half the products of the log spectrum's slopes.
    """
    omega = (np.arange(4000) + 0.5) * pi / 4000

    def log_spectrum(logarithms: FloatArray) -> FloatArray:
        frequency, damping, std, white = np.exp(logarithms)
        F, Q, C, _ = discrete(frequency, damping, std, dt)
        z = np.exp(1j * omega)[:, None, None]
        passed = (C @ np.linalg.inv(z * np.eye(2) - F))[:, 0]
        return np.log(white + np.einsum("ki,ij,kj->k", passed, Q, passed.conj()).real)

    at = np.log([*true, 1.0])
    slopes = [log_spectrum(at + step) - log_spectrum(at - step) for step in 1e-4 * np.eye(4)]
    scaled = np.array(slopes) / 2e-4
    return n / 2 * scaled @ scaled.T / len(omega)


@pytest.mark.parametrize(("secs", "dt", "frequency", "damping", "std"), CLEAR)
def test_a_clear_waves_filter_is_found_nearly_as_well_as_can_be(
    secs: float, dt: float, frequency: float, damping: float, std: float
) -> None:
    true = (frequency, damping, std)
    result = [fitted(at_sea(seed, secs, dt, *true), dt) for seed in range(8)]
    errors = np.array([log_errors(wave, *true) for wave in result])
    assert share_within(errors, 1.05, 1.6, 1.15).min() >= MOST
    assert all(wave.stands_out for wave in result)
    bound = np.linalg.inv(information(int(secs / dt), dt, np.array(true))).diagonal()[:3]
    assert np.all(np.sqrt(np.mean(errors**2, axis=0)) < 1.5 * np.sqrt(bound))


@pytest.mark.parametrize(("secs", "dt", "frequency", "damping", "std"), SHORT)
def test_a_short_logs_or_a_broad_waves_filter_is_found_less_exactly(
    secs: float, dt: float, frequency: float, damping: float, std: float
) -> None:
    true = (frequency, damping, std)
    result = [fitted(at_sea(seed, secs, dt, *true), dt) for seed in range(8)]
    errors = np.array([log_errors(wave, *true) for wave in result])
    assert share_within(errors, 1.12, 2.2, 1.25).min() >= MOST
    assert np.mean([wave.stands_out for wave in result]) >= MOST


def test_the_fitted_filter_has_the_spectrum_that_welch_sees() -> None:
    dt, true = 0.2, (0.7, 0.12, 1.5)
    residual = at_sea(3, 8000.0, dt, *true)
    result = fitted(residual, dt)
    shaping = wave_filter(result.std**2, result.frequency, result.damping)
    hertz, spectrum = welch(residual, 1 / dt, nperseg=2048)
    kept = (hertz > 0.04) & (hertz < 1.0)  # |H|^2 is not aliased there
    _, H = freqs(shaping.numerator, shaping.denominator, 2 * pi * hertz[kept])
    ratio = spectrum[kept] / (2 * (np.abs(H) ** 2 + dt))
    assert [np.mean(part) for part in np.array_split(ratio, 8)] == pytest.approx([1] * 8, abs=0.1)


@pytest.mark.parametrize(
    ("secs", "dt", "frequency", "std"),
    [(300.0, 0.1, 0.8, 1.0), (1000.0, 0.1, 0.8, 3.0), (3000.0, 0.5, 0.83, 1.0),
     (3000.0, 0.1, 0.5, 0.3), (60.0, 0.05, 4.0, 1.0), (1000.0, 0.5, 2.0, 30.0)],
)  # fmt: skip
def test_a_regular_wave_has_its_frequency_its_std_and_little_damping(
    secs: float, dt: float, frequency: float, std: float
) -> None:
    time_secs = np.arange(0, secs, dt)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        wave = std * np.sqrt(2) * np.sin(frequency * time_secs + rng.uniform(0, 2 * pi))
        result = fitted(wave + rng.standard_normal(len(wave)), dt)
        assert abs(result.frequency - frequency) < 0.5 * 2 * pi / secs
        assert result.std == pytest.approx(std, rel=0.1)
        assert result.damping < 2 / (frequency * min(secs, 16_384 * dt))
        assert result.stands_out


def test_a_regular_wave_without_noise_is_found_too() -> None:
    result = fitted(3e-3 * np.sin(0.7 * np.arange(0, 500, 0.1)), 0.1)
    assert result.frequency == pytest.approx(0.7, abs=0.1 * 2 * pi / 500)
    assert result.std == pytest.approx(3e-3 / np.sqrt(2), rel=0.02)
    assert result.stands_out


def with_gaps(residual: FloatArray) -> FloatArray:
    holed = residual.copy()
    for start in np.linspace(0.05, 0.85, 7) * len(residual):
        holed[int(start) : int(start + 0.06 * len(residual))] = np.nan
    holed[np.random.default_rng(0).random(len(residual)) < 0.1] = np.nan
    return holed


def slowly(residual: FloatArray) -> FloatArray:
    """Every fifth instant, give or take one."""
    at = np.arange(5, len(residual) - 5, 5)
    at += np.random.default_rng(0).integers(-1, 2, len(at))
    spectrum = np.full(len(residual), np.nan)
    spectrum[at] = residual[at]
    return spectrum


@pytest.mark.parametrize(("sensor", "interval"), [(with_gaps, 1.0), (slowly, 5.0)])
@pytest.mark.parametrize("frequency", [0.8, 2.0])
def test_gaps_and_a_slow_sensor_do_no_harm(
    sensor: Callable[[FloatArray], FloatArray], interval: float, frequency: float
) -> None:
    true = (frequency, 0.1, 1.5)
    result = [fitted(sensor(at_sea(s, 1500.0, 0.2, *true)), 0.2, interval) for s in range(4)]
    errors = np.array([log_errors(wave, *true) for wave in result])
    assert share_within(errors, 1.05, 1.6, 1.15).min() >= MOST
    assert all(wave.stands_out for wave in result)


def test_a_wave_is_found_above_what_the_model_does_not_know_of_the_ship() -> None:
    dt, true = 0.2, (0.8, 0.1, 1.0)
    for seed in range(6):
        red = red_of(np.random.default_rng(100 + seed), 7500, dt, 0.03, 3.0)
        result = fitted(at_sea(seed, 1500.0, dt, *true) + red, dt)
        assert np.all(np.abs(log_errors(result, *true)) < np.log([1.05, 1.6, 1.15]))
        assert result.stands_out


def test_a_slow_wave_stands_out_in_a_few_periods() -> None:
    result = [fitted(at_sea(s, 300.0, 0.2, 0.3, 0.05, 1.0), 0.2) for s in range(8)]
    assert np.mean([wave.stands_out for wave in result]) >= MOST
    assert [wave.frequency for wave in result] == pytest.approx([0.3] * 8, rel=0.1)


def test_no_unit_matters() -> None:
    residual = at_sea(1, 600.0, 0.2, 0.8, 0.1, 1.0)
    one, small = fitted(residual, 0.2), fitted(1e-5 * residual, 0.2)
    assert small.std == pytest.approx(1e-5 * one.std, rel=1e-6)
    assert small.frequency == pytest.approx(one.frequency, rel=1e-6)
    assert small.evidence == pytest.approx(one.evidence, rel=1e-6)


# ---- what is stated


def test_what_is_stated_is_kept_to_the_last_bit() -> None:
    residual = at_sea(2, 1000.0, 0.2, 0.8, 0.1, 1.0)
    true = {"frequency": 0.8, "damping": 0.1, "std": 1.0}
    for name, value in true.items():
        stated = {name: value * 1.01}
        result = fitted(residual, 0.2, **stated)
        assert getattr(result, name) == stated[name]
        assert np.all(np.abs(log_errors(result, **true)) < np.log([1.05, 1.4, 1.15]))
        assert result.stands_out
    whole = fitted(residual, 0.2, **true)
    assert (whole.frequency, whole.damping, whole.std) == (0.8, 0.1, 1.0)
    assert whole.stands_out
    assert fitted(residual, 0.2).evidence >= whole.evidence


def test_a_stated_frequency_is_one_place_to_look_at_and_may_be_a_slow_one() -> None:
    residual = at_sea(4, 2000.0, 0.5, 0.15, 0.1, 2.0)
    result = fitted(residual, 0.5, frequency=0.15)
    assert result.needed == pytest.approx(2 * np.log(100))
    assert np.all(np.abs(log_errors(result, 0.15, 0.1, 2.0)) < np.log([1.001, 2.0, 1.3]))
    assert result.stands_out


def test_a_wave_that_is_not_where_it_is_stated_does_not_stand_out() -> None:
    residual = at_sea(5, 1000.0, 0.2, 0.8, 0.05, 1.0)
    assert not fitted(residual, 0.2, frequency=3.0).stands_out
    assert fitted(residual, 0.2, frequency=0.8, damping=0.05, std=30.0).evidence < 0


def test_a_wave_stated_altogether_needs_no_measurements() -> None:
    nothing = np.full(5, np.nan)
    result = fitted(nothing, 0.1, frequency=0.6, damping=1.0, std=2e-4)
    assert (result.frequency, result.damping, result.std) == (0.6, 1.0, 2e-4)
    assert np.isnan(result.evidence)
    assert not result.stands_out
    assert fit_wave(nothing, 0.1, 1.0, frequency=0.6, damping=0.1) is None


# ---- whether there is one


def test_a_place_of_any_width_exceeds_what_is_needed_as_seldom_as_stated() -> None:
    """Chernoff's bound: the mean of m exponentials, 2 m (x - 1 - ln x) > t."""
    x = np.linspace(1, 20, 2000)[1:]
    for m in (1, 2, 5, 20, 100):
        t = 2 * m * (x - 1 - np.log(x))
        assert np.all(gamma.sf(x, m, scale=1 / m) <= np.exp(-t / 2))


@pytest.mark.parametrize("red", [0.0, 3.0])
def test_noise_claims_a_wave_in_one_log_of_a_hundred_at_the_most(red: float) -> None:
    claims = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        result = fitted(rng.standard_normal(200) + red_of(rng, 200, 1.0, 0.05, red), 1.0)
        claims += result.evidence > result.needed
    assert claims <= 1


def quick_red(rng: np.random.Generator, n: int, dt: float) -> FloatArray:
    return rng.standard_normal(n) + red_of(rng, n, dt, 1.0, 5.0)


def steep_red(rng: np.random.Generator, n: int, dt: float) -> FloatArray:
    decay = np.exp(-0.1 * dt)
    twice = lfilter([1], [1, -decay], red_of(rng, n, dt, 0.1, 1.0))
    return rng.standard_normal(n) + 3 * twice / twice.std()


def smoothed(rng: np.random.Generator, n: int, dt: float) -> FloatArray:
    low_pass = butter(2, 1.0, fs=2 * pi / dt, output="sos")
    return sosfilt(low_pass, rng.standard_normal(n)) + 0.01 * rng.standard_normal(n)


def differenced(rng: np.random.Generator, n: int, _dt: float) -> FloatArray:
    return np.diff(rng.standard_normal(n + 1))


@pytest.mark.parametrize("noise", [quick_red, steep_red, smoothed, differenced])
def test_a_spectrum_that_only_falls_or_rises_is_no_wave_though_no_background_fits_it(
    noise: Noise,
) -> None:
    result = [fitted(noise(np.random.default_rng(s), 3000, 0.2), 0.2) for s in range(8)]
    assert np.mean([wave.stands_out for wave in result]) <= 0.1


def test_a_line_below_the_lowest_frequency_is_no_wave() -> None:
    """As the paper's sine of t / 10 s, were it larger."""
    rng, time_secs = np.random.default_rng(6), np.arange(0, 1000, 0.1)
    white = rng.standard_normal(len(time_secs))
    for slow in (0.1, 0.2):
        residual = white + 3 * np.sin(slow * time_secs)
        assert not fitted(residual, 0.1).stands_out
        below = fitted(residual, 0.1, lowest=0.06)
        assert below.frequency == pytest.approx(slow, abs=1e-3)
        assert below.stands_out


def test_a_faster_wave_is_found_beside_such_a_line() -> None:
    residual = at_sea(7, 1000.0, 0.1, 0.8, 0.1, 1.0) + 3 * np.sin(0.1 * np.arange(0, 1000, 0.1))
    result = fitted(residual, 0.1)
    assert result.frequency == pytest.approx(0.8, rel=0.05)
    assert result.stands_out


def test_a_wave_stands_out_where_it_is_likely_and_a_peak() -> None:
    assert Wave(0.6, 0.1, 2e-4, evidence=1.0).stands_out
    assert not Wave(0.6, 0.1, 2e-4, evidence=20.0, needed=21.0).stands_out
    assert not Wave(0.6, 0.1, 2e-4, evidence=22.0, needed=21.0, contrast=1.0).stands_out
    assert Wave(0.6, 0.1, 2e-4, 22.0, 21.0, MIN_CONTRAST + 0.1).stands_out


# ---- the likelihood


def seen_of(residual: FloatArray, dt: float) -> Spectrum:
    spectrum = spectrum_of(residual, dt, pi / dt, 0.25, None)
    assert spectrum is not None
    return spectrum


def brute_means(
    residual: FloatArray, dt: float, spectrum: Spectrum, covariances: list[FloatArray]
) -> list[FloatArray]:
    """E |sum w x e^-iωt|^2 / sum w^2 as a double sum over what was measured."""
    n = len(residual)
    k = np.arange(n) / (n - 1)
    edge = np.minimum(k, 1 - k) / 0.1
    taper = np.where(edge < 1, 0.5 - 0.5 * np.cos(pi * edge), 1.0) * np.isfinite(residual)
    lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    waves = taper * np.exp(-1j * np.outer(spectrum.omega[spectrum.first :], np.arange(n) * dt))
    return [
        np.einsum("kt,kt->k", waves @ covariance[lags], waves.conj()).real / np.sum(taper**2)
        for covariance in covariances
    ]


def test_the_mean_periodogram_is_the_double_sum_over_what_was_measured() -> None:
    dt, (frequency, damping, std) = 0.5, (0.8, 0.15, 1.3)
    residual = with_gaps(at_sea(8, 200.0, dt, frequency, damping, std))
    residual[[0, -1]] = 1.0
    spectrum = seen_of(residual, dt)
    F, _, C, P = discrete(frequency, damping, std, dt)
    tau = np.arange(len(residual))
    wave = np.array([(C @ np.linalg.matrix_power(F, k) @ P @ C.T)[0, 0] for k in tau])
    red = 4.0 * np.exp(-0.2 * tau * dt)
    white = np.where(tau == 0, 0.7, 0.0)
    theta = np.log([0.7, 4.0, 0.2, std**2, frequency, damping])
    background, of_wave = mean_periodogram(spectrum, theta)
    expected = brute_means(residual, dt, spectrum, [red + white, wave])
    assert background == pytest.approx(expected[0], rel=1e-9)
    assert of_wave == pytest.approx(expected[1], rel=1e-9)


def test_the_slope_of_the_likelihood_is_its_difference() -> None:
    spectrum = seen_of(with_gaps(at_sea(9, 300.0, 0.5, 0.8, 0.15, 1.3)), 0.5)
    theta = np.log([0.4, 0.3, 0.3, 0.7, 0.9, 0.2])
    _, slope, _ = negative_log_likelihood(spectrum, theta)
    for i, step in enumerate(1e-5 * np.eye(6)):
        above, below = (
            negative_log_likelihood(spectrum, theta + step)[0],
            negative_log_likelihood(spectrum, theta - step)[0],
        )
        assert slope[i] == pytest.approx((above - below) / 2e-5, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_no_grid_of_parameters_holds_a_likelier_wave(seed: int) -> None:
    dt = 0.5
    residual = at_sea(seed, 200.0, dt, 0.9, 0.1, 0.8)
    spectrum = seen_of(residual, dt)
    result, _ = _likeliest(spectrum, np.full(6, np.nan))
    least = negative_log_likelihood(spectrum, result)[0] / spectrum.weight
    tau = dt * np.arange(len(residual))
    red = np.exp(result[1] - np.exp(result[2]) * tau)
    for frequency in np.concatenate((np.geomspace(0.26, 5.6, 40), np.exp(result[4]) * SPREAD)):
        dampings = np.exp(result[5]) * np.array([0.2, 0.5, 0.8, 1.0, 1.25, 2.0, 4.0])
        dampings = dampings[dampings < 0.5]
        covariances = [red]
        for damping in dampings:
            poles = frequency * (-damping + np.array([1j, -1j]) * np.sqrt(1 - damping**2))
            residues = poles / (poles - poles[::-1])  # of s / (s^2 + 2 ζ ω0 s + ω0^2)
            covariances.append(np.real(residues @ np.exp(np.outer(poles, tau))))
        of_red, *waves = fast_means(spectrum, covariances)
        for of_wave in waves:
            for white in np.exp(result[0]) * np.array([0.7, 0.9, 1.0, 1.1, 1.4]):
                for power in np.exp(result[3]) * np.array([0.03, 0.1, 0.3, 0.7, 0.9, 1, 1.1, 1.5]):
                    mean = white + of_red + power * of_wave
                    assert np.sum(spectrum.fitted / mean + np.log(mean)) > least - 1e-3


SPREAD = np.array([0.9, 0.97, 0.99, 1.0, 1.01, 1.03, 1.1])


def fast_means(spectrum: Spectrum, covariances: list[FloatArray]) -> list[FloatArray]:
    """As `brute_means` of what has no gaps, lag by lag."""
    n = len(spectrum.overlap)
    overlap = spectrum.overlap.copy()
    overlap[spectrum.half] /= 2
    overlap[1:] *= 2
    tau = spectrum.dt_secs * np.arange(n)
    cosines = np.cos(np.outer(spectrum.omega[spectrum.first :], tau))
    return [cosines @ (overlap * covariance) for covariance in covariances]


# ---- what cannot be fitted


@pytest.mark.parametrize(
    "residual",
    [
        np.array([]),
        np.full(5000, np.nan),
        np.random.default_rng(0).standard_normal(99),
        np.zeros(5000),
        np.full(5000, 0.1),
        np.where(np.arange(5000) % 60 == 0, 1.0, np.nan),
    ],
    ids=["none", "NaN", "too few", "zero", "constant", "too few and constant"],
)
def test_of_too_little_no_wave_is_estimated(residual: FloatArray) -> None:
    assert fit_wave(residual, 0.1, 1.0) is None


def test_no_wave_is_estimated_from_a_sensor_too_slow_for_any() -> None:
    white = np.random.default_rng(0).standard_normal(1000)
    assert fit_wave(white, 12.0, 1.0) is None
    assert fit_wave(white, 1.0, 1.0, lowest=3.0) is None
    assert fit_wave(white, 0.1, 1.0, frequency=0.3) is None  # five periods


def test_a_short_log_is_searched_above_six_periods_of_its_length() -> None:
    """A slow drift of a short log would be a wave otherwise."""
    result = fitted(np.random.default_rng(0).standard_normal(200), 0.1)
    assert result.frequency >= 6 * 2 * pi / 20
    assert not result.stands_out


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"dt_secs": 0.0}, "dt_secs is 0"),
        ({"dt_secs": np.nan}, "dt_secs, .*NaN"),
        ({"interval": 0.5}, "interval is 0.5; expected one number not below 1"),
        ({"lowest": 0.0}, "lowest is 0"),
        ({"frequency": -1.0}, "the wave's frequency is -1"),
        ({"std": 0.0}, "the wave's std is 0"),
        ({"damping": np.inf}, "the wave's damping, .* infinities"),
        ({"damping": 1.2}, "the wave's damping is 1.2; expected one of at most 1"),
        ({"frequency": 4.0, "interval": 10.0}, "sample every 1 s resolves none above 3.14"),
    ],
)
def test_what_is_out_of_range_is_refused(given: dict[str, float], reason: str) -> None:
    arguments = {"dt_secs": 0.1, "interval": 1.0} | given
    with pytest.raises(UsageError, match=reason):
        fit_wave(np.random.default_rng(0).standard_normal(500), **arguments)


def test_fifty_thousand_samples_cost_at_most_twenty_ordinates_each(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The time of a fit is that of its evaluations of the likelihood, each of all ordinates."""
    likelihood, ordinates = wave_fit.negative_log_likelihood, []

    def counted(spectrum: Spectrum, theta: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        ordinates.append(len(spectrum.omega))
        return likelihood(spectrum, theta)

    monkeypatch.setattr(wave_fit, "negative_log_likelihood", counted)
    residual = at_sea(10, 5000.0, 0.1, 0.8, 0.1, 1.0)
    residual.flags.writeable = False
    result = fitted(residual, 0.1)
    assert 0 < sum(ordinates) < 20 * len(residual)
    assert np.all(np.abs(log_errors(result, 0.8, 0.1, 1.0)) < np.log([1.03, 1.3, 1.1]))

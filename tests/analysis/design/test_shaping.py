import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from analysis.design.riccati import error_covariance, kalman_gain
from analysis.design.shaping import (
    TransferFunction,
    augment_with_shaping,
    shaped_variance,
    spectral_factor,
    wave_filter,
)
from shiplog import UsageError

# The example of the steady-state filter (methods.md): an aeroplane in Dryden gusts
SIGMA, L = 10.0, 3.49
DRYDEN = (
    2 * L * SIGMA**2 * np.array([3 * L**2, 0, 1]),
    np.array([L**4, 0, 2 * L**2, 0, 1]),
)
A0 = np.array([[-1.02, 0.91, -0.0022], [0.82, -1.08, -0.1756], [0, 0, -20.2]])  # and its actuator
B0 = np.array([[0], [0], [20.2]])
C0 = np.array([[15.87, 1.4811, 0], [0, 1, 0]])
G0 = np.array([0.00203, -0.00164, 0])
R = np.diag([1 / 20, 1 / 60])
PAPERS_ORDER = [0, 1, 3, 4, 2]  # the actuator's state last

GAIN = [
    [0.037291386349, -0.0040904051819],
    [-0.020228415532, 0.0028556367845],
    [1.905056158, -0.28749681147],
    [3.5991673289, -0.24567128353],
    [0, 0],
]
CLOSED = [
    [-1.6118143014, 0.8588581329],
    [1.1410249545, -1.0528953305],
    [-30.2332412278, -2.5340818642],
    [-57.1187855103, -5.0850554474],
]
POLES = [-20.2, -1.5223619944, -1.1734284197, -0.3758925864, -0.166092534]
VARIANCES = [1.2385261307e-4, 4.7593946409e-5, 0.66650359314, 1.6640445434, 0]
PRINTED_GAIN = [[0.0373, -0.0041], [-0.0202, 0.0029], [1.9051, -0.2875], [3.5992, -0.2457], [0, 0]]
PRINTED_CLOSED = [
    [-1.6118, 0.8589, 0.0266, 0.0044, -0.0022],
    [1.1410, -1.0529, -0.0215, -0.0036, -0.1756],
    [-30.2332, -2.5341, -0.5731, -0.0821, 0],
    [-57.1188, -5.0851, 1, 0, 0],
    [0, 0, 0, 0, -20.2],
]
PRINTED_POLES = [-20.2, -1.5224, -1.1734, -0.3759, -0.1661]

# Nomoto's yaw with its rudder's lag; a sensor of 2e-4 rad/s at 10 Hz, waves of 2e-4 rad/s²
YAW = np.array([[-1 / 20, 0.11 / 20], [0, -1 / 2.5]])
RUDDER, RATE = np.array([[0], [1 / 2.5]]), np.array([[1.0, 0]])
SENSOR, WAVE, OMEGA = 2e-4**2 * 0.1, 2e-4**2, 0.6


def test_spectral_factor_of_the_dryden_spectrum() -> None:
    H = spectral_factor(*DRYDEN)
    assert H.numerator == pytest.approx([13.1118179813, 2.1690864301], abs=1e-8)
    assert H.denominator == pytest.approx([1, 0.5730659026, 0.0821011322], abs=1e-8)


def test_variance_of_the_dryden_filter_is_twice_sigma_squared() -> None:
    assert shaped_variance(spectral_factor(*DRYDEN)) == pytest.approx(2 * SIGMA**2, abs=1e-8)


def test_kalman_filter_of_the_paper() -> None:
    plant = augment_with_shaping(A0, B0, C0, G0, spectral_factor(*DRYDEN))
    result = kalman_gain(plant.A, plant.G, plant.C, 1, R)
    gain = result.gain[PAPERS_ORDER]
    closed = (plant.A - result.gain @ plant.C)[np.ix_(PAPERS_ORDER, PAPERS_ORDER)]
    assert gain == pytest.approx(np.array(GAIN), abs=1e-8)
    assert closed[:4, :2] == pytest.approx(np.array(CLOSED), abs=1e-8)
    assert result.poles.real == pytest.approx(POLES, abs=1e-8)
    assert np.abs(result.poles.imag).max() == 0
    assert np.diag(result.covariance)[PAPERS_ORDER] == pytest.approx(VARIANCES, abs=1e-8)
    assert gain == pytest.approx(np.array(PRINTED_GAIN), abs=5e-5)
    assert closed == pytest.approx(np.array(PRINTED_CLOSED), abs=5e-5)
    assert result.poles.real == pytest.approx(PRINTED_POLES, abs=5e-5)
    assert plant.B[PAPERS_ORDER, 0] == pytest.approx([0, 0, 0, 0, 20.2])


def test_covariance_has_rank_four_because_the_actuator_has_no_noise() -> None:
    plant = augment_with_shaping(A0, B0, C0, G0, spectral_factor(*DRYDEN))
    P = kalman_gain(plant.A, plant.G, plant.C, 1, R).covariance
    assert np.linalg.matrix_rank(P) == 4


def test_wave_filter_lowers_the_error_of_the_white_noise_design_by_24_percent() -> None:
    plant = augment_with_shaping(YAW, RUDDER, RATE, [1, 0], wave_filter(WAVE, OMEGA))
    shaped = np.sqrt(kalman_gain(plant.A, plant.G, plant.C, 1, SENSOR).covariance[0, 0])

    def white(log_intensity: float) -> float:
        """Return the error in waves of the filter designed for white noise instead of waves."""
        K = kalman_gain(YAW, [[1], [0]], RATE, np.exp(log_intensity), SENSOR).gain
        K = np.vstack((K, np.zeros((2, 1))))
        return float(
            np.sqrt(error_covariance(plant.A, K, plant.C, plant.G @ plant.G.T, SENSOR)[0, 0])
        )

    best = minimize_scalar(white, bounds=(-25, -10), method="bounded").fun
    assert shaped == pytest.approx(7.52e-5, abs=5e-8)
    assert best == pytest.approx(9.92e-5, abs=5e-8)
    assert 1 - shaped / best == pytest.approx(0.24, abs=5e-3)


def test_wave_in_the_output_gives_a_notch() -> None:
    drift, wandering = np.array([[1.0], [0]]), 1e-10
    plant = augment_with_shaping(
        YAW, RUDDER, RATE, [1], wave_filter(WAVE, OMEGA), at="output", noise=drift
    )
    notch = kalman_gain(plant.A, plant.G, plant.C, np.diag([wandering, 1]), SENSOR).gain
    plain = kalman_gain(YAW, drift, RATE, wandering, SENSOR).gain

    def passed(A: np.ndarray, C: np.ndarray, gain: np.ndarray, omega: float) -> float:
        return float(abs(np.linalg.solve(1j * omega * np.eye(len(A)) - A + gain @ C, gain)[0, 0]))

    assert passed(plant.A, plant.C, notch, OMEGA) == pytest.approx(0.0128, abs=5e-5)
    assert passed(YAW, RATE, plain, OMEGA) > 0.15
    assert passed(plant.A, plant.C, notch, 1e-3) == pytest.approx(0.60, abs=0.01)


def test_wave_filter_has_the_requested_variance() -> None:
    assert shaped_variance(wave_filter(0.3, OMEGA, 0.07)) == pytest.approx(0.3, rel=1e-12)


def test_direct_feedthrough_drives_the_state_with_white_noise() -> None:
    plant = augment_with_shaping(
        [[-1]], [[1]], [[1]], [3], TransferFunction(np.array([2.0, 5]), np.array([1.0, 4]))
    )
    assert_allclose(plant.G, [[6], [1]])  # [G0 Dw; Bw]
    assert_allclose(plant.A, [[-1, 3 * (5 - 2 * 4)], [0, -4]])


def test_two_disturbances_are_added_in_turn() -> None:
    one = augment_with_shaping(YAW, RUDDER, RATE, [1, 0], wave_filter(WAVE, 0.6))
    two = augment_with_shaping(
        one.A, one.B, one.C, [1], wave_filter(WAVE, 0.9), at="output", noise=one.G
    )
    assert two.A.shape == (6, 6)
    assert_allclose(two.G.T, [[0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 1, 0]])
    assert two.C[0, 4:] == pytest.approx(wave_filter(WAVE, 0.9).numerator * [1, 0])


def spectrum_of(H: TransferFunction) -> tuple[np.ndarray, np.ndarray]:
    """Return |H(jω)|² as polynomials in ω."""

    def squared(p: np.ndarray) -> np.ndarray:
        at_jw = p * 1j ** np.arange(len(p) - 1, -1, -1)
        even = np.real(np.polymul(at_jw, np.conj(at_jw)))
        even[1::2] = 0
        return even

    return squared(H.numerator), squared(H.denominator)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    zeros=st.lists(st.floats(0.1, 3), max_size=2),
    pairs=st.lists(st.tuples(st.floats(0.05, 2), st.floats(0.1, 3)), min_size=1, max_size=2),
    notch=st.sampled_from([None, 0.0, 0.6]),
    gain=st.floats(1e-6, 1e6),
)
def test_spectral_factor_recovers_a_stable_minimum_phase_filter(
    zeros: list[float], pairs: list[tuple[float, float]], notch: float | None, gain: float
) -> None:
    denominator = np.array([1.0, 0.7])
    for decay, omega in pairs:
        denominator = np.polymul(denominator, [1, 2 * decay, decay**2 + omega**2])
    numerator = gain * np.atleast_1d(np.poly([-z for z in zeros]))
    if notch is not None and len(denominator) - len(numerator) >= 2:
        numerator = np.polymul(numerator, [1, 0, notch**2])
    H = spectral_factor(*spectrum_of(TransferFunction(numerator, denominator)))
    assert H.numerator == pytest.approx(numerator, rel=1e-5, abs=1e-5 * gain)
    assert H.denominator == pytest.approx(denominator, rel=1e-5)
    assert np.roots(H.denominator).real.max() < 0
    assert np.all(np.roots(H.numerator).real <= 1e-5)
    omega = np.array([0.01, 0.3, 1.0, 2.5, 40])
    power = np.abs(np.polyval(H.numerator, 1j * omega) / np.polyval(H.denominator, 1j * omega)) ** 2
    above, below = spectrum_of(TransferFunction(numerator, denominator))
    expected = np.polyval(above, omega) / np.polyval(below, omega)
    assert power == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())


@pytest.mark.parametrize(
    ("numerator", "denominator", "message"),
    [
        ([1, 0], [1, 0, 1], r"numerator, \(2,\), has odd powers"),
        ([1], [1, 1, 1], r"denominator, \(3,\), has odd powers"),
        ([1, 0, 1], [2], "numerator is of degree 2; expected no more"),
        ([1, 0, -1], [1, 0, 2, 0, 1], "numerator changes sign near ω = 1"),
        ([-1], [1, 0, 1], "negative at high ω"),
        ([1], [1, 0, -2, 0, 1], "denominator is zero at ω = 1"),
        ([1], [1, 0, 0], "denominator is zero at ω = 0"),
        ([np.nan], [1, 0, 1], r"numerator, \(1,\), has NaN"),
        ([0], [1, 0, 1], "numerator is of shape .* not all zero"),
    ],
)
def test_invalid_spectrum_raises_an_error(
    numerator: ArrayLike, denominator: ArrayLike, message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        spectral_factor(numerator, denominator)


WHITE = TransferFunction(np.array([1.0, 2]), np.array([1.0, 1]))
UNSTABLE = TransferFunction(np.array([1.0]), np.array([1.0, -1]))
IMPROPER = TransferFunction(np.array([1.0, 0, 0]), np.array([1.0, 1]))


def test_invalid_shaping_filter_raises_an_error() -> None:
    def to_output(H: TransferFunction) -> None:
        augment_with_shaping(YAW, RUDDER, RATE, [1], H, at="output")

    with pytest.raises(UsageError, match="passes white noise to the output; give that to R"):
        to_output(WHITE)
    with pytest.raises(UsageError, match="a pole at 1; expected a stable one"):
        to_output(UNSTABLE)
    with pytest.raises(UsageError, match="the degrees 2 over 1"):
        to_output(IMPROPER)
    with pytest.raises(UsageError, match="passes white noise; expected a strictly proper one"):
        shaped_variance(WHITE)
    with pytest.raises(UsageError, match=r"G is of shape \(3, 1\); expected \(2, 1\)"):
        augment_with_shaping(YAW, RUDDER, RATE, [1, 0, 0], WHITE)
    with pytest.raises(UsageError, match=r"noise is of shape \(1, 2\); expected \(2, any\)"):
        augment_with_shaping(YAW, RUDDER, RATE, [1, 0], WHITE, noise=[[1, 0]])
    with pytest.raises(UsageError, match="frequency is -1"):
        wave_filter(1, -1)


def test_dryden_factor_in_closed_form() -> None:
    """H(s) = σ√(6/L)·(s + 1/(L√3))/(s + 1/L)²."""
    H = spectral_factor(*DRYDEN)
    size = SIGMA * np.sqrt(6 / L)
    assert H.numerator == pytest.approx([size, size / (L * np.sqrt(3))], rel=1e-12)
    assert H.denominator == pytest.approx([1, 2 / L, 1 / L**2], rel=1e-12)


def test_two_misprints_of_the_paper_differ_by_whole_numbers() -> None:
    plant = augment_with_shaping(A0, B0, C0, G0, spectral_factor(*DRYDEN))
    result = kalman_gain(plant.A, plant.G, plant.C, 1, R)
    assert result.gain[PAPERS_ORDER][3, 1] - 2 == pytest.approx(-2.2457, abs=5e-5)
    assert result.poles[-1].real - 1 == pytest.approx(-1.1661, abs=5e-5)
    # both follow from F = A - L C, whose trace is the sum of its poles
    (_, printed), (sensed, _) = PRINTED_CLOSED[3][:2], PRINTED_GAIN[3]
    assert -sensed * C0[0, 1] - printed == pytest.approx(PRINTED_GAIN[3][1], abs=1e-4)
    printed_trace = sum(PRINTED_CLOSED[k][k] for k in range(5))
    assert printed_trace == pytest.approx(sum(PRINTED_POLES), abs=3e-4)

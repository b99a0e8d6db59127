import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from analysis.design.exosystem import (
    DisturbanceInput,
    Exosystem,
    Plant,
    ambiguities,
    disturbance_observer,
)
from analysis.design.luenberger import butterworth_poles
from analysis.design.noise_placement import place_for_noise
from analysis.design.placement import polynomial_error
from analysis.design.riccati import error_covariance
from shiplog import UsageError

CONSTANT, RAMP = Exosystem.polynomial(0), Exosystem.polynomial(1)
WAVE, OTHER_WAVE = Exosystem.harmonic(0.6), Exosystem.harmonic(0.8)


def plant(A: list, C: list, states: str, sensors: str) -> Plant:
    n = len(A)
    return Plant(np.array(A, float), np.eye(n, 1), np.array(C, float), tuple(states.split()),
                 tuple(sensors.split()))  # fmt: skip


INTEGRATOR = plant([[0]], [[1]], "w", "gyro")
NOMOTO = plant([[-1 / 20]], [[1]], "w", "gyro")
HEADING_AND_RATE = plant([[0, 1], [0, -1 / 20]], [[1, 0], [0, 1]], "psi w", "compass gyro")
HEADING = plant([[0, 1], [0, -1 / 20]], [[1, 0]], "psi w", "compass")
YAW_AND_SURGE = plant([[-1 / 20, 0], [0, -0.004]], [[1, 0], [0, 1]], "w v", "gyro log")


def moment(exosystem: Exosystem, name: str = "moment") -> DisturbanceInput:
    return DisturbanceInput(name, exosystem, on_state={"w": 1.0})


def bias(sensor: str = "gyro", exosystem: Exosystem = CONSTANT) -> DisturbanceInput:
    return DisturbanceInput(f"{sensor} error", exosystem, on_sensor={sensor: 1.0})


FORCE = DisturbanceInput("force", CONSTANT, on_state={"v": 1.0})


# methods, section 4; for unobservable cases the ambiguity, its mode and the remedies
TABLE = [
    # plant, disturbances, ambiguity (none if observable), mode, remedies
    (INTEGRATOR, [moment(CONSTANT)], None, None, None),
    (INTEGRATOR, [moment(RAMP)], None, None, None),
    (INTEGRATOR, [bias()], ["gyro error"], 0, ["w", "∫w"]),
    (NOMOTO, [moment(CONSTANT)], None, None, None),
    (NOMOTO, [bias()], None, None, None),
    (NOMOTO, [moment(CONSTANT), bias()], ["moment", "gyro error"], 0, ["w", "∫w"]),
    (NOMOTO, [moment(WAVE), bias()], None, None, None),
    (NOMOTO, [moment(CONSTANT), bias(exosystem=WAVE)], None, None, None),
    (NOMOTO, [moment(WAVE), moment(OTHER_WAVE, "second")], None, None, None),
    (NOMOTO, [moment(WAVE), bias(exosystem=OTHER_WAVE)], None, None, None),
    (NOMOTO, [moment(WAVE), bias(exosystem=WAVE)], ["moment", "gyro error"], 0.6j, ["w", "∫w"]),
    (HEADING_AND_RATE, [moment(CONSTANT), bias()], None, None, None),
    (HEADING_AND_RATE, [moment(RAMP), bias()], None, None, None),
    (HEADING_AND_RATE, [moment(CONSTANT), bias(), bias("compass")], ["compass error"], 0, ["psi"]),
    (HEADING_AND_RATE, [moment(RAMP), bias(), bias("compass")], ["compass error"], 0, ["psi"]),
    (HEADING, [moment(CONSTANT)], None, None, None),
    (HEADING, [moment(CONSTANT), bias("compass")], ["compass error"], 0, ["psi"]),
    (YAW_AND_SURGE, [moment(CONSTANT), FORCE], None, None, None),
    (YAW_AND_SURGE, [moment(CONSTANT), FORCE, bias()], ["moment", "gyro error"], 0, ["w", "∫w"]),
]  # fmt: skip
REMEDY_TEXTS = {"w": "'w' by a sensor of its own", "∫w": "the integral of 'w'"}
REMEDY_TEXTS["psi"] = "'psi' by a sensor of its own"


@pytest.mark.parametrize(("ship", "disturbances", "ambiguous", "mode", "remedies"), TABLE)
def test_ambiguities_and_their_remedies(
    ship: Plant, disturbances: list, ambiguous: list | None, mode: complex, remedies: list
) -> None:
    if ambiguous is None:
        observer = disturbance_observer(ship, disturbances, frequency=0.1)
        F = observer.A - observer.L @ observer.C
        assert polynomial_error(F, observer.poles) < 1e-9
        assert ambiguities(ship, disturbances) == ()
        return
    (ambiguity,) = ambiguities(ship, disturbances)
    assert ambiguity.mode == pytest.approx(mode, abs=1e-12)
    assert list(ambiguity.disturbances) == ambiguous
    assert list(ambiguity.remedies) == [REMEDY_TEXTS[cure] for cure in remedies]
    with pytest.raises(UsageError) as raised:
        disturbance_observer(ship, disturbances, frequency=0.1)
    message = str(raised.value)
    for word in (*map(repr, ambiguous), *ambiguity.remedies, "0 ± 0.6j" if mode else "mode 0 "):
        assert word in message
    assert "\n" not in message


def test_remedies_remove_the_ambiguity() -> None:
    both = [moment(CONSTANT), bias()]
    second_gyro = plant([[-1 / 20]], [[1], [1]], "w", "gyro second")
    assert ambiguities(NOMOTO, both) != ()
    assert ambiguities(second_gyro, both) == ambiguities(HEADING_AND_RATE, both) == ()


def test_indistinguishable_disturbances_are_named() -> None:
    twice = [moment(CONSTANT), moment(CONSTANT, "again")]
    with pytest.raises(
        UsageError, match="'moment' and 'again' cannot be distinguished; measure 'mom"
    ):
        disturbance_observer(NOMOTO, twice, frequency=0.1)
    blind = plant([[-0.1, 0], [0, -0.2]], [[1, 0]], "w v", "gyro")
    with pytest.raises(UsageError, match=r"at the mode -0.2 the state 'v' cannot be seen; meas"):
        disturbance_observer(blind, [moment(CONSTANT)], frequency=0.1)


def roll(inertia: float) -> tuple[Plant, list[DisturbanceInput]]:
    ship = plant([[0]], [[1]], "w", "gyro")
    return ship, [DisturbanceInput("moment", RAMP, on_state={"w": 1 / inertia})]


@pytest.mark.parametrize(
    ("spectrum", "gain", "poles"),
    [
        ("butterworth", [0.1, 5, 0.125], [-0.05, -0.025 + 0.0433012702j, -0.025 - 0.0433012702j]),
        ("binomial", [0.15, 7.5, 0.125], [-0.05, -0.05, -0.05]),
    ],
)
def test_gains_and_poles_of_the_roll_example(spectrum: str, gain: list, poles: list) -> None:
    observer = disturbance_observer(*roll(1000.0), spectrum, frequency=0.05)
    assert pytest.approx(np.array([[0, 1e-3, 0], [0, 0, 1], [0, 0, 0]])) == observer.A
    assert observer.L[:, 0] == pytest.approx(gain, abs=1e-9)
    assert np.sort_complex(observer.poles) == pytest.approx(np.sort_complex(poles), abs=1e-9)
    assert observer.names == ("moment",)
    assert observer.states == ("w", "moment[0]", "moment[1]")
    assert observer.D.tolist() == [[0, 1, 0]]


@pytest.mark.parametrize(
    ("secs", "error"),
    [
        (10, [0.00162188, 0.24839095, 0.00381586]),
        (20, [0.00194248, 0.18202279, 0.00148585]),
        (50, [0.00023189, -0.03536208, -0.00296346]),
        (100, [-0.00041987, -0.0264498, -0.00032335]),
    ],
)
def test_estimation_errors_of_the_roll_example(secs: float, error: list) -> None:
    observer = disturbance_observer(*roll(1000.0), frequency=0.05)
    F = observer.A - observer.L @ observer.C
    assert expm(F * secs) @ [0, 0.25, 0.005] == pytest.approx(error, abs=1e-8)


@pytest.mark.parametrize(
    ("spectrum", "of_the_moment_then", "of_the_first", "noise"),
    [("butterworth", 94.7, 108.5, (1, 1)), ("binomial", 46.7, 96.3, (1.08, 0.75))],
)
def test_settling_time_of_the_roll_example(
    spectrum: str, of_the_moment_then: float, of_the_first: float, noise: tuple
) -> None:
    times = np.arange(0, 400, 0.05)
    moment_then = 0.25 + 0.005 * times
    stds = {}
    for name in ("butterworth", spectrum):
        observer = disturbance_observer(*roll(1000.0), name, frequency=0.05)
        F = observer.A - observer.L @ observer.C
        P = control.lyap(F, observer.L @ observer.L.T)
        stds[name] = np.sqrt(np.diag(P))[1:]
    step, x = expm(F * 0.05), np.array([0, 0.25, 0.005])
    error = np.array([abs(x[1])] + [abs((x := step @ x)[1]) for _ in times[1:]])
    settling_times = [
        times[np.flatnonzero(error > 0.05 * of)[-1] + 1] for of in (moment_then, 0.25)
    ]
    assert settling_times == pytest.approx([of_the_moment_then, of_the_first], abs=0.051)
    assert stds[spectrum] / stds["butterworth"] == pytest.approx(noise, abs=0.005)


def test_design_with_an_inertia_of_1e12() -> None:
    observer = disturbance_observer(*roll(1e12), frequency=0.05)
    assert observer.L[:, 0] == pytest.approx([0.1, 5e9, 1.25e8], rel=1e-12)
    specific = disturbance_observer(*roll(1.0), frequency=0.05)
    assert specific.L[:, 0] == pytest.approx([0.1, 5e-3, 1.25e-4], rel=1e-12)


def test_observer_of_yaw_with_ramp_moment_and_wave() -> None:
    poles = [*butterworth_poles(3, 0.1), *butterworth_poles(2, 0.4)]
    observer = disturbance_observer(NOMOTO, [moment(RAMP), moment(WAVE, "wave")], poles)
    assert observer.L[:, 0] == pytest.approx(
        [0.71568542, 0.01046024, 0.00044444, -0.07732315, -0.38629581], abs=1e-8
    )
    assert observer.names == ("moment", "wave")


def test_yaw_and_surge_are_separate_channels() -> None:
    both = disturbance_observer(YAW_AND_SURGE, [moment(RAMP), FORCE], frequency=[0.05, 0.1])
    assert both.channels == ((0, 2, 3), (1, 4))
    assert both.L[[1, 4], 1] == pytest.approx([0.13742136, 0.01], abs=1e-8)
    alone = disturbance_observer(NOMOTO, [moment(RAMP)], frequency=0.05)
    assert both.L[[0, 2, 3], 0] == pytest.approx(alone.L[:, 0], rel=1e-12)
    assert not both.L[[0, 2, 3], 1].any()
    assert not both.L[[1, 4], 0].any()
    cut = [-1 + 1j, -1, -1, -1 - 1j, -1]
    with pytest.raises(UsageError, match=r"spectrum of channel 1, \(3,\), have .* without its"):
        disturbance_observer(YAW_AND_SURGE, [moment(RAMP), FORCE], cut)
    given_poles = [*butterworth_poles(3, 0.05), *butterworth_poles(2, 0.1)]
    same = disturbance_observer(YAW_AND_SURGE, [moment(RAMP), FORCE], given_poles)
    assert pytest.approx(both.L, rel=1e-12) == same.L


def test_kalman_design_equals_the_kalman_gain_of_the_augmented_plant() -> None:
    Q, R = [0, 1e-9, 1e-6, 1e-8], [1e-5, 2e-4]
    observer = disturbance_observer(
        HEADING_AND_RATE, [moment(CONSTANT), bias()], "kalman", state_noise=Q, sensor_noise=R
    )
    L, _, poles = control.lqe(observer.A, np.eye(4), observer.C, np.diag(Q), np.diag(R))
    assert pytest.approx(L, rel=1e-6) == observer.L
    assert np.sort_complex(observer.poles) == pytest.approx(np.sort_complex(poles), rel=1e-6)


def test_poles_are_placed_with_the_least_noise_where_the_sensors_noise_is_given() -> None:
    R = [1e-5, 2e-7]
    plain, quiet = (
        disturbance_observer(
            HEADING_AND_RATE, [moment(CONSTANT), bias()], frequency=0.1, sensor_noise=noise
        )
        for noise in (None, R)
    )
    expected = place_for_noise(quiet.A, quiet.C, quiet.poles, np.zeros((4, 4)), np.diag(R))
    assert np.array_equal(quiet.L, expected.gain)
    assert polynomial_error(quiet.A - quiet.L @ quiet.C, quiet.poles) < 1e-12
    variances = [
        np.diag(error_covariance(quiet.A, L, quiet.C, np.zeros((4, 4)), np.diag(R)))
        for L in (plain.L, quiet.L)
    ]
    assert np.log(variances[1] / variances[0]).mean() < -1


def test_kalman_design_of_a_constant_without_noise_raises_an_error() -> None:
    with pytest.raises(UsageError, match=r"mode at 0.* no noise drives it"):
        disturbance_observer(
            NOMOTO, [moment(CONSTANT)], "kalman", state_noise=[1.0, 0], sensor_noise=[1.0]
        )


def test_disturbance_on_state_and_sensor() -> None:
    sea = DisturbanceInput("sea", WAVE, on_state={"w": 0.5}, on_sensor={"gyro": 2.0})
    observer = disturbance_observer(NOMOTO, [sea], frequency=0.3)
    assert observer.A[0].tolist() == [-1 / 20, 0.5, 0]
    assert observer.C.tolist() == [[1, 2, 0]]


@settings(derandomize=True, max_examples=40, deadline=None)
@given(
    st.floats(-2, 2),
    st.floats(-3, 3),
    st.integers(0, 3),
    st.lists(st.floats(-3, 3), min_size=8, max_size=8),
)
def test_output_of_an_exosystem_is_an_exponential_times_a_polynomial(
    sigma: float, omega: float, degree: int, start: list
) -> None:
    exosystem = Exosystem.exponential(complex(sigma, omega), degree)
    x0 = np.array(start[: len(exosystem.Ac)])
    times = np.linspace(0, 1, 20)
    out = np.array([(exosystem.Cc @ expm(exosystem.Ac * t) @ x0)[0] for t in times])
    shapes = [times**k * np.exp(sigma * times) for k in range(degree + 1)]
    if omega:
        shapes = [s * turn(omega * times) for s in shapes for turn in (np.cos, np.sin)]
    fitted = np.linalg.lstsq(np.array(shapes).T, out, rcond=1e-13)[0] @ np.array(shapes)
    assert fitted == pytest.approx(out, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A": np.eye(1, 2)}, r"A is of shape \(1, 2\); expected a square matrix"),
        ({"B": np.ones((2, 1))}, r"B is of shape \(2, 1\); expected \(1, any\)"),
        ({"C": [[1.0, 0]]}, r"C is of shape \(1, 2\); expected \(any, 1\)"),
        ({"A": [[np.nan]]}, r"A, \(1, 1\), has NaN or infinities"),
        ({"states": ("a", "b")}, "states are a, b; expected 1 different names"),
        ({"sensors": ()}, "sensors are ; expected 1 different names"),
        (
            {"disturbances": [bias("compass")]},
            "'compass error' acts on the sensor 'compass'; the pl",
        ),
        ({"disturbances": [moment(RAMP)] * 2}, "disturbances are moment, moment; expected differ"),
        ({"disturbances": [moment(Exosystem(np.eye(2), np.ones((1, 3))))]}, "Cc of 'moment' is of"),
        ({"disturbances": [moment(Exosystem(np.ones((2, 3)), np.ones((1, 3))))]}, "Ac of 'moment'"),
        ({"spectrum": "bessel"}, "spectrum is 'bessel'; expected butterworth, binomial, kalman"),
        ({"spectrum": [-1, -2, -3]}, "3 poles are given; expected 2, one for each state"),
        (
            {"spectrum": [-1 + 1j, -2]},
            r"spectrum of channel 1, \(2,\), have -1\+1j without its conjugate",
        ),
        ({"spectrum": [-1, 0.0]}, r"spectrum of channel 1, \(2,\), go up to 0; expected neg"),
        ({"frequency": None}, "frequency is missing; butterworth poles need one"),
        ({"frequency": -1.0}, "frequency is -1.0; expected a positive one"),
        ({"frequency": [1.0, 2.0]}, "one for each of the 1 channels"),
        (
            {"spectrum": "kalman"},
            r"state_noise is missing; the gain depends on its intensities, \(2,\)",
        ),
        ({"state_noise": [1.0, 1.0]}, r"sensor_noise is missing; the gain .*, \(1,\)"),
        ({"sensor_noise": [0.0]}, r"R, \(1, 1\), has the eigenvalue 0; expected a positive def"),
        (
            {"spectrum": "kalman", "state_noise": [1.0], "sensor_noise": [1.0]},
            r"state_noise is of shape \(1,\); expected \(2,\)",
        ),
    ],
)
def test_invalid_arguments_raise_a_one_line_error(change: dict, message: str) -> None:
    fields = {name: getattr(NOMOTO, name) for name in ("A", "B", "C", "states", "sensors")}
    ship = Plant(**{name: change.get(name, value) for name, value in fields.items()})
    request = {"disturbances": [moment(CONSTANT)], "frequency": 0.1}
    request |= {name: value for name, value in change.items() if name not in fields}
    with pytest.raises(UsageError, match=message) as raised:
        disturbance_observer(ship, **request)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Exosystem.polynomial(-1), "degree is -1; expected a whole number from 0"),
        (lambda: Exosystem.polynomial(0.5), "degree is 0.5"),
        (lambda: Exosystem.harmonic(0.0), "omega is 0.0"),
        (lambda: Exosystem.exponential(np.nan), "rate.*NaN"),
    ],
)
def test_invalid_exosystem_raises_an_error(make: object, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        make()


@pytest.mark.parametrize("I", [1.0, 1000.0])
@pytest.mark.parametrize("omega", [0.02, 0.05, 0.3])
def test_gains_of_the_roll_example_in_closed_form(I: float, omega: float) -> None:
    formulas = {
        "butterworth": [2 * omega, 2 * I * omega**2, I * omega**3],
        "binomial": [3 * omega, 3 * I * omega**2, I * omega**3],
    }
    for spectrum, gain in formulas.items():
        observer = disturbance_observer(*roll(I), spectrum, frequency=omega)
        assert observer.L[:, 0] == pytest.approx(gain, rel=1e-12)
        polynomial = np.poly(observer.A - observer.L @ observer.C)
        expected = [1, gain[0], gain[1] / I, gain[2] / I]
        assert polynomial == pytest.approx(expected, rel=1e-9)


def test_unscaled_rank_test_fails_for_an_inertia_of_1e12() -> None:
    """With an inertia of 1e16 even a threshold of one rounding error fails."""
    for inertia, tolerance in ((1e12, 1e-10), (1e16, None)):
        ship, disturbances = roll(inertia)
        observer = disturbance_observer(ship, disturbances, frequency=0.05)
        powers = [np.linalg.matrix_power(observer.A, k) for k in range(3)]
        shown = np.vstack([observer.C @ power for power in powers])
        assert np.linalg.matrix_rank(shown, tolerance) < 3
        assert ambiguities(ship, disturbances) == ()


def test_complex_rate_gives_two_by_two_blocks() -> None:
    """Ac = λI + N of size d + 1, N being the shift matrix, and Cc = [1 0 …]."""
    ramp = Exosystem.exponential(-0.3, 2)
    assert ramp.Ac.tolist() == (-0.3 * np.eye(3) + np.eye(3, k=1)).tolist()
    assert ramp.Cc.tolist() == [[1, 0, 0]]
    wave = Exosystem.exponential(-0.1 + 0.6j)
    assert wave.Ac.tolist() == [[-0.1, 0.6], [-0.6, -0.1]]
    assert Exosystem.polynomial(1).Ac.tolist() == [[0, 1], [0, 0]]


@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.floats(0.01, 0.5), st.floats(0.2, 1.5), st.floats(0.05, 0.5), st.integers(0, 4))
def test_poles_match_the_request_for_any_plant_and_wave(
    decay: float, wave: float, frequency: float, which: int
) -> None:
    ship = plant([[-decay]], [[1]], "w", "gyro")
    harmonic = Exosystem.harmonic(wave)
    asked = [
        [moment(RAMP)],
        [moment(RAMP), moment(harmonic, "wave")],
        [moment(CONSTANT), bias(exosystem=harmonic)],
        [moment(harmonic, "wave"), bias()],
        [moment(Exosystem.exponential(-0.05, 1)), bias(exosystem=harmonic)],
    ][which]
    for spectrum in ("butterworth", "binomial"):
        observer = disturbance_observer(ship, asked, spectrum, frequency=frequency)
        assert polynomial_error(observer.A - observer.L @ observer.C, observer.poles) < 1e-9

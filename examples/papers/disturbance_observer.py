"""Comparison of the disturbance observer's paper with the values computed by shiplog.

The paper: "Algorithm of ship course control system watcher for assessing disturbances and noise
measurements", issue 6 (40) of 2016, pages 221 ff. Prints docs/papers_disturbance_observer.md and
draws its pictures.
"""

from collections.abc import Iterator

import matplotlib.pyplot as plt
import numpy as np
from markdown_page import (
    BLUE,
    GREY,
    RED,
    Row,
    comparison,
    number,
    paragraph,
    picture,
    start_page,
    table,
)
from matplotlib.axes import Axes
from scipy.integrate import solve_ivp
from scipy.linalg import expm, null_space, solve_continuous_lyapunov
from scipy.signal import place_poles

from analysis.design.exosystem import (
    DisturbanceInput,
    DisturbanceObserver,
    Exosystem,
    Plant,
    ambiguities,
    disturbance_observer,
)
from analysis.design.noise_placement import place_for_noise
from analysis.design.observability import ComplexArray
from analysis.design.placement import format_mode
from analysis.design.riccati import error_covariance, kalman_gain
from shiplog.types import FloatArray

INERTIA, MOMENT, SLOPE, OMEGA = 1000.0, 0.25, 5e-3, 0.05  # kg m², N m, N m/s, 1/s
DT = 0.01
SENSOR_NOISE = np.diag(np.radians([0.5, 0.004]) ** 2 * 0.1)  # intensities of compass and gyro
STATE_NOISE = np.diag([0, 0, 0, 1e-16, 1e-14])  # of ψ, ω, moment, slope and gyro error
TIMES = np.arange(0, 200 + DT / 2, DT)
TRUTH = {"M": MOMENT + SLOPE * TIMES, "v": np.full_like(TIMES, SLOPE)}  # N m and N m/s
INTRODUCTION = """\
*Algorithm of ship course control system watcher for assessing disturbances and noise measurements*,
issue 6 (40) of 2016, pages 221 ff. This page is made by

    python examples/papers/disturbance_observer.py > docs/papers_disturbance_observer.md

The paper has no table. Its numbers are the formulas of the gain, the parameters of one example (the
roll of a ship with measured roll rate and a moment that grows linearly), two figures and the
sentence "the transient takes no more than 100 s". Our copy is a scan that shows the captions of the
figures but not their curves; our curves can only be compared with the text of the paper.

Equations (1) and (3) to (8) are correct as printed; the errors are listed below. The example:
I = 1000 kg·m², M(0) = 0.25 N·m, v = 0.005 N·m/s, Ω0 = 0.05 1/s. Our estimates start from zero.

A deviation in bold is larger than the rounding of the printed value."""


CONSTANT, RAMP = Exosystem.polynomial(0), Exosystem.polynomial(1)
WAVE, OTHER_WAVE = Exosystem.harmonic(0.6), Exosystem.harmonic(0.8)  # rad/s


def plant(A: list[list[float]], C: list[list[float]], states: str, sensors: str) -> Plant:
    """Return a plant with one input, which acts on its last state.

    Parameters
    ----------
    A, C
        The matrices, (n, n) and (m, n).
    states, sensors
        Their names, separated by spaces.
    """
    B = np.eye(len(A))[:, -1:]
    return Plant(np.array(A), B, np.array(C), tuple(states.split()), tuple(sensors.split()))


INTEGRATOR = plant([[0.0]], [[1.0]], "ω", "gyro")
NOMOTO = plant([[-0.05]], [[1.0]], "ω", "gyro")
BOTH = plant([[0.0, 1.0], [0.0, -0.05]], [[1.0, 0.0], [0.0, 1.0]], "ψ ω", "compass gyro")
HEADING = plant([[0.0, 1.0], [0.0, -0.05]], [[1.0, 0.0]], "ψ ω", "compass")


def moment(exosystem: Exosystem, name: str = "moment", inertia: float = 1.0) -> DisturbanceInput:
    """Return a moment with the given exosystem that acts on the rate ω."""
    return DisturbanceInput(name, exosystem, on_state={"ω": 1 / inertia})


def error(sensor: str, exosystem: Exosystem = CONSTANT) -> DisturbanceInput:
    """Return an additive error of a sensor with the given exosystem."""
    return DisturbanceInput(f"{sensor} error", exosystem, on_sensor={sensor: 1.0})


def roll(spectrum: str) -> DisturbanceObserver:
    """Design the observer of the paper's example, with a given pattern of poles."""
    disturbances = [moment(RAMP, inertia=INERTIA)]
    return disturbance_observer(INTEGRATOR, disturbances, spectrum, frequency=OMEGA)


def errors(observer: DisturbanceObserver) -> FloatArray:
    """Compute the errors, truth minus estimate, of an observer that starts from zero.

    Returns
    -------
    FloatArray
        The errors of ω (rad/s), M (N m) and v (N m/s) at `TIMES`, (count, 3).
    """
    step = expm((observer.A - observer.L @ observer.C) * DT)
    result = np.empty((len(TIMES), 3))
    result[0] = 0, MOMENT, SLOPE
    for k in range(1, len(TIMES)):
        result[k] = step @ result[k - 1]
    return result


def printed_observer(L: FloatArray) -> FloatArray:
    """Integrate (5), (6) and (8) as printed; return the errors (count, 3) as `errors` does."""
    l1, l2, l3 = L

    def rate(t: float, x: FloatArray) -> FloatArray:
        w, M, v, w_hat, M_hat, v_hat = x
        u = 0.3 * np.cos(0.1 * t)  # any input: it cancels in the errors
        return np.array(
            [
                (M + u) / INERTIA,
                v,
                0,
                -l1 * w_hat + M_hat / INERTIA + l1 * w + u / INERTIA,
                -l2 * w_hat + v_hat + l2 * w,
                -l3 * w_hat + l3 * w,
            ]
        )

    start = np.array([0, MOMENT, SLOPE, 0, 0, 0])
    x = solve_ivp(rate, (0.0, float(TIMES[-1])), start, "DOP853", TIMES, rtol=1e-12, atol=1e-15).y.T
    result: FloatArray = x[:, :3] - x[:, 3:]
    return result


def settling_time(error: FloatArray, reference: FloatArray | float) -> float:
    """Return the time, s, after which the error stays within 5 % of the reference."""
    return float(TIMES[np.flatnonzero(np.abs(error) > 0.05 * np.abs(reference))[-1] + 1])


def noise_stds(observer: DisturbanceObserver) -> FloatArray:
    """Compute the standard deviations (3,) of the errors, for white noise of intensity 1 on ω."""
    P = solve_continuous_lyapunov(observer.A - observer.L @ observer.C, -observer.L @ observer.L.T)
    return np.sqrt(np.diag(P))


def format_poles(poles: ComplexArray) -> str:
    """Format poles for a table, each conjugate pair once."""
    upper = [pole for pole in np.sort_complex(poles) if pole.imag >= 0]
    return ", ".join(format_mode(pole) for pole in upper).replace("-", "−").replace("j", " j")


def design(butterworth: DisturbanceObserver, binomial: DisturbanceObserver) -> Iterator[Row]:
    """Compare the gain and its poles with the paper, and (8) with the observer of this gain."""
    for k, (formula, value, unit) in enumerate(
        (("2 Ω0", "0.1", "1/s"), ("2 I Ω0²", "5", "N·m"), ("I Ω0³", "0.125", "N·m/s")), 1
    ):
        remark = f"= {formula}: the paper prints the formula, not its value"
        yield Row(f"l{k}, {unit}", value, round(float(butterworth.L[k - 1, 0]), 12), remark)
    yield Row(
        "poles of A − L C, 1/s",
        "roots of s³ + 2 Ω0 s² + 2 Ω0² s + Ω0³",
        format_poles(butterworth.poles),
        "those of a Butterworth filter",
    )
    yield Row(
        '"binomial filtering": l1, l2, l3',
        "0.1, 5, 0.125",
        ", ".join(f"{x:g}" for x in binomial.L[:, 0]),
        "wrong name: binomial is (s + Ω0)³; shiplog has both",
    )
    difference = np.abs(printed_observer(butterworth.L[:, 0]) - errors(butterworth)).max(axis=0)
    yield Row(
        "(8) integrated, minus e^((A − L C) t) e(0): M, N·m",
        "0",
        f"{difference[1]:.0e}".replace("-", "−"),
        "(8) is correct as printed for any known moment u; the rest is the error of integration",
    )


def transients(butterworth: DisturbanceObserver, binomial: DisturbanceObserver) -> Iterator[Row]:
    """Compare the settling time with the paper, by each criterion that it could mean."""
    criteria = (
        ("M, 5 % of M(t)", 1, TRUTH["M"], "the only criterion by which the sentence is true"),
        ("M, 5 % of M(0)", 1, MOMENT, "the usual criterion: longer than the paper states"),
        ("v, 5 % of v", 2, SLOPE, "the quantity of its second figure: also longer"),
    )
    for observer, name in ((butterworth, "Butterworth"), (binomial, "binomial")):
        e = errors(observer)
        for criterion, k, reference, remark in criteria:
            printed = "≤ 100 = 5 / Ω0" if observer is butterworth else None
            note = remark if observer is butterworth else "not in the paper"
            yield Row(
                f"{name}: {criterion}, s",
                printed,
                round(settling_time(e[:, k], reference), 1),
                note,
            )
    ratio = noise_stds(binomial) / noise_stds(butterworth)
    for k, name in ((1, "M"), (2, "v")):
        yield Row(
            f"noise in {name}, binomial over Butterworth",
            None,
            round(float(ratio[k]), 3),
            "ratio of standard deviations, for white noise of the gyro",
        )


def estimates(butterworth: DisturbanceObserver) -> Iterator[tuple[str, ...]]:
    """List values of the curves, for comparison with the figures of the printed paper."""
    e = errors(butterworth)
    for secs in (0, 10, 20, 50, 100, 150):
        k = round(secs / DT)
        M, v = TRUTH["M"][k], SLOPE
        numbers = (M, M - e[k, 1], e[k, 1]), (1e3 * v, 1e3 * (v - e[k, 2]), 1e3 * e[k, 2])
        cells = [f"{number:.4f}" for group in numbers for number in group]
        yield tuple(cell.replace("-", "−") for cell in (str(secs), *cells))


def claims(butterworth: DisturbanceObserver) -> Iterator[Row]:
    """Check the statements of the paper that have no number."""
    yield Row("size of y_c = col{f, v}, after (2)", "n_c + l", "n + l", "f is (n,), v is (l,)")
    yield Row("size of (x, x_c), before (3)", "n × n_c", "n + n_c", "correct in the text after (4)")
    for output, name in ((np.eye(3)[[1]], "M"), (np.eye(3)[[2]], "v")):
        unobservable = [("ω", "M", "v")[k] for k in unobservable_states(butterworth.A, output)]
        yield Row(
            f'"one of the three states as output" restores all: {name}',
            "yes",
            f"no: {' and '.join(unobservable)} unobservable",
            "it does not depend on the states that it drives; only ω observes all three",
        )
    e = errors(butterworth)
    crossings = [
        ", ".join(f"{TIMES[k]:.1f}" for k in np.flatnonzero(np.diff(np.sign(e[1:, i]))) + 1)
        for i in (1, 2)
    ]
    yield Row(
        '"instants of switching" in both figures',
        "visible in the figures",
        "none",
        "L is constant and the errors are smooth; they only change sign, that of M at"
        f" {crossings[0]} s, that of v at {crossings[1]} s",
    )
    fast = disturbance_observer(INTEGRATOR, [moment(RAMP, inertia=INERTIA)], frequency=2 * OMEGA)
    noise_ratio = noise_stds(fast) / noise_stds(butterworth)
    yield Row(
        '"optimal in speed", "least time"',
        "yes",
        "no",
        f"Ω0 = 0.1 1/s settles in {settling_time(errors(fast)[:, 1], MOMENT):.1f} s instead of"
        f" {settling_time(e[:, 1], MOMENT):.1f} s, at {noise_ratio[1]:.1f} times the noise in M:"
        " only noise limits the speed, and the design does not consider it",
    )
    ambiguity = ambiguities(INTEGRATOR, [error("gyro")])[0]
    yield Row(
        "Fig. 2: noise of the measurement, v(t) of (1)",
        "estimated",
        "not in the example",
        "v is the slope of M in (6), but the noise of the sensor in (1); (7) has C_v = 0. With a"
        f" constant error of the gyro added: {ambiguity}",
    )
    yield Row(
        '"roots near those of the closed course control"',
        "yes",
        "cannot be computed",
        "the paper gives no control law, and its example is roll, not course",
    )


def unobservable_states(A: FloatArray, C: FloatArray) -> list[int]:
    """Return the indices of the states of A (n, n) that take part in unobservable motions."""
    observability = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(len(A))])
    return np.flatnonzero(np.abs(null_space(observability)).sum(axis=1) > 1e-9).tolist()


def distinguishable() -> Iterator[tuple[str, ...]]:
    """List which disturbances sensors can distinguish; the paper's text does not discuss it."""
    cases = (
        ("roll, ω: constant moment", INTEGRATOR, [moment(CONSTANT)]),
        ("roll, ω: ramp moment", INTEGRATOR, [moment(RAMP)]),
        ("roll, ω: gyro error", INTEGRATOR, [error("gyro")]),
        ("yaw, ω: constant moment", NOMOTO, [moment(CONSTANT)]),
        ("yaw, ω: gyro error", NOMOTO, [error("gyro")]),
        ("yaw, ω: constant moment, gyro error", NOMOTO, [moment(CONSTANT), error("gyro")]),
        ("yaw, ω: wave moment, gyro error", NOMOTO, [moment(WAVE), error("gyro")]),
        ("yaw, ω: constant moment, wave on gyro", NOMOTO, [moment(CONSTANT), error("gyro", WAVE)]),
        ("yaw, ω: two waves", NOMOTO, [moment(WAVE), moment(OTHER_WAVE, "second")]),
        ("yaw, ω: one wave on both", NOMOTO, [moment(WAVE), error("gyro", WAVE)]),
        ("yaw, ψ and ω: ramp moment, gyro error", BOTH, [moment(RAMP), error("gyro")]),
        (
            "yaw, ψ and ω: ramp moment, both errors",
            BOTH,
            [moment(RAMP), error("gyro"), error("compass")],
        ),
        ("yaw, ψ: constant moment", HEADING, [moment(CONSTANT)]),
        ("yaw, ψ: moment, compass error", HEADING, [moment(CONSTANT), error("compass")]),
    )
    for name, ship, disturbances in cases:
        result = ambiguities(ship, disturbances)
        yield name, "no" if result else "yes", "; ".join(map(str, result))


def curve(ax: Axes, name: str, unit: str, column: int, scale: float) -> None:
    """Draw a quantity and its two estimates."""
    ax.plot(TIMES, TRUTH[name] * scale, color=GREY, ls="--", label=f"{name}(t)")
    for spectrum, colour, width in (("butterworth", BLUE, 1.9), ("binomial", RED, 1.2)):
        e = errors(roll(spectrum))[:, column]
        label = "estimate, Butterworth (as in the paper)" if width > 1.5 else "estimate, binomial"
        ax.plot(TIMES, (TRUTH[name] - e) * scale, color=colour, lw=width, label=label)
    ax.set_ylabel(f"{name}, {unit}")
    ax.legend(loc="lower right")


def band(ax: Axes, unit: str, column: int, reference: FloatArray, scale: float, name: str) -> None:
    """Draw the errors, and the band of the settling time: 5 % of the reference."""
    bound = 0.05 * np.abs(reference) * scale
    ax.fill_between(TIMES, -bound, bound, color=GREY, alpha=0.3, lw=0, label=f"5 % of {name}")
    for spectrum, colour, width in (("butterworth", BLUE, 1.9), ("binomial", RED, 1.2)):
        ax.plot(TIMES, errors(roll(spectrum))[:, column] * scale, color=colour, lw=width)
    ax.axvline(100, color="black", lw=0.9, ls=":")
    ax.annotate(
        "5 / Ω0", (100, 0.95), xycoords=("data", "axes fraction"), xytext=(4, 0),
        textcoords="offset points", va="top",
    )  # fmt: skip
    ax.set_ylabel(f"error, {unit}")
    ax.set_xlabel("time, s")
    ax.set_xlim(0, TIMES[-1])
    ax.legend(loc="upper right")


def draw_paper() -> None:
    """Draw figures 1 and 2 of the paper."""
    for figure_number, name, unit, column, scale, reference in (
        (1, "M", "N·m", 1, 1.0, "M(t)"),
        (2, "v", "mN·m/s", 2, 1e3, "v"),
    ):
        figure, (above, below) = plt.subplots(2, 1, figsize=(6.4, 4.6), sharex=True)
        curve(above, name, unit, column, scale)
        band(below, unit, column, TRUTH[name], scale, reference)
        caption = {
            1: "Fig. 1 of the paper, the disturbing moment. The solid line of the paper is the"
            " Butterworth estimate. Below: the errors, truth minus estimate.",
            2: 'Fig. 2 of the paper. Its caption reads "noise of the measurements", but the'
            " third state of the observer estimates the slope v of the moment.",
        }[figure_number]
        picture(f"disturbance_observer_{figure_number}", figure, caption)
        plt.close(figure)


def draw_both() -> None:
    """Draw a moment and a sensor error estimated together, where the sensors allow it."""
    observer = disturbance_observer(BOTH, [moment(RAMP), error("gyro")], frequency=2 * OMEGA)
    F = observer.A - observer.L @ observer.C
    truth = np.array([0, 0, 2e-4, 2e-6, np.radians(0.1)])  # rad, rad/s, rad/s², rad/s³, rad/s
    plant_step, error_step = expm(observer.A * DT), expm(F * DT)
    x, e = truth.copy(), truth.copy()
    true, estimated = [], []
    for _ in TIMES:
        true.append(observer.D @ x)
        estimated.append(observer.D @ (x - e))
        x, e = plant_step @ x, error_step @ e
    figure, axes = plt.subplots(2, 1, figsize=(6.4, 4.2), sharex=True)
    units = (("moment / inertia, °/s²", np.degrees(1)), ("gyro error, °/s", np.degrees(1)))
    for k, (ax, (label, scale)) in enumerate(zip(axes, units, strict=True)):
        ax.plot(TIMES, np.array(true)[:, k] * scale, color=GREY, ls="--", label="truth")
        ax.plot(TIMES, np.array(estimated)[:, k] * scale, color=BLUE, label="estimate")
        ax.set_ylabel(label)
    axes[0].legend(loc="lower right")
    axes[1].set_xlabel("time, s")
    axes[1].set_xlim(0, TIMES[-1])
    picture(
        "disturbance_observer_3",
        figure,
        "Not in the paper: disturbance and measurement error estimated together. Yaw, T = 20 s,"
        " heading and rate measured; a moment that grows linearly and a constant gyro error;"
        f" Butterworth poles of {2 * OMEGA:g} rad/s.",
    )
    plt.close(figure)


def noise_of_gains() -> Iterator[tuple[str, ...]]:
    """List the standard deviations of each state's error for gains of the same poles."""
    observer = disturbance_observer(BOTH, [moment(RAMP), error("gyro")], frequency=2 * OMEGA)
    A, C, poles = observer.A, observer.C, observer.poles
    quiet = place_for_noise(A, C, poles, STATE_NOISE, SENSOR_NOISE)
    gains = (
        observer.L,
        place_poles(A.T, C.T, poles, maxiter=100).gain_matrix.T,
        quiet.gain,
        kalman_gain(A, np.eye(5), C, STATE_NOISE, SENSOR_NOISE).gain,
    )
    stds = [np.sqrt(np.diag(error_covariance(A, L, C, STATE_NOISE, SENSOR_NOISE))) for L in gains]
    units = ("ψ, °", "ω, °/s", "moment / inertia, °/s²", "its slope, °/s³", "gyro error, °/s")
    for k, unit in enumerate(units):
        cells = (number(np.degrees(std[k]), 2) for std in stds)
        yield unit, *cells, number(quiet.kalman_ratio[k], 3)


def main() -> None:
    """Print the page and draw its pictures."""
    start_page("Disturbance observer: printed against computed")
    paragraph(INTRODUCTION)
    butterworth, binomial = roll("butterworth"), roll("binomial")
    comparison("The gain", design(butterworth, binomial))
    comparison("The transient", transients(butterworth, binomial))
    head = ("t, s", "M, N·m", "estimate", "error", "v, mN·m/s", "estimate", "error")
    table("The estimates", head, estimates(butterworth))
    draw_paper()
    comparison("Misprints and wrong statements", claims(butterworth))
    columns = ("plant and sensors: disturbances", "distinguishable", "reason and remedy")
    table("Which disturbances can be distinguished", columns, distinguishable())
    draw_both()
    columns = ("σ of", "multi-level", "SciPy", "least noise", "Kalman filter", "price of the poles")
    table("The noise at the same poles", columns, noise_of_gains())
    paragraph(
        "The observer of the last figure, with samples at 10 Hz that have a noise of 0.5° (compass)"
        " and 0.004 °/s (gyro); the slope of the moment and the gyro's error are random walks, of"
        " the intensities 1e−16 and 1e−14. The first three gains have the same poles: with two"
        " sensors the poles leave five numbers free, which `place_multilevel` sets to zero,"
        " `scipy.signal.place_poles` uses for robustness, and `place_for_noise` for the least"
        " product of the variances. `disturbance_observer` takes the latter where `sensor_noise` is"
        " given. The price is its σ over that of the Kalman filter, whose poles are its own: a gyro"
        " error that hardly changes takes longer to find than these poles allow."
    )


if __name__ == "__main__":
    main()

"""The disturbance observer's paper: what it prints, and what shiplog computes.

"Algorithm of ship course control system watcher for assessing disturbances and noise measurements",
issue 6 (40) of 2016, pages 221 ff. Prints docs/papers_disturbance_observer.md and draws its
pictures.
"""

from collections.abc import Iterator

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from printed import BLUE, GREY, RED, Row, grid, page, picture, say, table
from scipy.integrate import solve_ivp
from scipy.linalg import expm, null_space, solve_continuous_lyapunov

from analysis.design.exosystem import (
    DisturbanceObserver,
    Exosystem,
    Influence,
    Plant,
    ambiguities,
    disturbance_observer,
)
from analysis.design.observability import ComplexArray
from analysis.design.placement import named
from shiplog.types import FloatArray

INERTIA, MOMENT, SLOPE, OMEGA = 1000.0, 0.25, 5e-3, 0.05  # kg m², N m, N m/s, 1/s
DT = 0.01
TIMES = np.arange(0, 200 + DT / 2, DT)
TRUTH = {"M": MOMENT + SLOPE * TIMES, "v": np.full_like(TIMES, SLOPE)}  # N m and N m/s
INTRODUCTION = """\
*Algorithm of ship course control system watcher for assessing disturbances and noise measurements*,
issue 6 (40) of 2016, pages 221 ff. This page is made by

    python examples/papers/disturbance_observer.py > docs/papers_disturbance_observer.md

The paper has no table: its numbers are the formulas of the gain, the parameters of one example (the
roll of a ship, its rate measured, a moment that grows evenly), two figures and the sentence "the
transient takes no more than 100 s". The text we have is a scan: of the figures it gives the
captions, not the curves, so that ours stand beside what the paper says of its own.

Equations (1) and (3) to (8) are right as printed; what is not stands below. The example: I = 1000
kg·m², M(0) = 0.25 N·m, v = 0.005 N·m/s, Ω0 = 0.05 1/s; our estimates start from zero.

A deviation in bold is more than the rounding of what is printed."""


CONSTANT, RAMP = Exosystem.polynomial(0), Exosystem.polynomial(1)
WAVE, OTHER_WAVE = Exosystem.harmonic(0.6), Exosystem.harmonic(0.8)  # rad/s


def plant(A: list[list[float]], C: list[list[float]], states: str, sensors: str) -> Plant:
    """A plant driven by what acts on its last state."""
    B = np.eye(len(A))[:, -1:]
    return Plant(np.array(A), B, np.array(C), tuple(states.split()), tuple(sensors.split()))


INTEGRATOR = plant([[0.0]], [[1.0]], "ω", "gyro")
NOMOTO = plant([[-0.05]], [[1.0]], "ω", "gyro")
BOTH = plant([[0.0, 1.0], [0.0, -0.05]], [[1.0, 0.0], [0.0, 1.0]], "ψ ω", "compass gyro")
HEADING = plant([[0.0, 1.0], [0.0, -0.05]], [[1.0, 0.0]], "ψ ω", "compass")


def moment(exosystem: Exosystem, name: str = "moment", inertia: float = 1.0) -> Influence:
    """What turns the ship."""
    return Influence(name, exosystem, on_state={"ω": 1 / inertia})


def error(sensor: str, exosystem: Exosystem = CONSTANT) -> Influence:
    """What a sensor adds to the truth."""
    return Influence(f"{sensor} error", exosystem, on_sensor={sensor: 1.0})


def roll(spectrum: str) -> DisturbanceObserver:
    """The paper's example."""
    disturbances = [moment(RAMP, inertia=INERTIA)]
    return disturbance_observer(INTEGRATOR, disturbances, spectrum, frequency=OMEGA)


def errors(observer: DisturbanceObserver) -> FloatArray:
    """Truth less estimate at `TIMES`, (count, 3): ω rad/s, M N m, v N m/s; from (0, M0, v0)."""
    step = expm((observer.A - observer.L @ observer.C) * DT)
    found = np.empty((len(TIMES), 3))
    found[0] = 0, MOMENT, SLOPE
    for k in range(1, len(TIMES)):
        found[k] = step @ found[k - 1]
    return found


def printed_observer(L: FloatArray) -> FloatArray:
    """What (8), integrated as it is printed beside (5) and (6), leaves as errors, (count, 3)."""
    l1, l2, l3 = L

    def rate(t: float, x: FloatArray) -> FloatArray:
        w, M, v, w_hat, M_hat, v_hat = x
        u = 0.3 * np.cos(0.1 * t)  # any: it drops out
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
    found: FloatArray = x[:, :3] - x[:, 3:]
    return found


def settled(off: FloatArray, reference: FloatArray | float) -> float:
    """The instant, s, from which on no error is above 5 % of the reference."""
    return float(TIMES[np.flatnonzero(np.abs(off) > 0.05 * np.abs(reference))[-1] + 1])


def noise(observer: DisturbanceObserver) -> FloatArray:
    """Standard deviation of each estimate's error for white noise of intensity one on ω, (3,)."""
    P = solve_continuous_lyapunov(observer.A - observer.L @ observer.C, -observer.L @ observer.L.T)
    return np.sqrt(np.diag(P))


def said(poles: ComplexArray) -> str:
    """Poles as a table says them, each pair once."""
    upper = [pole for pole in np.sort_complex(poles) if pole.imag >= 0]
    return ", ".join(named(pole) for pole in upper).replace("-", "−").replace("j", " j")


def design(butterworth: DisturbanceObserver, binomial: DisturbanceObserver) -> Iterator[Row]:
    """The gain, its poles, and that (8) is the observer they make."""
    for k, (formula, value, unit) in enumerate(
        (("2 Ω0", "0.1", "1/s"), ("2 I Ω0²", "5", "N·m"), ("I Ω0³", "0.125", "N·m/s")), 1
    ):
        remark = f"= {formula}: printed as a formula, its value ours"
        yield Row(f"l{k}, {unit}", value, round(float(butterworth.L[k - 1, 0]), 12), remark)
    yield Row(
        "poles of A − L C, 1/s",
        "roots of s³ + 2 Ω0 s² + 2 Ω0² s + Ω0³",
        said(butterworth.poles),
        "Butterworth's",
    )
    yield Row(
        '"binomial filtering": l1, l2, l3',
        "0.1, 5, 0.125",
        ", ".join(f"{x:g}" for x in binomial.L[:, 0]),
        "a misnomer: the binomial polynomial is (s + Ω0)³; shiplog has both by their names",
    )
    apart = np.abs(printed_observer(butterworth.L[:, 0]) - errors(butterworth)).max(axis=0)
    yield Row(
        "(8) integrated, against e^((A − L C) t) e(0): M, N·m",
        "0",
        f"{apart[1]:.0e}".replace("-", "−"),
        "(8) is right as printed, whatever the known moment u; the rest is the integrator's",
    )


def transients(butterworth: DisturbanceObserver, binomial: DisturbanceObserver) -> Iterator[Row]:
    """How long it takes, by every measure that could be meant."""
    measures = (
        ("M, 5 % of M(t)", 1, TRUTH["M"], "the only measure by which the sentence holds"),
        ("M, 5 % of M(0)", 1, MOMENT, "the usual measure: longer than the paper says"),
        ("v, 5 % of v", 2, SLOPE, "what its second figure shows: longer too"),
    )
    for observer, name in ((butterworth, "Butterworth"), (binomial, "binomial")):
        e = errors(observer)
        for measure, k, reference, remark in measures:
            printed = "≤ 100 = 5 / Ω0" if observer is butterworth else None
            note = remark if observer is butterworth else "not in the paper"
            yield Row(f"{name}: {measure}, s", printed, round(settled(e[:, k], reference), 1), note)
    ratio = noise(binomial) / noise(butterworth)
    for k, name in ((1, "M"), (2, "v")):
        yield Row(
            f"noise in {name}, binomial to Butterworth",
            None,
            round(float(ratio[k]), 3),
            "standard deviation, the gyro's noise being white",
        )


def estimates(butterworth: DisturbanceObserver) -> Iterator[tuple[str, ...]]:
    """The curves' values, to be held against the figures on paper."""
    e = errors(butterworth)
    for secs in (0, 10, 20, 50, 100, 150):
        k = round(secs / DT)
        M, v = TRUTH["M"][k], SLOPE
        numbers = (M, M - e[k, 1], e[k, 1]), (1e3 * v, 1e3 * (v - e[k, 2]), 1e3 * e[k, 2])
        cells = [f"{number:.4f}" for group in numbers for number in group]
        yield tuple(cell.replace("-", "−") for cell in (str(secs), *cells))


def claims(butterworth: DisturbanceObserver) -> Iterator[Row]:
    """What the paper says in words and formulas without a number."""
    yield Row("size of y_c = col{f, v}, after (2)", "n_c + l", "n + l", "f is (n,), v is (l,)")
    yield Row("size of (x, x_c), before (3)", "n × n_c", "n + n_c", "said right after (4)")
    for output, name in ((np.eye(3)[[1]], "M"), (np.eye(3)[[2]], "v")):
        lost = [("ω", "M", "v")[k] for k in hidden(butterworth.A, output)]
        yield Row(
            f'"one of the three states as output" restores all: {name}',
            "yes",
            f"no: {' and '.join(lost)} hidden",
            "nothing of what it drives comes back to it; only ω shows all three",
        )
    e = errors(butterworth)
    crossings = [
        ", ".join(f"{TIMES[k]:.1f}" for k in np.flatnonzero(np.diff(np.sign(e[1:, i]))) + 1)
        for i in (1, 2)
    ]
    yield Row(
        '"instants of switching" in both figures',
        "seen in the figures",
        "none",
        "L is constant and the errors are smooth; they only change sign, M's at"
        f" {crossings[0]} s, v's at {crossings[1]} s",
    )
    fast = disturbance_observer(INTEGRATOR, [moment(RAMP, inertia=INERTIA)], frequency=2 * OMEGA)
    louder = noise(fast) / noise(butterworth)
    yield Row(
        '"optimal in speed", "least time"',
        "yes",
        "no",
        f"Ω0 = 0.1 1/s settles in {settled(errors(fast)[:, 1], MOMENT):.1f} s instead of"
        f" {settled(e[:, 1], MOMENT):.1f} s, at {louder[1]:.1f} times the noise in M: nothing but"
        " noise bounds the speed, and it is not in the design",
    )
    clash = ambiguities(INTEGRATOR, [error("gyro")])[0]
    yield Row(
        "Fig. 2: noise of the measurement, v(t) of (1)",
        "estimated",
        "is not in the example",
        "the v of (6) is the slope of M, of (1) the sensor's noise; (7) has C_v = 0. Had it a"
        f" constant error of the gyro: {clash}",
    )
    yield Row(
        '"roots near those of the closed course control"',
        "yes",
        "cannot be had",
        "the paper gives no control law, and its example is roll, not course",
    )


def hidden(A: FloatArray, C: FloatArray) -> list[int]:
    """The states that y = C x and its derivatives say nothing of."""
    shown = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(len(A))])
    return np.flatnonzero(np.abs(null_space(shown)).sum(axis=1) > 1e-9).tolist()


def told_apart() -> Iterator[tuple[str, ...]]:
    """What sensors can tell apart: the question the paper's title asks and its text leaves."""
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
        found = ambiguities(ship, disturbances)
        yield name, "no" if found else "yes", "; ".join(map(str, found))


def curve(ax: Axes, name: str, unit: str, column: int, scale: float) -> None:
    """A quantity and its two estimates."""
    ax.plot(TIMES, TRUTH[name] * scale, color=GREY, ls="--", label=f"{name}(t)")
    for spectrum, colour, width in (("butterworth", BLUE, 1.9), ("binomial", RED, 1.2)):
        e = errors(roll(spectrum))[:, column]
        label = "estimate, Butterworth (the paper's)" if width > 1.5 else "estimate, binomial"
        ax.plot(TIMES, (TRUTH[name] - e) * scale, color=colour, lw=width, label=label)
    ax.set_ylabel(f"{name}, {unit}")
    ax.legend(loc="lower right")


def band(ax: Axes, unit: str, column: int, reference: FloatArray, scale: float, of: str) -> None:
    """The errors, and the band in which they count as settled."""
    bound = 0.05 * np.abs(reference) * scale
    ax.fill_between(TIMES, -bound, bound, color=GREY, alpha=0.3, lw=0, label=f"5 % of {of}")
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
    """Figures 1 and 2."""
    for number, name, unit, column, scale, of in (
        (1, "M", "N·m", 1, 1.0, "M(t)"),
        (2, "v", "mN·m/s", 2, 1e3, "v"),
    ):
        drawn, (above, below) = plt.subplots(2, 1, figsize=(6.4, 4.6), sharex=True)
        curve(above, name, unit, column, scale)
        band(below, unit, column, TRUTH[name], scale, of)
        caption = {
            1: "Fig. 1 of the paper, the disturbing moment. The paper's solid line is the"
            " Butterworth estimate; below, what is missing to the truth.",
            2: 'Fig. 2 of the paper. Its caption says "noise of the measurements"; what the'
            " observer's third state estimates is the slope v of the moment.",
        }[number]
        picture(f"disturbance_observer_{number}", drawn, caption)
        plt.close(drawn)


def draw_apart() -> None:
    """What the title promises, where it can be had: a moment and a sensor's error at once."""
    observer = disturbance_observer(BOTH, [moment(RAMP), error("gyro")], frequency=2 * OMEGA)
    F = observer.A - observer.L @ observer.C
    truth = np.array([0, 0, 2e-4, 2e-6, np.radians(0.1)])  # rad, rad/s, rad/s², rad/s³, rad/s
    plant_step, error_step = expm(observer.A * DT), expm(F * DT)
    x, e = truth.copy(), truth.copy()
    true, found = [], []
    for _ in TIMES:
        true.append(observer.D @ x)
        found.append(observer.D @ (x - e))
        x, e = plant_step @ x, error_step @ e
    drawn, axes = plt.subplots(2, 1, figsize=(6.4, 4.2), sharex=True)
    units = (("moment / inertia, °/s²", np.degrees(1)), ("gyro error, °/s", np.degrees(1)))
    for k, (ax, (label, scale)) in enumerate(zip(axes, units, strict=True)):
        ax.plot(TIMES, np.array(true)[:, k] * scale, color=GREY, ls="--", label="truth")
        ax.plot(TIMES, np.array(found)[:, k] * scale, color=BLUE, label="estimate")
        ax.set_ylabel(label)
    axes[0].legend(loc="lower right")
    axes[1].set_xlabel("time, s")
    axes[1].set_xlim(0, TIMES[-1])
    picture(
        "disturbance_observer_3",
        drawn,
        "Not in the paper: disturbance and measurement error at once. Yaw, T = 20 s, heading and"
        " rate measured; a moment that grows and a constant gyro error; Butterworth's poles of"
        f" {2 * OMEGA:g} rad/s.",
    )
    plt.close(drawn)


def main() -> None:
    """Print the page."""
    page("Disturbance observer: printed against computed")
    say(INTRODUCTION)
    butterworth, binomial = roll("butterworth"), roll("binomial")
    table("The gain", design(butterworth, binomial))
    table("The transient", transients(butterworth, binomial))
    head = ("t, s", "M, N·m", "estimate", "error", "v, mN·m/s", "estimate", "error")
    grid("The estimates", head, estimates(butterworth))
    draw_paper()
    table("Misprints, and what is not so", claims(butterworth))
    columns = ("plant and sensors: disturbances", "told apart", "if not, what would help")
    grid("What can be told apart", columns, told_apart())
    draw_apart()


if __name__ == "__main__":
    main()

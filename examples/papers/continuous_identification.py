"""Comparison of Burylin's paper on continuous identification with values computed by shiplog.

It compares the paper's filter and its least squares over a sliding window, as printed
(`analysis.identification.comparison.paper_scheme`), with the method of shiplog, the equations in
weak form.

    python examples/papers/continuous_identification.py > docs/papers_continuous_identification.md
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from math import pi

import matplotlib.pyplot as plt
import numpy as np
from markdown_page import (
    AMBER,
    BLUE,
    GREEN,
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
from scipy.integrate import solve_ivp

from analysis.design.pseudo_input_system import (
    printed_input_matrix,
    pseudo_input_matrices,
    pseudo_inputs,
)
from analysis.identification.comparison.paper_scheme import (
    STRIDE_SECS,
    Q,
    R,
    paper_states,
    regression_rows,
    solve_window,
    window_coefficients,
)
from analysis.regression.coefficients import fit_coefficients
from analysis.regression.sliding import CoefficientHistory
from analysis.regression.weak_form import weak_form
from recorders.simulated.manoeuvres import manoeuvre
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.trajectory import compute_trajectory
from shiplog import Signals, TrialLog, Vessel, load_vessel, resample
from shiplog.ships.paper import (
    SURGE_COEFFICIENTS,
    YAW_COEFFICIENTS,
    Coefficients,
    rudder_effects,
    steady_speed,
    surge_acceleration,
    yaw_acceleration_rate,
)
from shiplog.types import FloatArray

DEG = pi / 180
NAMES = (*YAW_COEFFICIENTS, *SURGE_COEFFICIENTS)
P0, P_SECS = 10.0, 378.0
DURATION, DT = 500.0, 0.1  # s
SEEDS = range(5)
TABLE2 = ("5.3e-9", "1.3e-6", "0.05", "1.6e-6", "0.014")
UNITS2 = (
    ("10⁻⁹ rad/s³", 1e-9),
    ("10⁻⁶ rad/s²", 1e-6),
    ("rad/s", 1.0),
    ("10⁻⁶ m/s²", 1e-6),
    ("m/s", 1.0),
)
CLOSEST_CASE = ("table1-rad", "none", "whole")  # of Table 2: reading, noise, coefficients
STATES = ("w''", "w'", "w", "v'", "v")
POINT = (0.3, 0.01, 9.0, 20.0, 2.5, 80.0, 0.5)  # w, w', v, delta, delta', n, n'
MAX_ROUNDS = 28  # of feeding the coefficients back into the filter
INITIAL_ERRORS = (0.2, 0.01, 0.001)  # relative errors of the prior in the first round
MAX_STATE = 1e6  # of any state; above it the model diverges
EXCITED_SECS = 400.0  # until then the rudder moves within each window of 200 s
READINGS = {"degrees": "table1", "radians": "table1-rad"}
PRINTED = {
    "a": "T₁ = 150, T₂ = 50",
    "b1": "of T₁, T₂",
    "b2": "c₂ = 10",
    "b3": "c₃ = 20",
    "d": "of T₁, T₂",
    "e": "T₃ = 0.5",
    "f": "−0.1",
    "g": "−0.0003",
    "h": "0.0004",
    "alpha1": "0.0171",
    "alpha2": "0.0015",
    "alpha3": "0.0654",
}
PRINTED_P = {
    (1, 1): "30.2753",
    (1, 2): "1.1407",
    (1, 3): "-0.0029",
    (2, 2): "0.1208",
    (2, 3): "-0.0001",
    (3, 3): "0.1875",
    (4, 4): "2.0618",
    (5, 5): "13.78",
}

FORMULAS = (
    ("(1)", "c₂ω/ω", "c₂ω·|ω|", "error of the scan: a stroke for a bar; see (4)"),
    (
        "(5)",
        "ẋ[k+1] = A x[k] + …",
        "x[k+1] = exp(A·dt) x[k] + …",
        "A is the matrix of the differential equation",
    ),
    ("row 4", "v̇ = x₄ = …", "v̇ = ẋ₄ = …", "the dot is missing"),
    ("u₇", "v·δ̇, which is u₈", "**v·δ**", "row 2: b₄ u₇ is α₁vδ/(T₁T₂)"),
    (
        "u₉",
        "v̇·n·δ·E",
        "**n·δ·E**; v̇·n·δ·E is **u₂₀**",
        "one symbol for both: row 2 needs the former, row 3 the latter",
    ),
    ("u₁₉", "v̇·δ̇·E", "**v̇·n·δ̇·E**", "d(n·E)/dt = ṅE − α₃·v̇·n·E"),
    (
        "B, row 3",
        "b₂·sign(x₁) at u₁₄",
        "**2·**b₂·sign(x₁)",
        "the equation above it has the factor 2",
    ),
    (
        "B, rows",
        "17, 18, 17, 17, 17 entries",
        "20 each",
        "19 inputs are defined; in row 5 h, 2f, 2g are two columns too far left",
    ),
    ("(6)", "L = A P Cᵀ(…)⁻¹, for discrete time", "P is for continuous time", "see the covariance"),
    (
        "noise",
        "sin(τ⁻¹); v + 0.2v; Gaussian, uniform",
        "sin(t/τ); v + 0.2ν; uniform on [−1, 1]",
        "error of the scan: v for ν",
    ),
    (
        "(7)",
        "Υ = [v² ω² n], A = [f g h]",
        "[ω² v² n]",
        "wrong order; in (4) f is the coefficient of ω²",
    ),
    ("(7)", "δ(αv + …)", "δ(α₁v + …)", "an index is missing"),
)

PRINTED_ROWS = (
    ("2", "4: b₂s, 5: b₃, 7: b₄, 8: b₆, 9: b₅, 10: b₇", "the same"),
    (
        "3",
        "7: b₄, 8: −b₅α₃, 9: b₅, 10: b₄, 11: b₅, 13: b₂s, 15: 3b₃, 16: b₆, 17: b₇, 18: −b₇α₃",
        "8: b₄, 10: b₅, 11: b₄, 12: b₅, 14: 2b₂s, 16: 3b₃, 17: b₆, 18: b₇, 19: −b₇α₃, 20: −b₅α₃",
    ),
    ("4", "3: h, 4: f, 6: g", "the same"),
    ("5", "11: h, 12: 2f, 13: 2g", "13: h, 14: 2f, 15: 2g"),
)


def estimates(signals: Signals, prior: Coefficients, *, jumps: bool = True) -> FloatArray:
    """Estimate the states (m, 5) by the paper's filter.

    Parameters
    ----------
    signals
        The signals of a run.
    prior
        The coefficients of the model in the filter.
    jumps
        Whether the jump of w'' with the rudder's rate is added, which the paper omits.
    """
    return paper_states(signals, prior, as_printed=not jumps)


def paper_coefficients(signals: Signals, c: Coefficients, x: FloatArray) -> FloatArray:
    """Fit the nine coefficients (9,) to a whole run by the paper's least squares."""
    return np.concatenate([solve_window(rows) for rows in regression_rows(signals, c, x)])


# ------------------------------------------------------------------------------------- the run


@cache
def vessel_of(preset: str) -> Vessel:
    """Load a reading of Table 1."""
    return load_vessel(preset)[0]


def measured(
    preset: str, noise: str, seed: int = 0, name: str = "paper"
) -> tuple[SimulatedTrial, Signals]:
    """Simulate a run of 500 s, and resample it.

    Parameters
    ----------
    preset
        The vessel: a reading of Table 1.
    noise
        The sensor noise, ``none`` or ``paper``.
    seed
        The seed of the noise.
    name
        The manoeuvre.
    """
    sensors = suite(noise, angle_unit=vessel_of(preset).angle_unit)
    trial = simulate(vessel_of(preset), name, duration_secs=DURATION, seed=seed, sensors=sensors)
    channels = ("yaw_rate", "speed", "rudder", "rpm")
    return trial, resample(TrialLog("run", trial.channels), channels=channels)


def truth_of(vessel: Vessel, name: str = "paper") -> FloatArray:
    """Compute w'', w', w, v', v (m, 5) of a ship on the paper's run, every 0.1 s."""
    c, times = vessel.coefficients, np.arange(int(DURATION / DT)) * DT
    trajectory = compute_trajectory(
        vessel, manoeuvre(name, DURATION, vessel.approach_rpm), DURATION
    ).at(times + 1e-9)
    w, w_dot, v, n = (trajectory[k] for k in ("yaw_rate", "yaw_acceleration", "speed", "rpm"))
    delta = trajectory["rudder"]
    rate = np.diff(delta, append=delta[-1]) / DT
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w**3
    w_ddot = hull + rudder_effects(c, v, n) * (c.d * delta + c.e * rate)
    return np.column_stack((w_ddot, w_dot, w, c.f * w * w + c.g * v * v + c.h * n, v))


def nine(c: Coefficients) -> FloatArray:
    """Return the nine coefficients in the order of `NAMES`."""
    return np.array(c[:9])


def with_nine(c: Coefficients, values: FloatArray) -> Coefficients:
    """Replace the nine coefficients, and keep the alphas."""
    return c._replace(**dict(zip(NAMES, map(float, values), strict=True)))


def percent(values: FloatArray, true: FloatArray) -> FloatArray:
    """Return the errors in % of the true values."""
    return 100 * (values / true - 1)


def weak_form_coefficients(
    signals: Signals, c: Coefficients
) -> tuple[FloatArray, list[CoefficientHistory]]:
    """Fit the coefficients (9,) to a whole run in weak form; return also the histories."""
    values: list[float] = []
    histories = []
    for rows in weak_form(signals, c):
        fit, history = fit_coefficients(rows)
        values += [fit.coefficients[name].value for name in rows.equation.names]
        histories.append(history)
    return np.array(values), histories


# ------------------------------------------------------------------------------------- the page


def main() -> None:
    """Print the page and draw its pictures."""
    start_page("Continuous identification: printed against computed")
    paragraph(
        "Ya. V. Burylin, *Continuous identification of nonlinear vessel movement model with"
        " estimator*. This page is made by\n\n"
        "    python examples/papers/continuous_identification.py"
        " > docs/papers_continuous_identification.md"
    )
    paragraph(
        "The paper has two tables, a covariance and four figures. The covariance is reproduced to"
        " every printed digit; Table 2 is reproduced in part, and only for a run nearly without"
        " noise. Our copy is a scan that shows the captions of the figures but not their curves."
        " The text prints neither the manoeuvre nor the time step nor the length N of the window."
        " The run is therefore that of our notes (n = 100 rpm, v₀ = 2 m/s, rudder +20° at 0 s,"
        " −20° at 200 s, at 2.5 °/s), the step is 0.1 s, and N is given below. “The paper's"
        " method” is its filter and its least squares as printed, kept in shiplog for comparison;"
        " “weak form” is the method of shiplog."
    )
    table1()
    formulas()
    point()
    covariance()
    figures()
    settling()
    jump()
    circularity()
    table2()


def rounded(values: Iterable[float], form: str = ".2g") -> list[str]:
    """Format errors with few digits, without exponents below 10 000."""
    texts = (f"{v:.0f}" if 100 <= abs(v) < 1e4 else f"{v:{form}}" for v in values)
    return [text.replace("-", "−").replace("nan", "–") for text in texts]


def table1() -> None:
    """Print Table 1, and the ship that it defines in degrees and in radians."""
    deg, rad = (vessel_of(name).coefficients for name in READINGS.values())
    rows = [
        (name, PRINTED.get(name, ""), number(getattr(deg, name)), number(x))
        for name, x in rad._asdict().items()
    ]
    header = ("coefficient", "printed", "read in degrees (SI)", "read in radians (SI)")
    table("Table 1, the model's parameters", header, rows)
    paragraph(
        "The paper does not state the unit of its angles. The two readings are two different ships:"
    )
    turns = []
    for name, preset in READINGS.items():
        vessel = vessel_of(preset)
        trajectory = compute_trajectory(
            vessel, manoeuvre("turning-circle-35", 4000.0, 80.0), 4000.0
        )
        end = trajectory.at(np.array([500.0, 3999.0]))
        w, v = end["yaw_rate"] / DEG, end["speed"]
        speed_ratio = 100 * v[1] / steady_speed(vessel.coefficients, 80.0)
        diameter = 2 * v[1] / (w[1] * DEG)
        turns.append((name, f"{w[1]:.3f} °/s", f"{diameter:.0f} m", f"{speed_ratio:.0f} %"))
    table("", ("read in", "yaw rate at 35°, 80 rpm", "diameter", "speed kept"), turns)
    speeds = ", ".join(
        f"{steady_speed(deg, n):.3f}" for n in (20.0, 40.0, 60.0, 80.0, 100.0, 150.0)
    )
    paragraph(
        f"Straight ahead at 20, 40, 60, 80, 100 and 150 rpm both make {speeds} m/s. Read in degrees"
        " it is a plausible ship of about 200 m; in radians the turn hardly reduces the speed."
        " However, the size of the noise (A_ω = 5·10⁻⁵, negligible in degrees) and Table 2 indicate"
        " radians. shiplog has both, `table1` and `table1-rad`."
    )


def formulas() -> None:
    """Print the formulas that are wrong as printed, with their corrections."""
    table("The formulas", ("where", "printed", "correct", "reason"), FORMULAS)
    paragraph("E = exp(−v·α₃). The rest of (1) to (7) is correct as printed, for δ̈ = n̈ = 0.")
    table("The matrix B", ("row", "printed, as column: entry", "correct"), PRINTED_ROWS)
    paragraph(
        "s = sign(x₁); row 1 is zero in both. With the twenty pseudo-inputs A x + B u is equal"
        " to the derivative, as the next table shows at one point."
    )


def point() -> None:
    """Print A x + B u at one point, corrected and as printed, beside the derivative."""
    c = vessel_of("table1-rad").coefficients  # the numbers as printed, in any unit of angle
    w, w_dot, v, delta, rate, n, n_dot = POINT

    def accelerations(h: float) -> FloatArray:
        """Return w'' and v' at the time h, s, along the motion."""
        w_ddot = yaw_acceleration_rate(c, w, w_dot, v, n, delta, rate)
        at = (w + h * w_dot, w_dot + h * w_ddot, v + h * surge_acceleration(c, w, v, n))
        n_h, delta_h = n + h * n_dot, delta + h * rate
        return np.array(
            [
                yaw_acceleration_rate(c, *at, n_h, delta_h, rate),
                surge_acceleration(c, at[0], at[2], n_h),
            ]
        )

    now, jerks = accelerations(0.0), (accelerations(1e-4) - accelerations(-1e-4)) / 2e-4
    x = np.array([w, w_dot, now[0], v, now[1]])
    A, B = pseudo_input_matrices(c, 1.0)
    u = pseudo_inputs(x, delta, rate, n, n_dot, c.alpha3)
    misprinted = u.copy()
    misprinted[6], misprinted[8], misprinted[18] = u[7], u[19], u[18] / n
    columns = (
        (now[0], jerks[0], now[1], jerks[1]),
        (A @ x + B @ u)[1:],
        (A @ x + B @ misprinted)[1:],
        (A @ x + printed_input_matrix(c) @ misprinted[:19])[1:],
    )
    rows = [
        (name, *(number(float(value), 8) for value in values))
        for name, *values in zip(("w''", "w'''", "v'", "v''"), *columns, strict=True)
    ]
    header = (
        "",
        "the derivative",
        "A x + B u, correct",
        "equations as printed",
        "matrix as printed",
    )
    table("At one point", header, rows)
    C = np.eye(5)[[0, 3]]
    observability = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(5)])
    paragraph(
        "At w = 0.3, w' = 0.01, v = 9, δ = 20, δ' = 2.5, n = 80, n' = 0.5, in the unit of angle"
        f" of the table. The pair (A, C) observes {np.linalg.matrix_rank(observability)} states of"
        " 5, w, w' and v: no measurement corrects ω̈ and v̇, and the error of the latter does not"
        " even decay. For such a pair the algebraic Riccati equation, which the paper names, has"
        " no stabilising solution."
    )


def covariance() -> None:
    """Compare the printed P with the solution of the continuous Riccati equation."""
    A, _ = pseudo_input_matrices(vessel_of("table1").coefficients, 1.0)
    times, history = covariance_history(A)
    P = history[round(P_SECS) - 1]
    remarks = {
        (3, 3): f"Q/(2·abs(a)) = {Q / 2 / -A[1, 1]:.4f}: independent of the measurements",
        (
            4,
            4,
        ): "the steady state is √(QR) = 2, or 2.005 in discrete time at 1 s; neither is printed",
        (5, 5): "P(0) + Q·t, unbounded: hence t = 378 s",
    }
    rows = [
        Row(f"P({i},{j})", text, float(P[i - 1, j - 1]), remarks.get((i, j), ""))
        for (i, j), text in PRINTED_P.items()
    ]
    others = max(float(np.abs(P[:3, 3:]).max()), abs(float(P[3, 4])))
    comparison("The covariance", [*rows, Row("its other entries", "0", others)])
    paragraph(
        "The equation is P' = A P + P Aᵀ + Q − P Cᵀ R⁻¹ C P with R = 400·I and G = I as printed,"
        " and Q = 0.01·I and P(0) = 10·I, which are not printed, at t = 378 s, with the true"
        " coefficients in A. It is of continuous time and neither the discrete filter of (6) nor"
        " “settled”. Its gains P Cᵀ/R:"
    )
    K = P[:, [0, 3]] / R
    gains = [
        (name, *(number(float(k), 2) for k in K[:, i]))
        for i, name in enumerate(("from w", "from v"))
    ]
    table("", ("gain", "to w (1/s)", "w' (1/s²)", "w'' (1/s³)", "v (1/s)", "v' (1/s²)"), gains)
    paragraph(
        f"v follows the log with a time constant of {1 / K[3, 1]:.0f} s, w follows the gyro with"
        f" about {1 / K[0, 0]:.0f} s, and w'' and v' follow no measurement: the filter is mainly a"
        " simulation of its model, with a small correction by the data."
    )
    draw_covariance(times, history)


def covariance_history(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Integrate the Riccati equation; return the times (1000,), s, and P (1000, 5, 5)."""
    C = np.eye(5)[[0, 3]]

    def rate(_: float, flat: FloatArray) -> FloatArray:
        P = flat.reshape(5, 5)
        return np.asarray(A @ P + P @ A.T + Q * np.eye(5) - P @ C.T @ C @ P / R).ravel()

    times = np.linspace(1.0, 1000.0, 1000)
    start, span = P0 * np.eye(5).ravel(), (0.0, 1000.0)
    solution = solve_ivp(rate, span, start, "LSODA", times, rtol=1e-10, atol=1e-12)
    return times, solution.y.T.reshape(-1, 5, 5)


def draw_covariance(times: FloatArray, history: FloatArray) -> None:
    """Draw the diagonal of P over time, with the printed values."""
    figure, axes = plt.subplots(figsize=(6.8, 3.2))
    for k, name in enumerate(("w", "w'", "w''", "v", "v'")):
        (line,) = axes.semilogy(times, history[:, k, k], label=name)
        axes.plot([P_SECS], [float(PRINTED_P[k + 1, k + 1])], "o", color=line.get_color(), ms=6)
    axes.axvline(P_SECS, color="black", lw=0.8, ls=":")
    axes.set(xlabel="t (s)", ylabel="variance: diagonal of P", xlim=(0, 1000))
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture(
        "continuous_identification_covariance",
        figure,
        "Diagonal of P. Dots: the values that the paper prints as settled, at 378 s. The variance"
        " of v' only grows.",
    )
    plt.close(figure)


def figures() -> None:
    """Draw the four figures, for a run with the paper's noise, read in degrees."""
    vessel = vessel_of("table1")
    c, true = vessel.coefficients, truth_of(vessel)
    _, signals = measured("table1", "paper")
    x = estimates(signals, c, jumps=False)
    paragraph("## The figures")
    paragraph(
        "The run is the one described above, read in degrees, with the noise of the paper and, as"
        " in the paper, with the true model in the filter."
    )
    panels = (
        ("v (m/s)", 1.0, 4, 3, signals["speed"]),
        ("v' (m/s²)", 1.0, 3, 4, None),
        ("w (°/s)", DEG, 2, 0, signals["yaw_rate"]),
        ("w' (°/s²)", DEG, 1, 1, None),
        ("w'' (°/s³)", DEG, 0, 2, None),
    )
    states_figure(1, "speed and its rate", panels[:2], true, x)
    states_figure(
        2,
        "yaw rate (with noise smaller than the width of the line) and its derivatives",
        panels[2:],
        true,
        x,
    )
    rows = []
    for label, unit, i, k, noisy in panels:
        errors = [true[:, i], x[: len(true), k] - true[:, i]]
        if noisy is not None:
            errors.insert(1, noisy[: len(true)] - true[:, i])
        sizes = [number(float(np.sqrt(np.mean(s**2))) / unit, 2) for s in errors]
        rows.append((label, *(sizes if noisy is not None else (sizes[0], "–", sizes[1]))))
    table("", ("rms of", "the state", "the sensor's error", "the filter's error"), rows)
    paragraph(
        "The paper calls the errors “insignificant for the derivatives, satisfactory for the"
        " signals”. This is true, because the model in the filter is the true one. The estimate"
        " v̂ starts at the first noisy sample; its error then decays with the time constant"
        " above. In figures 3 and 4 the blue line is the paper's method; the red line is the same"
        " from a prior with errors of 20 %, as a prior of a real ship has."
    )
    coefficient_figures(signals, c, x)


Panel = tuple[str, float, int, int, FloatArray | None]


def states_figure(
    which: int, what: str, panels: tuple[Panel, ...], true: FloatArray, x: FloatArray
) -> None:
    """Draw figure 1 or 2: truth, measurement and estimate."""
    t = np.arange(len(true)) * DT
    size = (6.8, 1.7 * len(panels) + 0.7)
    figure, plots = plt.subplots(len(panels), 1, figsize=size, sharex=True)
    for axes, (label, unit, i, k, noisy) in zip(plots, panels, strict=True):
        if noisy is not None:
            axes.plot(t, noisy[: len(t)] / unit, color=GREY, lw=0.5, alpha=0.7, label="measured")
        axes.plot(t, true[:, i] / unit, color=AMBER, lw=3, label="truth")
        axes.plot(t, x[: len(t), k] / unit, color=BLUE, lw=1.2, label="the paper's filter")
        axes.set(ylabel=label, xlim=(0, DURATION))
    plots[-1].set_xlabel("t (s)")
    figure.legend(*plots[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    figure.align_ylabels()
    caption = f"Figure {which} of the paper: {what}, estimated by its filter."
    picture(f"continuous_identification_{which}", figure, caption)
    plt.close(figure)


def coefficient_figures(signals: Signals, c: Coefficients, x: FloatArray) -> None:
    """Draw figures 3 and 4: the coefficients of each window, by the paper and in weak form."""
    ends, values = window_coefficients(signals, c, x)
    signs = np.where(np.arange(9) % 2, -1.0, 1.0)
    wrong_prior = with_nine(c, nine(c) * (1 + 0.2 * signs))
    _, with_wrong_prior = window_coefficients(
        signals, c, estimates(signals, wrong_prior, jumps=False)
    )
    yaw, surge = weak_form_coefficients(signals, c)[1]
    for which, history, height in ((3, surge, 2.6), (4, yaw, 4.4)):
        names = history.names
        size = (7.4, height)
        figure, plots = plt.subplots(len(names) // 3, 3, figsize=size, sharex=True, sharey=True)
        for axes, name in zip(plots.flat, names, strict=True):
            true = getattr(c, name)
            axes.axhline(1, color="black", lw=0.8)
            axes.plot(
                ends,
                values[:, NAMES.index(name)] / true,
                color=BLUE,
                label="paper, true prior",
            )
            wrong = with_wrong_prior[:, NAMES.index(name)] / true
            axes.plot(ends, wrong, color=RED, lw=1.1, label="paper, prior with errors of 20 %")
            weak = history.values[:, names.index(name)] / true
            axes.plot(history.time_secs, weak, color=GREEN, label="weak form")
            axes.set(title=name, xlim=(0, DURATION), ylim=(-0.2, 2.2))
        figure.supxlabel("t, end of the window (s)", fontsize=9.5)
        figure.supylabel("value / truth", fontsize=9.5)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
        velocity = "linear" if which == 3 else "angular"
        picture(
            f"continuous_identification_{which}",
            figure,
            f"Figure {which} of the paper: coefficients of the equation of {velocity} velocity, N"
            " = 200 s. The wrong prior is alternately 20 % too large and 20 % too small; weak"
            " form has no prior, and no line where a coefficient is unidentifiable in the window.",
        )
        plt.close(figure)


def settling() -> None:
    """Print after which time each coefficient stays within 10 % of its end and of the truth."""
    c = vessel_of("table1").coefficients
    early_errors, to_end, to_truth = [], [], []
    for seed in SEEDS:
        _, signals = measured("table1", "paper", seed)
        ends, values = window_coefficients(signals, c, estimates(signals, c, jumps=False))
        early_errors.append(np.abs(percent(values[ends <= 50], nine(c))).max(axis=0))
        excited = ends <= EXCITED_SECS  # later windows have no moving rudder, and e is zero
        to_end.append(settling_times(ends[excited], values[excited], values[excited][-1]))
        to_truth.append(settling_times(ends[excited], values[excited], nine(c)))
    early = rounded(np.median(early_errors, axis=0))
    rows = []
    for k, name in enumerate(NAMES):
        texts = [median_and_latest(np.array(times)[:, k]) for times in (to_end, to_truth)]
        rows.append((name, f"{early[k]} %", "about 200 s", *texts))
    header = ("", "worst error in the first 50 s", "printed: settled after")
    table(
        "How fast the coefficients settle",
        (*header, "within 10 % of its end", "within 10 % of the truth"),
        rows,
    )
    paragraph(
        f"Median over {len(SEEDS)} runs like that of the figures, and the latest where it differs;"
        f" N = 200 s, up to {EXCITED_SECS:.0f} s. Later windows contain no moving rudder, and e is"
        " unidentifiable by any method. The paper states that the coefficients of ω change in steps"
        " during the first 50 s; this is confirmed. It states that those of v change smoothly; this"
        " is true except for f during its first 10 s, when the ship does not turn. “All by about"
        " 200 s” is wrong: b₁ takes longer, and e never settles. That a, d, g and h are correct at"
        " once is no evidence for the method: they are those of the filter's model, see the section"
        " on the prior."
    )


def median_and_latest(times: FloatArray) -> str:
    """Format the median and the latest of some settling times, s."""
    median, latest = (
        "never" if at > EXCITED_SECS - 5 * STRIDE_SECS else f"{at:.0f} s" if at else "at once"
        for at in (float(np.median(times)), float(times.max()))
    )
    return median if median == latest else f"{median}; {latest}"


def settling_times(ends: FloatArray, values: FloatArray, target: FloatArray) -> FloatArray:
    """Return the last time at which each coefficient deviates by over 10 % from its target, (9,).

    Parameters
    ----------
    ends
        The ends of the windows, (k,), s.
    values
        The coefficients of each window, (k, 9).
    target
        The values to compare with, (9,).
    """
    outside = np.abs(values - target) > 0.1 * np.abs(target)
    return np.asarray(np.where(outside, ends[:, None], 0.0).max(axis=0))


def jump() -> None:
    """Print the effect of the jump of w'' on the coefficients, with clean data and true prior."""
    rows = []
    for name, preset in READINGS.items():
        c = vessel_of(preset).coefficients
        _, signals = measured(preset, "none")
        for label, jumps in (("as printed", False), ("with the jump", True)):
            errors = percent(
                paper_coefficients(signals, c, estimates(signals, c, jumps=jumps)), nine(c)
            )
            rows.append((f"{label}, {name}", *rounded(errors)))
        errors = percent(weak_form_coefficients(signals, c)[0], nine(c))
        rows.append((f"weak form, {name}", *rounded(errors)))
    table("The jump needed to identify e", ("error in %", *NAMES), rows)
    paragraph(
        "No noise, the true model in the filter, all 500 s in one window. Row 3 of the model"
        " assumes a constant rate of the rudder. When the rudder starts or stops, ω̈ jumps by"
        " ks·e·Δδ̇, which the paper's filter does not include: e is not identified, and its"
        " effect is attributed to the other coefficients. Adding this term to x₃ and propagating"
        " the model by Runge-Kutta corrects it. Weak form does not use ω̈ and needs no such term."
    )


def circularity() -> None:
    """Print how the errors of a wrong prior return in the coefficients."""
    c = vessel_of("table1").coefficients
    signs = np.random.default_rng(1).choice((-1.0, 1.0), (8, 9))
    priors = nine(c) * (1 + 0.2 * signs)
    rows, largest_difference = [("the prior", *["20"] * 9)], 0.0
    for noise, label in (("none", "no noise"), ("paper", "with noise")):
        _, signals = measured("table1", noise)
        errors, difference = errors_with_priors(signals, c, priors)
        largest_difference = max(largest_difference, difference)
        rows.append((f"the paper's method, {label}", *rounded(np.median(errors, axis=0))))
        weak = np.abs(percent(weak_form_coefficients(signals, c)[0], nine(c)))
        rows.append((f"weak form, {label}", *rounded(weak)))
    table("A prior with errors of 20 %", ("error in %", *NAMES), rows)
    paragraph(
        "Medians over eight priors, each coefficient at random 20 % too large or too small; the"
        " jump term is added, all 500 s are in one window; weak form has no prior. The ω̈ and v̇"
        " of the filter are those of its model, and the regression returns that model: where they"
        " are computed directly from the filter's w, w' and v by (4), the result *is* the prior,"
        f" here to {number(largest_difference, 1)} % for any data. Where they are propagated as in"
        " (6), the errors become larger."
    )
    spectral_radii()
    draw_feedback(signs[0])


def errors_with_priors(
    signals: Signals, c: Coefficients, priors: FloatArray
) -> tuple[list[FloatArray], float]:
    """Fit the coefficients by the paper's method with each of several priors.

    Returns
    -------
    tuple
        The absolute errors (9,) of each fit, in %; and the largest difference, in %, of the fit
        from the prior where w'' and v' are computed by the prior's (4).
    """
    errors, difference = [], 0.0
    for prior in priors:
        x = estimates(signals, with_nine(c, prior))
        errors.append(np.abs(percent(paper_coefficients(signals, c, x), nine(c))))
        for values, equation in zip(
            (prior[:6], prior[6:]), regression_rows(signals, c, x), strict=True
        ):
            equation[:, -1] = equation[:, :-1] @ values  # w'' and v' by the prior's (4)
            returned = np.abs(percent(solve_window(equation), values))
            difference = max(difference, float(returned.max()))
    return errors, difference


def refitted(signals: Signals, c: Coefficients, prior: FloatArray) -> FloatArray:
    """Fit the nine coefficients (9,) by the paper's method with `prior` in its filter.

    The result is NaN where the model in the filter diverges.
    """
    x = estimates(signals, with_nine(c, prior))
    return paper_coefficients(signals, c, x) if np.abs(x).max() < MAX_STATE else np.full(9, np.nan)


def spectral_radii() -> None:
    """Print by how much an error of the prior is amplified."""
    rows = []
    for name in ("paper", "turning-circle", "zigzag-20-20"):
        radii = []
        for preset in READINGS.values():
            c = vessel_of(preset).coefficients
            _, signals = measured(preset, "none", name=name)
            base, steps = nine(c), 1e-4 * np.eye(9)
            shifted = [[refitted(signals, c, base * (1 + s * m)) for m in steps] for s in (1, -1)]
            jacobian = (np.array(shifted[0]) - np.array(shifted[1])) / 2e-4 / base
            radii.append(f"{np.abs(np.linalg.eigvals(jacobian)).max():.2f}")
        rows.append((name, *radii))
    table("", ("run, without noise", "spectral radius, degrees", "radians"), rows)
    paragraph(
        "The spectral radius is that of the Jacobian of the fitted coefficients with respect to"
        " the prior, both relative to the truth. It is 0 for a method that uses the data alone,"
        " and 1 for one that returns its prior. Above 1 errors grow from round to round when the"
        " fitted coefficients are fed back into the filter, as in the paper's observer “with"
        " current adjustment by identification”."
    )


def draw_feedback(signs: FloatArray) -> None:
    """Draw the error of the coefficients when they are fed back into the filter."""
    c = vessel_of("table1").coefficients
    _, signals = measured("table1", "none")
    figure, axes = plt.subplots(figsize=(6.8, 3.2))
    for error in INITIAL_ERRORS:
        prior = nine(c) * (1 + error * signs)
        worst = [100 * error]
        while len(worst) <= MAX_ROUNDS:
            prior = refitted(signals, c, prior)
            if not np.isfinite(prior).all():
                axes.plot(len(worst) - 1, worst[-1], "x", color="black", ms=9)
                break
            worst.append(float(np.abs(percent(prior, nine(c))).max()))
        axes.semilogy(worst, marker="o", ms=3, label=f"{100 * error:g} %")
    axes.set(xlabel="round", ylabel="largest error of a coefficient (%)")
    axes.legend(title="error of the prior", loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture(
        "continuous_identification_feedback",
        figure,
        "Coefficients fitted and fed back into the filter repeatedly, data without noise. The"
        " errors oscillate as they grow, because the leading eigenvalues are a complex pair. A"
        " cross marks the coefficients with which the model in the filter diverges.",
    )
    plt.close(figure)


def table2() -> None:
    """Compare Table 2 with the rms differences between restored and original model."""
    sizes = restored_errors()
    rows = [
        Row(f"{name} ({unit})", f"{float(printed) / size:.2g}", value / size, remark)
        for name, printed, value, (unit, size), remark in zip(
            STATES, TABLE2, sizes[CLOSEST_CASE].tolist(), UNITS2, table2_remarks(), strict=True
        )
    ]
    comparison("Table 2, rms difference between the restored and the original model", rows)
    paragraph(
        "Computed in radians, without noise, with the filter as printed, all 500 s in one window."
        " Other cases, in SI units:"
    )
    cases = {
        "radians, no noise, last 200 s": ("table1-rad", "none", "last"),
        "radians, noise": ("table1-rad", "paper", "whole"),
        "degrees, no noise": ("table1", "none", "whole"),
        "degrees, noise": ("table1", "paper", "whole"),
        "degrees, noise, weak form": ("table1", "paper", "weak"),
    }
    others = [(case, *(number(float(v), 2) for v in sizes[key])) for case, key in cases.items()]
    table("", ("", *STATES), others)
    limits = [float(TABLE2[k]) * DURATION / np.sqrt(2) for k in (1, 3)]
    paragraph(
        "The table contradicts itself. The rms over T of an error that starts at zero is at most"
        " T/√2 times that of its rate: with the printed w' and v' at most"
        f" {number(limits[0], 2)} for w and {number(limits[1], 2)} for v. The printed values are"
        f" {0.05 / limits[0]:.0f} and {0.014 / limits[1]:.0f} times as large. No unit common to a"
        " state and its rate explains it."
    )
    lower_bound = cramer_rao_bound()
    paragraph(
        "The table cannot result from data with the printed noise either: with ±0.2 m/s on the log,"
        " ten samples a second, without the sine, the Cramér–Rao bound of the restored v' is"
        f" {number(lower_bound, 2)} m/s² (radians; f, g, h free),"
        f" {lower_bound / float(TABLE2[3]):.0f} times the printed value. The printed w' and v' are"
        " of the size of those of a run nearly without noise in radians, as above. The printed w'',"
        " twenty times smaller than ours, would need an e that this filter cannot identify."
    )


def restored_errors() -> dict[tuple[str, str, str], FloatArray]:
    """Compute the rms differences between the restored models and the original.

    Returns
    -------
    dict
        The rms (5,) of each of `STATES`, SI, by the reading of Table 1, the noise, and the
        coefficients: of the whole run, of the last window, or in weak form.
    """
    sizes = {}
    for preset in ("table1-rad", "table1"):
        vessel = vessel_of(preset)
        for noise in ("none", "paper"):
            _, signals = measured(preset, noise)
            x = estimates(signals, vessel.coefficients, jumps=False)
            for name, values in (
                ("whole", paper_coefficients(signals, vessel.coefficients, x)),
                ("last", window_coefficients(signals, vessel.coefficients, x)[1][-1]),
                ("weak", weak_form_coefficients(signals, vessel.coefficients)[0]),
            ):
                error = restored_error(vessel, values)
                sizes[preset, noise, name] = np.sqrt(np.mean(error**2, axis=0))
    return sizes


def restored_error(vessel: Vessel, values: FloatArray) -> FloatArray:
    """Return the states (m, 5) of a ship with other coefficients (9,), minus the true states."""
    restored = replace(vessel, coefficients=with_nine(vessel.coefficients, values))
    return truth_of(restored) - truth_of(vessel)


def table2_remarks() -> tuple[str, ...]:
    """Return a remark on each row of Table 2."""
    vessel = vessel_of("table1-rad")
    _, signals = measured("table1-rad", "none")
    x = estimates(signals, vessel.coefficients, jumps=False)
    error = restored_error(vessel, paper_coefficients(signals, vessel.coefficients, x))
    constant = np.abs(np.diff(signals["rudder"])) < 1e-12
    quiet = float(np.sqrt(np.mean(error[constant[: len(error)], 0] ** 2)))
    return (
        f"{quiet / 1e-9:.2g} while the rudder is constant; while it moves, e is wrong",
        "",
        "impossible with the printed w'",
        "",
        "impossible with the printed v'",
    )


def cramer_rao_bound() -> float:
    """Compute the Cramér-Rao bound of the rms of the restored v', m/s²."""
    vessel = vessel_of("table1-rad")
    c, sigma = vessel.coefficients, 0.2 / np.sqrt(3)
    slopes = []
    for name in SURGE_COEFFICIENTS:
        value = getattr(c, name)
        shifted = (c._replace(**{name: value * (1 + side)}) for side in (1e-4, -1e-4))
        above, below = (truth_of(replace(vessel, coefficients=m)) for m in shifted)
        slopes.append((above - below) / (2e-4 * value))
    rates, speeds = (np.column_stack([slope[:, k] for slope in slopes]) for k in (3, 4))
    covariance = np.linalg.inv(speeds.T @ speeds) * sigma**2
    return float(np.sqrt(np.mean(np.einsum("ki,ij,kj->k", rates, covariance, rates))))


if __name__ == "__main__":
    main()

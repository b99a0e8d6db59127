"""Burylin: continuous identification of a nonlinear vessel model, printed against computed.

The paper's filter and its least squares over a sliding window as it has them
(`analysis.identification.comparison.paper_scheme`), and what shiplog does, the equations in weak
form.

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
NEAREST = ("table1-rad", "none", "whole")
STATES = ("w''", "w'", "w", "v'", "v")
POINT = (0.3, 0.01, 9.0, 20.0, 2.5, 80.0, 0.5)  # w, w', v, delta, delta', n, n'
ROUNDS = 28  # of coefficients found and put back into the filter,
STARTS = (0.2, 0.01, 0.001)  # from priors off by so much
FAR = 1e6  # in any state: the model has run away
TOLD_SECS = 400.0  # until then a window of 200 s sees the rudder move
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
    ("(1)", "c₂ω/ω", "c₂ω·|ω|", "scanned: a stroke for a bar, as in (4)"),
    ("(5)", "ẋ[k+1] = A x[k] + …", "x[k+1] = exp(A·dt) x[k] + …", "A is of the derivative"),
    ("row 4", "v̇ = x₄ = …", "v̇ = ẋ₄ = …", "the dot is lost"),
    ("u₇", "v·δ̇, which is u₈", "**v·δ**", "row 2: b₄ u₇ is α₁vδ/(T₁T₂)"),
    (
        "u₉",
        "v̇·n·δ·E",
        "**n·δ·E**; v̇·n·δ·E is **u₂₀**",
        "one symbol for two: row 2 needs the former, row 3 the latter",
    ),
    ("u₁₉", "v̇·δ̇·E", "**v̇·n·δ̇·E**", "d(n·E)/dt = ṅE − α₃·v̇·n·E"),
    ("B, row 3", "b₂·sign(x₁) at u₁₄", "**2·**b₂·sign(x₁)", "the equation above it has the 2"),
    (
        "B, rows",
        "17, 18, 17, 17, 17 entries",
        "20 each",
        "19 inputs are defined; in row 5 h, 2f, 2g stand two columns too far left",
    ),
    ("(6)", "L = A P Cᵀ(…)⁻¹, of discrete time", "P is of continuous time", "see the covariance"),
    (
        "noise",
        "sin(τ⁻¹); v + 0.2v; Gaussian, uniform",
        "sin(t/τ); v + 0.2ν; uniform on [−1, 1]",
        "ν is scanned as v",
    ),
    ("(7)", "Υ = [v² ω² n], A = [f g h]", "[ω² v² n]", "the order; by (4) f stands at ω²"),
    ("(7)", "δ(αv + …)", "δ(α₁v + …)", "an index is lost"),
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
    """The states by the paper's filter, (m, 5), the model in it being `prior`."""
    return paper_states(signals, prior, as_printed=not jumps)


def identified(signals: Signals, c: Coefficients, x: FloatArray) -> FloatArray:
    """The paper's nine coefficients from all of a run, (9,)."""
    return np.concatenate([solve_window(rows) for rows in regression_rows(signals, c, x)])


# ------------------------------------------------------------------------------------- the run


@cache
def vessel_of(preset: str) -> Vessel:
    """A reading of Table 1."""
    return load_vessel(preset)[0]


def measured(
    preset: str, noise: str, seed: int = 0, name: str = "paper"
) -> tuple[SimulatedTrial, Signals]:
    """A run of 500 s, and its signals on one clock."""
    sensors = suite(noise, angle_unit=vessel_of(preset).angle_unit)
    trial = simulate(vessel_of(preset), name, duration_secs=DURATION, seed=seed, sensors=sensors)
    channels = ("yaw_rate", "speed", "rudder", "rpm")
    return trial, resample(TrialLog("run", trial.channels), channels=channels)


def truth_of(vessel: Vessel, name: str = "paper") -> FloatArray:
    """w'', w', w, v', v of a ship on the paper's run, every 0.1 s, (m, 5)."""
    c, times = vessel.coefficients, np.arange(int(DURATION / DT)) * DT
    sailed = compute_trajectory(
        vessel, manoeuvre(name, DURATION, vessel.approach_rpm), DURATION
    ).at(times + 1e-9)
    w, w_dot, v, n = (sailed[k] for k in ("yaw_rate", "yaw_acceleration", "speed", "rpm"))
    delta = sailed["rudder"]
    rate = np.diff(delta, append=delta[-1]) / DT
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w**3
    w_ddot = hull + rudder_effects(c, v, n) * (c.d * delta + c.e * rate)
    return np.column_stack((w_ddot, w_dot, w, c.f * w * w + c.g * v * v + c.h * n, v))


def nine(c: Coefficients) -> FloatArray:
    """The nine coefficients in the order of `NAMES`."""
    return np.array(c[:9])


def with_nine(c: Coefficients, values: FloatArray) -> Coefficients:
    """The same alphas with other coefficients."""
    return c._replace(**dict(zip(NAMES, map(float, values), strict=True)))


def percent(found: FloatArray, true: FloatArray) -> FloatArray:
    """Errors in % of the true values."""
    return 100 * (found / true - 1)


def in_weak_form(signals: Signals, c: Coefficients) -> tuple[FloatArray, list[CoefficientHistory]]:
    """Shiplog's coefficients of the whole run, (9,), and their histories of yaw and surge."""
    values: list[float] = []
    histories = []
    for rows in weak_form(signals, c):
        found, history = fit_coefficients(rows)
        values += [found.coefficients[name].value for name in rows.equation.names]
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
        "The paper has two tables, a covariance and four figures. The covariance comes out to"
        " every printed digit; Table 2 in part, and only of a run nearly free of noise. Of the"
        " figures the scan has the captions but not the curves, and the text prints neither the"
        " manoeuvre nor the step nor the window's length N: the run is that of our notes"
        " (n = 100 rpm, v₀ = 2 m/s, rudder +20° at 0 s, −20° at 200 s, at 2.5 °/s), the step is"
        " 0.1 s, N as said. “The paper's” below is its filter and its least squares as printed,"
        " kept in shiplog for comparison; “weak form” is what shiplog does instead."
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
    """Errors in few digits, without exponents below 10 000."""
    texts = (f"{v:.0f}" if 100 <= abs(v) < 1e4 else f"{v:{form}}" for v in values)
    return [text.replace("-", "−").replace("nan", "–") for text in texts]


def table1() -> None:
    """What the table means, read in degrees and in radians."""
    deg, rad = (vessel_of(name).coefficients for name in READINGS.values())
    rows = [
        (name, PRINTED.get(name, ""), number(getattr(deg, name)), number(x))
        for name, x in rad._asdict().items()
    ]
    head = ("coefficient", "printed", "read in degrees (SI)", "read in radians (SI)")
    table("Table 1, the model's parameters", head, rows)
    paragraph("The paper does not say in what its angles are. Its numbers make two ships of it:")
    circles = []
    for name, preset in READINGS.items():
        vessel = vessel_of(preset)
        sailed = compute_trajectory(vessel, manoeuvre("turning-circle-35", 4000.0, 80.0), 4000.0)
        end = sailed.at(np.array([500.0, 3999.0]))
        w, v = end["yaw_rate"] / DEG, end["speed"]
        kept = 100 * v[1] / steady_speed(vessel.coefficients, 80.0)
        wide = 2 * v[1] / (w[1] * DEG)
        circles.append((name, f"{w[1]:.3f} °/s", f"{wide:.0f} m", f"{kept:.0f} %"))
    table("", ("read in", "yaw rate at 35°, 80 rpm", "diameter", "speed kept"), circles)
    speeds = ", ".join(
        f"{steady_speed(deg, n):.3f}" for n in (20.0, 40.0, 60.0, 80.0, 100.0, 150.0)
    )
    paragraph(
        f"Straight ahead at 20, 40, 60, 80, 100 and 150 rpm both make {speeds} m/s. Read in degrees"
        " it is a plausible ship of some 200 m; in radians the hull hardly feels the turn. Yet the"
        " size of the noise (A_ω = 5·10⁻⁵, nothing in degrees) and of Table 2 speak for radians."
        " shiplog has both, `table1` and `table1-rad`."
    )


def formulas() -> None:
    """The paper's formulas that are not right as printed."""
    table("The formulas", ("where", "printed", "right", "why"), FORMULAS)
    paragraph("E = exp(−v·α₃). The rest of (1) to (7) is right as printed, under δ̈ = n̈ = 0.")
    table("The matrix B", ("row", "printed, as column: entry", "right"), PRINTED_ROWS)
    paragraph(
        "s = sign(x₁); row 1 is zero in both. With the twenty pseudo-inputs A x + B u is the"
        " derivative itself, as the next table shows at one point."
    )


def point() -> None:
    """A x + B u at one point, right and as printed, beside the derivative itself."""
    c = vessel_of("table1-rad").coefficients  # the numbers as printed, in whatever angles
    w, w_dot, v, delta, rate, n, n_dot = POINT

    def accelerations(h: float) -> FloatArray:
        """w'' and v' a moment later, along the motion."""
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
    head = ("", "the derivative", "A x + B u, right", "equations as printed", "matrix as printed")
    table("At one point", head, rows)
    C = np.eye(5)[[0, 3]]
    seen = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(5)])
    paragraph(
        "At w = 0.3, w' = 0.01, v = 9, δ = 20, δ' = 2.5, n = 80, n' = 0.5, in the table's own"
        f" angles. The pair (A, C) shows {np.linalg.matrix_rank(seen)} states of 5, w, w' and v: no"
        " measurement corrects ω̈ and v̇, and the latter's error does not even decay. The algebraic"
        " Riccati equation that the paper names has no stabilising solution for such a pair."
    )


def covariance() -> None:
    """The printed P, from the continuous Riccati equation."""
    A, _ = pseudo_input_matrices(vessel_of("table1").coefficients, 1.0)
    C = np.eye(5)[[0, 3]]

    def rate(_: float, flat: FloatArray) -> FloatArray:
        P = flat.reshape(5, 5)
        return np.asarray(A @ P + P @ A.T + Q * np.eye(5) - P @ C.T @ C @ P / R).ravel()

    times = np.linspace(1.0, 1000.0, 1000)
    start, span = P0 * np.eye(5).ravel(), (0.0, 1000.0)
    run = solve_ivp(rate, span, start, "LSODA", times, rtol=1e-10, atol=1e-12)
    history = run.y.T.reshape(-1, 5, 5)
    P = history[round(P_SECS) - 1]
    remarks = {
        (3, 3): f"Q/(2·abs(a)) = {Q / 2 / -A[1, 1]:.4f}: no measurement takes part",
        (4, 4): "√(QR) = 2 when settled, 2.005 in discrete time at 1 s: neither is printed",
        (5, 5): "P(0) + Q·t, without end: so t = 378 s",
    }
    rows = [
        Row(f"P({i},{j})", text, float(P[i - 1, j - 1]), remarks.get((i, j), ""))
        for (i, j), text in PRINTED_P.items()
    ]
    others = max(float(np.abs(P[:3, 3:]).max()), abs(float(P[3, 4])))
    comparison("The covariance", [*rows, Row("its other entries", "0", others)])
    paragraph(
        "The equation is P' = A P + P Aᵀ + Q − P Cᵀ R⁻¹ C P with R = 400·I and G = I as printed,"
        " Q = 0.01·I and P(0) = 10·I not printed, at t = 378 s: continuous time, and neither the"
        " discrete filter of (6) nor “settled”, with the true coefficients in A. Its gains P Cᵀ/R:"
    )
    K = P[:, [0, 3]] / R
    gains = [
        (name, *(number(float(k), 2) for k in K[:, i]))
        for i, name in enumerate(("from w", "from v"))
    ]
    table("", ("gain", "to w (1/s)", "w' (1/s²)", "w'' (1/s³)", "v (1/s)", "v' (1/s²)"), gains)
    paragraph(
        f"v follows the log with a time constant of {1 / K[3, 1]:.0f} s, w the gyro with some"
        f" {1 / K[0, 0]:.0f} s, w'' and v' follow nothing: the filter is its model running by"
        " itself, a little drawn to the data."
    )
    drawn, axes = plt.subplots(figsize=(6.8, 3.2))
    for k, name in enumerate(("w", "w'", "w''", "v", "v'")):
        (line,) = axes.semilogy(times, history[:, k, k], label=name)
        axes.plot([P_SECS], [float(PRINTED_P[k + 1, k + 1])], "o", color=line.get_color(), ms=6)
    axes.axvline(P_SECS, color="black", lw=0.8, ls=":")
    axes.set(xlabel="t (s)", ylabel="variance: P's diagonal", xlim=(0, 1000))
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture(
        "continuous_identification_covariance",
        drawn,
        "P's diagonal, and as dots what the paper prints as settled, at 378 s: v' only grows.",
    )
    plt.close(drawn)


def figures() -> None:
    """The four figures, for a run under the paper's noise, read in degrees."""
    vessel = vessel_of("table1")
    c, true = vessel.coefficients, truth_of(vessel)
    _, signals = measured("table1", "paper")
    x = estimates(signals, c, jumps=False)
    paragraph("## The figures")
    paragraph(
        "Of the run named above, read in degrees, under the paper's noise, with the true model in"
        " the filter, as the paper has it."
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
        2, "yaw rate (its noise is thinner than the line) and its derivatives", panels[2:], true, x
    )
    rows = []
    for label, per, i, k, noisy in panels:
        spread = [true[:, i], x[: len(true), k] - true[:, i]]
        if noisy is not None:
            spread.insert(1, noisy[: len(true)] - true[:, i])
        sizes = [number(float(np.sqrt(np.mean(s**2))) / per, 2) for s in spread]
        rows.append((label, *(sizes if noisy is not None else (sizes[0], "–", sizes[1]))))
    table("", ("rms of", "the state", "the sensor's error", "the filter's error"), rows)
    paragraph(
        "“Insignificant for the derivatives, satisfactory for the signals”: so it is, for model and"
        " truth are one here. The filter's v̂ begins at the first noisy sample, and its error then"
        " decays with the time constant above. In figures 3 and 4 the blue line is the paper's; the"
        " red one is the same from a prior a fifth off, as any prior of a real ship is."
    )
    coefficient_figures(signals, c, x)


Panel = tuple[str, float, int, int, FloatArray | None]


def states_figure(
    which: int, what: str, panels: tuple[Panel, ...], true: FloatArray, x: FloatArray
) -> None:
    """Figure 1 or 2: truth, measurement and estimate."""
    t = np.arange(len(true)) * DT
    size = (6.8, 1.7 * len(panels) + 0.7)
    drawn, plots = plt.subplots(len(panels), 1, figsize=size, sharex=True)
    for axes, (label, per, i, k, noisy) in zip(plots, panels, strict=True):
        if noisy is not None:
            axes.plot(t, noisy[: len(t)] / per, color=GREY, lw=0.5, alpha=0.7, label="measured")
        axes.plot(t, true[:, i] / per, color=AMBER, lw=3, label="truth")
        axes.plot(t, x[: len(t), k] / per, color=BLUE, lw=1.2, label="the paper's filter")
        axes.set(ylabel=label, xlim=(0, DURATION))
    plots[-1].set_xlabel("t (s)")
    drawn.legend(*plots[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    drawn.align_ylabels()
    caption = f"The paper's figure {which}: {what}, estimated by its filter."
    picture(f"continuous_identification_{which}", drawn, caption)
    plt.close(drawn)


def coefficient_figures(signals: Signals, c: Coefficients, x: FloatArray) -> None:
    """Figures 3 and 4: the coefficients window by window, the paper's beside weak form."""
    ends, found = window_coefficients(signals, c, x)
    signs = np.where(np.arange(9) % 2, -1.0, 1.0)
    wrong = with_nine(c, nine(c) * (1 + 0.2 * signs))
    _, misled = window_coefficients(signals, c, estimates(signals, wrong, jumps=False))
    yaw, surge = in_weak_form(signals, c)[1]
    for which, history, height in ((3, surge, 2.6), (4, yaw, 4.4)):
        names = history.names
        size = (7.4, height)
        drawn, plots = plt.subplots(len(names) // 3, 3, figsize=size, sharex=True, sharey=True)
        for axes, name in zip(plots.flat, names, strict=True):
            true = getattr(c, name)
            axes.axhline(1, color="black", lw=0.8)
            axes.plot(
                ends,
                found[:, NAMES.index(name)] / true,
                color=BLUE,
                label="the paper's, true prior",
            )
            off = misled[:, NAMES.index(name)] / true
            axes.plot(ends, off, color=RED, lw=1.1, label="the paper's, prior off by 20 %")
            ours = history.values[:, names.index(name)] / true
            axes.plot(history.time_secs, ours, color=GREEN, label="weak form")
            axes.set(title=name, xlim=(0, DURATION), ylim=(-0.2, 2.2))
        drawn.supxlabel("t, end of the window (s)", fontsize=9.5)
        drawn.supylabel("value / truth", fontsize=9.5)
        drawn.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
        velocity = "linear" if which == 3 else "angular"
        picture(
            f"continuous_identification_{which}",
            drawn,
            f"The paper's figure {which}: coefficients of the {velocity} velocity's equation,"
            " N = 200 s. The wrong prior is 20 % too large and too small by turns; weak form has"
            " none, and is blank where a window cannot tell.",
        )
        plt.close(drawn)


def settling() -> None:
    """From when on each coefficient is within a tenth, of where it ends and of the truth."""
    c = vessel_of("table1").coefficients
    worst, ended, right = [], [], []
    for seed in SEEDS:
        _, signals = measured("table1", "paper", seed)
        ends, found = window_coefficients(signals, c, estimates(signals, c, jumps=False))
        worst.append(np.abs(percent(found[ends <= 50], nine(c))).max(axis=0))
        told = ends <= TOLD_SECS  # beyond, no window has a moving rudder, and e is zero
        ended.append(within(ends[told], found[told], found[told][-1]))
        right.append(within(ends[told], found[told], nine(c)))
    spikes = rounded(np.median(worst, axis=0))
    rows = []
    for k, name in enumerate(NAMES):
        said = [when(np.array(instants)[:, k]) for instants in (ended, right)]
        rows.append((name, f"{spikes[k]} %", "about 200 s", *said))
    head = ("", "worst error in the first 50 s", "printed: settled after")
    table(
        "How fast the coefficients settle",
        (*head, "within 10 % of its end", "within 10 % of the truth"),
        rows,
    )
    paragraph(
        f"Of {len(SEEDS)} runs like that of the figures the median, and the latest where it"
        f" differs; N = 200 s, up to {TOLD_SECS:.0f} s: after that the window holds no moving"
        " rudder and e is lost whatever the method. That ω's coefficients come in jumps in the"
        " first 50 s holds, that v's come smoothly does too, but for f's first 10 s, when nothing"
        " turns; “all by about 200 s” does not: b₁ takes longer, e never comes. That a, d, g and h"
        " are there at once is no merit: they are the filter's own, as the circle below shows."
    )


def when(instants: FloatArray) -> str:
    """Median and latest of some instants, in words."""
    said = [
        "never" if at > TOLD_SECS - 5 * STRIDE_SECS else f"{at:.0f} s" if at else "at once"
        for at in (float(np.median(instants)), float(instants.max()))
    ]
    return said[0] if said[0] == said[1] else f"{said[0]}; {said[1]}"


def within(ends: FloatArray, found: FloatArray, aim: FloatArray) -> FloatArray:
    """The last instant at which each coefficient is more than a tenth off its aim, (9,)."""
    away = np.abs(found - aim) > 0.1 * np.abs(aim)
    return np.asarray(np.where(away, ends[:, None], 0.0).max(axis=0))


def jump() -> None:
    """What the rudder's start does to e, with clean data and the true prior."""
    rows = []
    for name, preset in READINGS.items():
        c = vessel_of(preset).coefficients
        _, signals = measured(preset, "none")
        for said, jumps in (("as printed", False), ("with the jump", True)):
            off = percent(identified(signals, c, estimates(signals, c, jumps=jumps)), nine(c))
            rows.append((f"{said}, {name}", *rounded(off)))
        off = percent(in_weak_form(signals, c)[0], nine(c))
        rows.append((f"weak form, {name}", *rounded(off)))
    table("The jump that saves e", ("error in %", *NAMES), rows)
    paragraph(
        "No noise, the true model in the filter, all 500 s in one window. Row 3 of the model takes"
        " the rudder's rate for constant; when the rudder starts or stops, ω̈ jumps by ks·e·Δδ̇,"
        " which the paper's filter never sees: e is lost, and what it should have explained is"
        " laid on the others. That one term added to x₃, and the model propagated by Runge-Kutta,"
        " mend it. Weak form knows no ω̈ and needs no such term."
    )


def circularity() -> None:
    """A prior off by 20 %: found again, or made worse."""
    c = vessel_of("table1").coefficients
    true = nine(c)
    signs = np.random.default_rng(1).choice((-1.0, 1.0), (8, 9))
    draws = true * (1 + 0.2 * signs)
    rows, copied = [("the prior", *["20"] * 9)], 0.0
    for noise, said in (("none", "clean"), ("paper", "noise")):
        _, signals = measured("table1", noise)
        off = []
        for draw in draws:
            x = estimates(signals, with_nine(c, draw))
            off.append(np.abs(percent(identified(signals, c, x), true)))
            for values, equation in zip(
                (draw[:6], draw[6:]), regression_rows(signals, c, x), strict=True
            ):
                equation[:, -1] = (
                    equation[:, :-1] @ values
                )  # w'' and v' as the prior's (4) has them
                copied = max(copied, float(np.abs(percent(solve_window(equation), values)).max()))
        rows.append((f"the paper's, {said}", *rounded(np.median(off, axis=0))))
        ours = np.abs(percent(in_weak_form(signals, c)[0], true))
        rows.append((f"weak form, {said}", *rounded(ours)))
    table("The circle: a prior off by 20 %", ("error in %", *NAMES), rows)
    paragraph(
        "Medians over eight priors, each coefficient 20 % too large or too small by the toss of a"
        " coin; the jump term added, all 500 s in one window; weak form has no prior. The"
        " filter's ω̈ and v̇ are what its model says, and the regression finds that model again:"
        " where they are computed from its w, w' and v by (4) outright, the result *is* the prior,"
        f" here to {number(copied, 1)} % whatever the data. Propagated as in (6), they make it"
        " worse."
    )
    radii()
    feedback(signs[0])


def again(signals: Signals, c: Coefficients, prior: FloatArray) -> FloatArray:
    """The nine coefficients that the paper's method finds with `prior` in its filter, (9,).

    NaN where the model in the filter runs away.
    """
    x = estimates(signals, with_nine(c, prior))
    return identified(signals, c, x) if np.abs(x).max() < FAR else np.full(9, np.nan)


def radii() -> None:
    """How an error of the prior is passed on."""
    rows = []
    for name in ("paper", "turning-circle", "zigzag-20-20"):
        found = []
        for preset in READINGS.values():
            c = vessel_of(preset).coefficients
            _, signals = measured(preset, "none", name=name)
            base, moves = nine(c), 1e-4 * np.eye(9)
            ends = [[again(signals, c, base * (1 + s * m)) for m in moves] for s in (1, -1)]
            columns = (np.array(ends[0]) - np.array(ends[1])) / 2e-4 / base
            found.append(f"{np.abs(np.linalg.eigvals(columns)).max():.2f}")
        rows.append((name, *found))
    table("", ("run, clean", "spectral radius, degrees", "radians"), rows)
    paragraph(
        "The spectral radius is that of the Jacobian of what is found against the prior, both as"
        " shares of the truth: 0 were a method that learns all from the data, 1 a copy; above 1"
        " errors grow from round to round when what is found goes back into the filter, which is"
        " what the paper's observer “with current adjustment by identification” asks for."
    )


def feedback(signs: FloatArray) -> None:
    """What becomes of the prior's error when coefficients go back into the filter."""
    c = vessel_of("table1").coefficients
    _, signals = measured("table1", "none")
    drawn, axes = plt.subplots(figsize=(6.8, 3.2))
    for off in STARTS:
        prior = nine(c) * (1 + off * signs)
        worst = [100 * off]
        while len(worst) <= ROUNDS:
            prior = again(signals, c, prior)
            if not np.isfinite(prior).all():
                axes.plot(len(worst) - 1, worst[-1], "x", color="black", ms=9)
                break
            worst.append(float(np.abs(percent(prior, nine(c))).max()))
        axes.semilogy(worst, marker="o", ms=3, label=f"{100 * off:g} %")
    axes.set(xlabel="round", ylabel="worst coefficient's error (%)")
    axes.legend(title="prior off by", loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture(
        "continuous_identification_feedback",
        drawn,
        "Coefficients found, put into the filter again and again, clean data. The errors swing"
        " as they grow, for the leading eigenvalues are a complex pair. A cross: with these the"
        " model in the filter runs away, and there is no next round.",
    )
    plt.close(drawn)


def table2() -> None:
    """The restored model against the original."""
    sizes, still = {}, np.abs(np.diff(measured("table1-rad", "none")[1]["rudder"])) < 1e-12
    for preset, noise in (
        ("table1-rad", "none"),
        ("table1-rad", "paper"),
        ("table1", "none"),
        ("table1", "paper"),
    ):
        vessel = vessel_of(preset)
        c, true = vessel.coefficients, truth_of(vessel)
        _, signals = measured(preset, noise)
        x = estimates(signals, c, jumps=False)
        for name, values in (
            ("whole", identified(signals, c, x)),
            ("last", window_coefficients(signals, c, x)[1][-1]),
            ("weak", in_weak_form(signals, c)[0]),
        ):
            off = truth_of(replace(vessel, coefficients=with_nine(c, values))) - true
            sizes[preset, noise, name] = np.sqrt(np.mean(off**2, axis=0))
            if (preset, noise, name) == NEAREST:
                quiet = float(np.sqrt(np.mean(off[still[: len(off)], 0] ** 2)))
    remarks = {
        "w''": f"while the rudder stands still {quiet / 1e-9:.2g}: e is lost while it moves",
        "w": "cannot stand beside the printed w'",
        "v": "cannot stand beside the printed v'",
    }
    rows = [
        Row(f"{name} ({unit})", f"{float(printed) / per:.2g}", value / per, remarks.get(name, ""))
        for name, printed, value, (unit, per) in zip(
            STATES, TABLE2, sizes[NEAREST].tolist(), UNITS2, strict=True
        )
    ]
    comparison("Table 2, rms of the restored model off the original", rows)
    paragraph(
        "Computed in radians, clean, the filter as printed, all 500 s in one window. Others, in SI:"
    )
    cases = {
        "radians, clean, last 200 s": ("table1-rad", "none", "last"),
        "radians, noise": ("table1-rad", "paper", "whole"),
        "degrees, clean": ("table1", "none", "whole"),
        "degrees, noise": ("table1", "paper", "whole"),
        "degrees, noise, weak form": ("table1", "paper", "weak"),
    }
    others = [(case, *(number(float(v), 2) for v in sizes[key])) for case, key in cases.items()]
    table("", ("", *STATES), others)
    most = [float(TABLE2[k]) * DURATION / np.sqrt(2) for k in (1, 3)]
    paragraph(
        "The table contradicts itself. An error that begins at zero is, in rms over T, at most T/√2"
        f" times its rate's: beside the printed w' and v' at most {number(most[0], 2)} for w and"
        f" {number(most[1], 2)} for v. The printed ones are {0.05 / most[0]:.0f} and"
        f" {0.014 / most[1]:.0f} times that, and no unit common to a state and its rate mends it."
    )
    least = bound()
    paragraph(
        "Nor can it be of data with the printed noise: with ±0.2 m/s on the log, ten samples a"
        " second, the sine left out, the Cramér–Rao bound of the restored v' is"
        f" {number(least, 2)} m/s² (radians; f, g, h free), {least / float(TABLE2[3]):.0f} times"
        " the printed. In size its w' and v' are those of a nearly clean run in radians, as above;"
        " its w'', twenty times less than ours, would need an e that this filter cannot find."
    )


def bound() -> float:
    """The Cramér-Rao bound of the rms of the restored v', m/s^2."""
    vessel = vessel_of("table1-rad")
    c, sigma = vessel.coefficients, 0.2 / np.sqrt(3)
    slopes = []
    for name in SURGE_COEFFICIENTS:
        value = getattr(c, name)
        moved = (c._replace(**{name: value * (1 + side)}) for side in (1e-4, -1e-4))
        above, below = (truth_of(replace(vessel, coefficients=m)) for m in moved)
        slopes.append((above - below) / (2e-4 * value))
    rates, speeds = (np.column_stack([slope[:, k] for slope in slopes]) for k in (3, 4))
    spread = np.linalg.inv(speeds.T @ speeds) * sigma**2
    return float(np.sqrt(np.mean(np.einsum("ki,ij,kj->k", rates, spread, rates))))


if __name__ == "__main__":
    main()

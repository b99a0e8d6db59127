"""Comparison of Sakharov, Shergina and Chertkov's paper with the values computed by shiplog.

The plant of the paper's example is the short-period mode of an aeroplane in Dryden's gusts. All
numbers follow from six matrices, σ and L. The paper's program is repeated step by step with the
functions of shiplog.

    python examples/papers/steady_state_filter.py > docs/papers_steady_state_filter.md
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from markdown_page import (
    AMBER,
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
from scipy.linalg import solve_continuous_lyapunov

from analysis.design.discrete import discretise
from analysis.design.riccati import Gain, kalman_gain
from analysis.design.shaping import (
    ShapedSystem,
    TransferFunction,
    augment_with_shaping,
    shaped_variance,
    spectral_factor,
)
from shiplog.types import FloatArray

SIGMA, L = 10.0, 3.49
ACTUATOR = 20.2
PAPERS_ORDER = [0, 1, 3, 4, 2]  # the actuator is last in the paper, the shaping filter in shiplog
DT, SHOWN_SECS, STEPS = 0.02, 60.0, 400_000
MISPRINT = "misprint: see below"
NAMES = ("x₁", "x₂", "x_w1", "x_w2")

PRINTED_GAIN = (
    ("0.0373", "-0.0041"),
    ("-0.0202", "0.0029"),
    ("1.9051", "-0.2875"),
    ("3.5992", "-2.2457"),
    ("0", "0"),
)
PRINTED_CLOSED = (
    ("-1.6118", "0.8589", "0.0266", "0.0044", "-0.0022"),
    ("1.1410", "-1.0529", "-0.0215", "-0.0036", "-0.1756"),
    ("-30.2332", "-2.5341", "-0.5731", "-0.0821", "0"),
    ("-57.1188", "-5.0851", "1.0000", "0", "0"),
    ("0", "0", "0", "0", "-20.2000"),
)
PRINTED_AUGMENTED = (
    ("-1.0200", "0.9100", "0.0266", "0.0044", "-0.0022"),
    ("0.8200", "-1.0800", "-0.0215", "-0.0036", "-0.1756"),
    ("0", "0", "-0.5731", "-0.0821", "0"),
    ("0", "0", "1.0000", "0", "0"),
    ("0", "0", "0", "0", "-20.2000"),
)
PRINTED_POLES = ("-20.2000", "-1.5224", "-1.1734", "-0.3759", "-1.1661")


@dataclass(frozen=True)
class Reading:
    """One reading of the inputs that the paper prints in more than one way.

    Attributes
    ----------
    A21
        The entry (2, 1) of A0.
    C11
        The entry (1, 1) of C.
    G0
        The gains of the gust, in both equations of the plant.
    """

    A21: float = 0.82
    C11: float = 15.87
    G0: tuple[float, float] = (0.00203, -0.00164)

    def design(self) -> tuple[ShapedSystem, Gain]:
        """Return the plant with its shaping filter, and the Kalman filter, in shiplog's order."""
        A = np.array([[-1.02, 0.91, -0.0022], [self.A21, -1.08, -0.1756], [0, 0, -ACTUATOR]])
        C = np.array([[self.C11, 1.4811, 0], [0, 1, 0]])
        B = np.array([[0], [0], [ACTUATOR]])
        plant = augment_with_shaping(A, B, C, [*self.G0, 0], shaping())
        return plant, kalman_gain(plant.A, plant.G, plant.C, 1, np.diag([1 / 20, 1 / 60]))


READINGS = {
    "as used here": Reading(),
    "A0(2,1) = 0.8220, from the formula": Reading(A21=0.822),
    "C(1,1) = 15.8788, from the program": Reading(C11=15.8788),
    "G0 = (0.0020, −0.0016), as printed": Reading(G0=(0.0020, -0.0016)),
}

FORMULAS = (
    ("(4), (5)", "E[w(t+τ) wᵀ(t)] = Q δ(t)", "Q δ(τ)", "τ is the lag"),
    ("(8)", "A x + B u + L (y − ŷ)", "A x̂ + B u + L (y − ŷ)", "x is unknown; (9) has x̂"),
    (
        "(9)",
        "(A − LC) x̂ − L y",
        "(A − LC) x̂ + B u + L y",
        "follows from (8) and (10); correct in (20)",
    ),
    (
        "(11)",
        "P the only positive definite solution",
        "the only stabilising positive semidefinite solution",
        "no noise drives the actuator: rank 4, see below; the equation itself is correct",
    ),
    ("(18)", "noise enters by [C·Dw; Bw]", "[G0·Dw; Bw]", "no effect here: Dw = 0"),
    ("after (19)", "measurement noise w(t)", "v(t)", "as in (2)"),
    (
        "Φ(ω)",
        "2Lσ² (1 + 3L²ω²) / (1 + L²ω²)",
        "2Lσ² (1 + 3L²ω²) / (1 + L²ω²)²",
        "Dryden's spectrum; the printed H(s) is the factor of this one",
    ),
    (
        "sah175a.m",
        "`A=[A0 G0*Cw B0;0 0;0 0;0 0] [Aw;0 0] [0 0 -20.2]'`",
        "`A=[A0 G0*Cw B0; [0 0;0 0;0 0] [Aw;0 0] [0 0 -20.2]']`",
        "brackets missing; the printed line does not run",
    ),
)
CORRECT_FORMULAS = "(1) to (3), (6), (7), (10), (12) to (17), (19), (20)"


def dryden() -> tuple[FloatArray, FloatArray]:
    """Return numerator and denominator of the spectrum Φ, in descending powers of ω."""
    numerator = 2 * L * SIGMA**2 * np.array([3 * L**2, 0, 1])
    return numerator, np.array([L**4, 0, 2 * L**2, 0, 1])


def shaping() -> TransferFunction:
    """Return the shaping filter H(s), the spectral factor of Φ."""
    return spectral_factor(*dryden())


def main() -> None:
    """Print the page and draw its pictures."""
    start_page("Steady-state filter: printed against computed")
    paragraph(
        "V. V. Sakharov, O. V. Shergina, A. A. Chertkov, *Optimal estimator synthesis for ship"
        " dynamic object control*. This page is made by\n\n"
        "    python examples/papers/steady_state_filter.py > docs/papers_steady_state_filter.md"
    )
    paragraph(
        "The paper has one worked example, no tables and no figures. This page lists all its"
        " numbers and formulas. All numbers agree to the last printed digit except the two in"
        " bold; other numbers of the paper prove that these are misprints. The pictures are ours."
    )
    plant, design = READINGS["as used here"].design()
    order = np.ix_(PAPERS_ORDER, PAPERS_ORDER)
    A, gain = plant.A[order], design.gain[PAPERS_ORDER]
    closed = (plant.A - design.gain @ plant.C)[order]
    formulas()
    spectrum(shaping())
    comparison("The augmented system", matrix_rows("A", PRINTED_AUGMENTED, A))
    paragraph(
        f"B = {vector(plant.B[PAPERS_ORDER, 0])} and G = {vector(plant.G[PAPERS_ORDER, 0])}, as"
        " printed (the paper prints them as rows, but they are columns)."
    )
    readings()
    comparison("The Kalman gain", matrix_rows("L", PRINTED_GAIN, gain))
    from_closed = -3.5992 * 1.4811 + 5.0851
    paragraph(
        "L(4,2) is a misprint, because F = A − LC is also printed: F(4,2) = −L(4,1)·C(1,2) −"
        f" L(4,2), and therefore L(4,2) = −3.5992·1.4811 + 5.0851 = {number(from_closed, 4)}."
    )
    comparison("The filter's matrix F = A − LC", matrix_rows("F", PRINTED_CLOSED, closed))
    comparison(
        "Its eigenvalues",
        [
            Row(f"λ{k}", printed, float(pole.real), MISPRINT if k == 5 else "")
            for k, (printed, pole) in enumerate(zip(PRINTED_POLES, design.poles, strict=True), 1)
        ],
    )
    trace = sum(float(PRINTED_CLOSED[k][k]) for k in range(5))
    sum_of_poles = sum(map(float, PRINTED_POLES))
    paragraph(
        f"The trace of the printed F is {number(trace)}, the sum of the printed eigenvalues is"
        f" {number(sum_of_poles)}: one eigenvalue is wrong by {number(sum_of_poles - trace, 3)}."
        " With −0.1661 the sums agree. The slowest mode of the error therefore has a time constant"
        f" of {-1 / design.poles[-1].real:.1f} s, not 0.9 s."
    )
    accuracy(plant, design)


def vector(values: FloatArray) -> str:
    """Format a column vector in one line."""
    return f"[{' '.join(number(value) for value in values)}]ᵀ"


def matrix_rows(name: str, printed: tuple[tuple[str, ...], ...], computed: FloatArray) -> list[Row]:
    """Return a row for each entry of a matrix, those that are zero in both together in one row."""
    rows = []
    for i, j in np.ndindex(*computed.shape):
        deviation = abs(float(printed[i][j]) - computed[i, j])
        if float(printed[i][j]) or computed[i, j]:
            remark = MISPRINT if deviation > 0.01 else ""
            rows.append(
                Row(f"{name}({i + 1},{j + 1})", printed[i][j], float(computed[i, j]), remark)
            )
    zeros = computed.size - len(rows)
    return [*rows, Row(f"the other {zeros} of {name}", "0", 0.0)] if zeros else rows


def formulas() -> None:
    """Print the formulas that are wrong as printed, with their corrections."""
    table("The formulas", ("where", "printed", "correct", "reason"), FORMULAS)
    paragraph(f"Correct as printed: {CORRECT_FORMULAS}.")


def spectrum(H: TransferFunction) -> None:
    """Print the shaping filter of the gusts, and draw their spectrum."""
    variance = shaped_variance(H)
    rows = [
        Row("H(s), numerator: s¹", "13.1118", float(H.numerator[0])),
        Row("s⁰", "2.1691", float(H.numerator[1])),
        Row("denominator: s²", "1", float(H.denominator[0])),
        Row("s¹", "0.5731", float(H.denominator[1])),
        Row("s⁰", "0.0821", float(H.denominator[2])),
        Row("variance of the output of H", None, variance, "2σ², see below; σ = 10"),
    ]
    comparison("The shaping filter", rows)
    paragraph(
        "Aw, Bw, Cw and Dw are these coefficients in controller form; their printed values agree"
        " with H(s) digit by digit. Note the convention: for white noise of unit two-sided"
        f" intensity the output of this H has the variance 2σ² = {number(variance)}, not σ². The"
        " paper defines Φ for positive frequencies only, but Q = 1 for positive and negative"
        " ones. The example keeps the paper's convention."
    )
    omega = np.geomspace(0.01, 20, 300)
    numerator, denominator = (np.polyval(p, omega) for p in dryden())
    factor = np.polyval(H.numerator, 1j * omega) / np.polyval(H.denominator, 1j * omega)
    figure, axes = plt.subplots(figsize=(6.4, 3.4))
    as_printed = numerator / (1 + (L * omega) ** 2)
    axes.loglog(omega, as_printed, color=RED, ls="--", label="Φ as printed: constant at high ω")
    axes.loglog(omega, numerator / denominator, color=GREY, lw=5, alpha=0.6, label="Φ of Dryden")
    axes.loglog(omega, np.abs(factor) ** 2, color=BLUE, label="|H(jω)|² of the printed H(s)")
    axes.axvline(1 / L, color="black", lw=0.8, ls=":")
    axes.annotate("1/L", (1 / L, 2), (1.1 / L, 30))
    axes.set(
        xlabel="ω (rad/s)", ylabel="Φ (square of w's unit × s)", xlim=(0.01, 20), ylim=(0.5, 6000)
    )
    axes.legend(loc="lower left")
    picture(
        "steady_state_filter_spectrum",
        figure,
        "The printed H(s) is the factor of Dryden's spectrum, not of the printed spectrum.",
    )
    plt.close(figure)


def readings() -> None:
    """Print which of the printed inputs reproduce the printed outputs."""
    rows = []
    for name, reading in READINGS.items():
        plant, design = reading.design()
        closed = plant.A - design.gain @ plant.C
        computed = (
            plant.A[np.ix_(PAPERS_ORDER, PAPERS_ORDER)],
            design.gain[PAPERS_ORDER],
            closed[np.ix_(PAPERS_ORDER, PAPERS_ORDER)],
        )
        printed = (PRINTED_AUGMENTED, PRINTED_GAIN, PRINTED_CLOSED)
        deviations = [max_deviation(p, c) for p, c in zip(printed, computed, strict=True)]
        rows.append((name, *(number(deviation, 2) for deviation in deviations)))
    table(
        "Which inputs reproduce the outputs",
        ("reading", "largest deviation in A", "in L, without L(4,2)", "in F"),
        rows,
    )
    paragraph(
        "Three inputs are printed in two ways, or rounded. Only one reading reproduces all printed"
        " digits (deviations up to 5e-5 are rounding): A0(2,1) = 0.82 from the program, C(1,1) ="
        " 15.87 from the text, G0 = (0.00203, −0.00164) before rounding. The plant is not a ship"
        " but the well-known short-period mode of an F-16, rounded: x₁ is the angle of attack, x₂"
        " the pitch rate, y₁ the normal acceleration."
    )


def max_deviation(printed: tuple[tuple[str, ...], ...], computed: FloatArray) -> float:
    """Return the largest deviation, except that of the misprint in the gain."""
    deviations = np.abs(np.array(printed, dtype=float) - computed)
    return float(deviations[deviations < 1].max())


def accuracy(plant: ShapedSystem, design: Gain) -> None:
    """Compare the covariance of the filter with a simulation of filter and plant."""
    n, P = len(plant.A), design.covariance
    truth, estimate = simulated(plant, design)
    error = truth - estimate
    prior = solve_continuous_lyapunov(
        plant.A, -plant.G @ plant.G.T
    )  # of the state, without measurements
    gust = np.concatenate((np.zeros(n - 2), shaping().numerator))
    shown = {name: np.eye(n)[k] for name, k in zip(NAMES, PAPERS_ORDER, strict=False)}
    shown["gust w"] = gust
    rows = [
        (
            name,
            number(row @ prior @ row, 5),
            number(row @ P @ row, 8),
            number(float(np.var(error @ row)), 3),
            f"{100 * (1 - np.sqrt((row @ P @ row) / (row @ prior @ row))):.0f} %",
        )
        for name, row in shown.items()
    ]
    table(
        "How accurate the filter is",
        ("state", "variance", "variance of the error, P", "the same, simulated", "σ reduced by"),
        rows,
    )
    paragraph(
        f"P has rank {np.linalg.matrix_rank(P)} of {n}: the row and column of the actuator are"
        " zero, so P is not positive definite. The paper prints no P and has no simulation; ours"
        f" lasts {STEPS * DT:.0f} s in steps of {DT} s and is exact at the steps. The filter"
        " reduces the errors little, because with the printed R the sensors are noisy compared"
        " with the motion caused by the gusts."
    )
    shown_steps = slice(0, int(SHOWN_SECS / DT), 5)
    t = np.arange(STEPS)[shown_steps] * DT
    share = float(np.mean(np.abs(error @ gust) < 2 * np.sqrt(gust @ P @ gust)))
    first, second = np.eye(n)[:2]
    figure, panels = plt.subplots(3, 1, figsize=(6.8, 6), sharex=True)
    labels = ("x₁: angle of attack (rad)", "x₂: pitch rate (rad/s)", "w: gust (its unit)")
    for axes, row, label in zip(panels, (first, second, gust), labels, strict=True):
        estimated, sigma = (estimate @ row)[shown_steps], np.sqrt(row @ P @ row)
        band = {"color": BLUE, "alpha": 0.15, "lw": 0}
        axes.fill_between(
            t, estimated - 2 * sigma, estimated + 2 * sigma, label="estimate ± 2σ of P", **band
        )
        axes.plot(t, (truth @ row)[shown_steps], color=AMBER, lw=1.1, label="truth")
        axes.plot(t, estimated, color=BLUE, label="estimate")
        axes.set(ylabel=label, xlim=(0, SHOWN_SECS))
    panels[-1].set_xlabel("t (s)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    figure.align_ylabels()
    picture(
        "steady_state_filter_estimates",
        figure,
        f"{SHOWN_SECS:.0f} s of the simulation. The error of the gust is within two standard"
        f" deviations of the filter for {100 * share:.1f} % of the {STEPS * DT:.0f} s; 95.4 % are"
        " expected.",
    )
    plt.close(figure)


def simulated(plant: ShapedSystem, design: Gain) -> tuple[FloatArray, FloatArray]:
    """Simulate plant and filter with u = 0; return the states and their estimates, (STEPS, n)."""
    n, L = len(plant.A), design.gain
    A = np.block([[plant.A, np.zeros((n, n))], [L @ plant.C, plant.A - L @ plant.C]])
    R = np.diag([1 / 20, 1 / 60])
    noise = np.block([[plant.G @ plant.G.T, np.zeros((n, n))], [np.zeros((n, n)), L @ R @ L.T]])
    F, Qd = discretise(A, noise, DT)
    eigenvalues, axes = np.linalg.eigh(Qd)
    inputs = np.random.default_rng(4).standard_normal((STEPS, 2 * n))
    inputs = inputs @ (axes * np.sqrt(np.maximum(eigenvalues, 0)) @ axes.T)  # the symmetric root
    states = np.empty((STEPS, 2 * n))
    state = np.zeros(2 * n)
    for k in range(STEPS):
        state = F @ state + inputs[k]
        states[k] = state
    return states[:, :n], states[:, n:]


if __name__ == "__main__":
    main()

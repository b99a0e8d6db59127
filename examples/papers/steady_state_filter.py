"""Sakharov, Shergina, Chertkov: synthesis of an optimal estimator, printed against computed.

The plant of their example is an aeroplane's short period in Dryden's gusts. All the paper's numbers
come from six matrices, σ and L; its program is followed here step by step with shiplog's functions.

    python examples/papers/steady_state_filter.py > docs/papers_steady_state_filter.md
"""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from printed import AMBER, BLUE, GREY, RED, Row, grid, number, page, picture, say, table
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
PAPERS_ORDER = [0, 1, 3, 4, 2]  # the paper has the actuator's state last, we the shaping filter's
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
    """What the paper prints in more than one way, and the way to read it."""

    A21: float = 0.82
    C11: float = 15.87
    G0: tuple[float, float] = (0.00203, -0.00164)

    def design(self) -> tuple[ShapedSystem, Gain]:
        """The plant with its shaping filter, and the Kalman filter, in our order of states."""
        A = np.array([[-1.02, 0.91, -0.0022], [self.A21, -1.08, -0.1756], [0, 0, -ACTUATOR]])
        C = np.array([[self.C11, 1.4811, 0], [0, 1, 0]])
        B = np.array([[0], [0], [ACTUATOR]])
        plant = augment_with_shaping(A, B, C, [*self.G0, 0], shaping())
        return plant, kalman_gain(plant.A, plant.G, plant.C, 1, np.diag([1 / 20, 1 / 60]))


READINGS = {
    "as read here": Reading(),
    "A0(2,1) = 0.8220, of the formula": Reading(A21=0.822),
    "C(1,1) = 15.8788, of the program": Reading(C11=15.8788),
    "G0 = (0.0020, −0.0016), as printed": Reading(G0=(0.0020, -0.0016)),
}

FORMULAS = (
    ("(4), (5)", "E[w(t+τ) wᵀ(t)] = Q δ(t)", "Q δ(τ)", "τ is the lag"),
    ("(8)", "A x + B u + L (y − ŷ)", "A x̂ + B u + L (y − ŷ)", "x is not known; (9) has x̂"),
    ("(9)", "(A − LC) x̂ − L y", "(A − LC) x̂ + B u + L y", "(8) with (10); (20) has it right"),
    (
        "(11)",
        "P the only positive definite solution",
        "the only positive semidefinite one that stabilises",
        "nothing drives the actuator: rank 4, see below; the equation itself is right",
    ),
    ("(18)", "noise enters by [C·Dw; Bw]", "[G0·Dw; Bw]", "without effect here: Dw = 0"),
    ("after (19)", "measurement noise w(t)", "v(t)", "as in (2)"),
    (
        "Φ(ω)",
        "2Lσ² (1 + 3L²ω²) / (1 + L²ω²)",
        "2Lσ² (1 + 3L²ω²) / (1 + L²ω²)²",
        "Dryden; the printed H(s) is the factor of the squared one",
    ),
    (
        "sah175a.m",
        "`A=[A0 G0*Cw B0;0 0;0 0;0 0] [Aw;0 0] [0 0 -20.2]'`",
        "`A=[A0 G0*Cw B0; [0 0;0 0;0 0] [Aw;0 0] [0 0 -20.2]']`",
        "brackets lost; the printed line does not run",
    ),
)
RIGHT = "(1) to (3), (6), (7), (10), (12) to (17), (19), (20)"


def dryden() -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator of Φ, of descending powers of ω."""
    above = 2 * L * SIGMA**2 * np.array([3 * L**2, 0, 1])
    return above, np.array([L**4, 0, 2 * L**2, 0, 1])


def shaping() -> TransferFunction:
    """H(s), the factor of Φ."""
    return spectral_factor(*dryden())


def main() -> None:
    """Print the page and draw its pictures."""
    page("Steady-state filter: printed against computed")
    say(
        "V. V. Sakharov, O. V. Shergina, A. A. Chertkov, *Optimal estimator synthesis for ship"
        " dynamic object control*. This page is made by\n\n"
        "    python examples/papers/steady_state_filter.py > docs/papers_steady_state_filter.md"
    )
    say(
        "The paper has one worked example and no tables and no figures: what follows is every"
        " number and every formula of it. All numbers agree to the last printed digit but the two"
        " in bold, which the paper's other numbers prove to be misprints. The pictures are ours."
    )
    plant, found = READINGS["as read here"].design()
    order = np.ix_(PAPERS_ORDER, PAPERS_ORDER)
    A, gain = plant.A[order], found.gain[PAPERS_ORDER]
    closed = (plant.A - found.gain @ plant.C)[order]
    formulas()
    spectrum(shaping())
    table("The augmented system", matrix_rows("A", PRINTED_AUGMENTED, A))
    say(
        f"B = {vector(plant.B[PAPERS_ORDER, 0])} and G = {vector(plant.G[PAPERS_ORDER, 0])}, as"
        " printed (there as rows; they are columns)."
    )
    readings()
    table("Kalman's gain", matrix_rows("L", PRINTED_GAIN, gain))
    from_closed = -3.5992 * 1.4811 + 5.0851
    say(
        "L(4,2) is a misprint, for F = A − LC is printed too: F(4,2) = −L(4,1)·C(1,2) − L(4,2), so"
        f" L(4,2) = −3.5992·1.4811 + 5.0851 = {number(from_closed, 4)}."
    )
    table("The filter's matrix F = A − LC", matrix_rows("F", PRINTED_CLOSED, closed))
    table(
        "Its eigenvalues",
        [
            Row(f"λ{k}", printed, float(pole.real), MISPRINT if k == 5 else "")
            for k, (printed, pole) in enumerate(zip(PRINTED_POLES, found.poles, strict=True), 1)
        ],
    )
    trace = sum(float(PRINTED_CLOSED[k][k]) for k in range(5))
    of_poles = sum(map(float, PRINTED_POLES))
    say(
        f"The printed F has the trace {number(trace)}, the printed eigenvalues the sum"
        f" {number(of_poles)}: one is wrong by {number(of_poles - trace, 3)}. With −0.1661 the"
        " sums agree. The error's slowest mode so has a time constant of"
        f" {-1 / found.poles[-1].real:.1f} s, not 0.9 s."
    )
    accuracy(plant, found)


def vector(of: FloatArray) -> str:
    """A column in one line."""
    return f"[{' '.join(number(value) for value in of)}]ᵀ"


def matrix_rows(name: str, printed: tuple[tuple[str, ...], ...], computed: FloatArray) -> list[Row]:
    """A row for each entry of a matrix that is not zero on both sides."""
    rows = []
    for i, j in np.ndindex(*computed.shape):
        off = abs(float(printed[i][j]) - computed[i, j])
        if float(printed[i][j]) or computed[i, j]:
            remark = MISPRINT if off > 0.01 else ""
            rows.append(
                Row(f"{name}({i + 1},{j + 1})", printed[i][j], float(computed[i, j]), remark)
            )
    zeros = computed.size - len(rows)
    return [*rows, Row(f"the other {zeros} of {name}", "0", 0.0)] if zeros else rows


def formulas() -> None:
    """The paper's formulas that are not right as printed."""
    grid("The formulas", ("where", "printed", "right", "why"), FORMULAS)
    say(f"Right as printed: {RIGHT}.")


def spectrum(H: TransferFunction) -> None:
    """The gusts' spectrum and its factor."""
    variance = shaped_variance(H)
    rows = [
        Row("H(s), numerator: s¹", "13.1118", float(H.numerator[0])),
        Row("s⁰", "2.1691", float(H.numerator[1])),
        Row("denominator: s²", "1", float(H.denominator[0])),
        Row("s¹", "0.5731", float(H.denominator[1])),
        Row("s⁰", "0.0821", float(H.denominator[2])),
        Row("variance behind H", None, variance, "2σ², see below; σ = 10"),
    ]
    table("The shaping filter", rows)
    say(
        "Aw, Bw, Cw and Dw are these coefficients in controller form; what is printed of them"
        " agrees with H(s) digit by digit. A convention to be warned of: the variance of white"
        f" noise of unit two-sided intensity behind this H is 2σ² = {number(variance)}, not σ²: the"
        " paper's Φ is meant for positive frequencies, and its Q = 1 for both. The example keeps"
        " the paper's."
    )
    omega = np.geomspace(0.01, 20, 300)
    above, below = (np.polyval(p, omega) for p in dryden())
    factor = np.polyval(H.numerator, 1j * omega) / np.polyval(H.denominator, 1j * omega)
    drawn, axes = plt.subplots(figsize=(6.4, 3.4))
    as_printed = above / (1 + (L * omega) ** 2)
    axes.loglog(omega, as_printed, color=RED, ls="--", label="Φ as printed: never falls")
    axes.loglog(omega, above / below, color=GREY, lw=5, alpha=0.6, label="Φ of Dryden")
    axes.loglog(omega, np.abs(factor) ** 2, color=BLUE, label="|H(jω)|² of the printed H(s)")
    axes.axvline(1 / L, color="black", lw=0.8, ls=":")
    axes.annotate("1/L", (1 / L, 2), (1.1 / L, 30))
    axes.set(
        xlabel="ω (rad/s)", ylabel="Φ (square of w's unit × s)", xlim=(0.01, 20), ylim=(0.5, 6000)
    )
    axes.legend(loc="lower left")
    picture(
        "steady_state_filter_spectrum",
        drawn,
        "The printed H(s) is the factor of Dryden's spectrum, not of the printed one.",
    )
    plt.close(drawn)


def readings() -> None:
    """Which of the paper's inputs its outputs were computed of."""
    rows = []
    for name, reading in READINGS.items():
        plant, found = reading.design()
        closed = plant.A - found.gain @ plant.C
        computed = (
            plant.A[np.ix_(PAPERS_ORDER, PAPERS_ORDER)],
            found.gain[PAPERS_ORDER],
            closed[np.ix_(PAPERS_ORDER, PAPERS_ORDER)],
        )
        printed = (PRINTED_AUGMENTED, PRINTED_GAIN, PRINTED_CLOSED)
        off = [worst(p, c) for p, c in zip(printed, computed, strict=True)]
        rows.append((name, *(number(one, 2) for one in off)))
    grid(
        "Which inputs the outputs belong to",
        ("reading", "largest deviation in A", "in L, but for L(4,2)", "in F"),
        rows,
    )
    say(
        "Three inputs are printed in two ways, or rounded. Only one reading gives every printed"
        " digit (deviations up to 5e-5 are rounding): A0(2,1) = 0.82 of the program, C(1,1) = 15.87"
        " of the text, G0 = (0.00203, −0.00164) before rounding. The plant is the classic short"
        " period of an F-16, rounded, and not a ship: x₁ is the angle of attack, x₂ the pitch rate,"
        " y₁ the normal acceleration."
    )


def worst(printed: tuple[tuple[str, ...], ...], computed: FloatArray) -> float:
    """The largest deviation, the misprint of the gain left out."""
    off = np.abs(np.array(printed, dtype=float) - computed)
    return float(off[off < 1].max())


def accuracy(plant: ShapedSystem, found: Gain) -> None:
    """What the covariance promises, and what a simulation of filter and plant finds."""
    n, P = len(plant.A), found.covariance
    truth, estimate = simulated(plant, found)
    error = truth - estimate
    before = solve_continuous_lyapunov(plant.A, -plant.G @ plant.G.T)  # of the state, unobserved
    gust = np.concatenate((np.zeros(n - 2), shaping().numerator))
    shown = {name: np.eye(n)[k] for name, k in zip(NAMES, PAPERS_ORDER, strict=False)}
    shown["gust w"] = gust
    rows = [
        (
            name,
            number(row @ before @ row, 5),
            number(row @ P @ row, 8),
            number(float(np.var(error @ row)), 3),
            f"{100 * (1 - np.sqrt((row @ P @ row) / (row @ before @ row))):.0f} %",
        )
        for name, row in shown.items()
    ]
    grid(
        "How accurate the filter is",
        ("state", "its variance", "P: the error's", "the error's, simulated", "σ lowered by"),
        rows,
    )
    say(
        f"P has the rank {np.linalg.matrix_rank(P)} of {n}: the actuator's row and column are"
        f" zero, so P is not positive definite. The paper gives no P and runs no simulation; this"
        f" one is of {STEPS * DT:.0f} s in steps of {DT} s, exact in between. The filter"
        " earns little, for with R as printed the sensors are noisy against what the gusts do to"
        " the plant."
    )
    shown_steps = slice(0, int(SHOWN_SECS / DT), 5)
    t = np.arange(STEPS)[shown_steps] * DT
    share = float(np.mean(np.abs(error @ gust) < 2 * np.sqrt(gust @ P @ gust)))
    first, second = np.eye(n)[:2]
    drawn, panels = plt.subplots(3, 1, figsize=(6.8, 6), sharex=True)
    labels = ("x₁: angle of attack (rad)", "x₂: pitch rate (rad/s)", "w: gust (its unit)")
    for axes, row, label in zip(panels, (first, second, gust), labels, strict=True):
        said, sigma = (estimate @ row)[shown_steps], np.sqrt(row @ P @ row)
        band = {"color": BLUE, "alpha": 0.15, "lw": 0}
        axes.fill_between(t, said - 2 * sigma, said + 2 * sigma, label="estimate ± 2σ of P", **band)
        axes.plot(t, (truth @ row)[shown_steps], color=AMBER, lw=1.1, label="truth")
        axes.plot(t, said, color=BLUE, label="estimate")
        axes.set(ylabel=label, xlim=(0, SHOWN_SECS))
    panels[-1].set_xlabel("t (s)")
    drawn.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    drawn.align_ylabels()
    picture(
        "steady_state_filter_estimates",
        drawn,
        f"{SHOWN_SECS:.0f} s of the simulation. Of its {STEPS * DT:.0f} s the gust is"
        f" {100 * share:.1f} % within two of the filter's own standard deviations; 95.4 % is what"
        " they promise.",
    )
    plt.close(drawn)


def simulated(plant: ShapedSystem, found: Gain) -> tuple[FloatArray, FloatArray]:
    """The state and its estimate, (STEPS, n) each, from the filter's settled errors on; u = 0."""
    n, L = len(plant.A), found.gain
    together = np.block([[plant.A, np.zeros((n, n))], [L @ plant.C, plant.A - L @ plant.C]])
    R = np.diag([1 / 20, 1 / 60])
    noise = np.block([[plant.G @ plant.G.T, np.zeros((n, n))], [np.zeros((n, n)), L @ R @ L.T]])
    F, Qd = discretise(together, noise, DT)
    sizes, axes = np.linalg.eigh(Qd)
    kicks = np.random.default_rng(4).standard_normal((STEPS, 2 * n))
    kicks = kicks @ (axes * np.sqrt(np.maximum(sizes, 0)) @ axes.T)  # the symmetric root
    states = np.empty((STEPS, 2 * n))
    state = np.zeros(2 * n)
    for k in range(STEPS):
        state = F @ state + kicks[k]
        states[k] = state
    return states[:, :n], states[:, n:]


if __name__ == "__main__":
    main()

"""Comparison of Antonov's paper on quality optimal filters with values computed by shiplog.

The paper prints formulas and claims, but no example. The formulas are checked with the yaw of a
ship and with textbook plants; each claim is checked by computing it.

    python examples/papers/quality_filter.py > docs/papers_quality_filter.md
"""

import matplotlib.pyplot as plt
import numpy as np
from markdown_page import AMBER, BLUE, GREY, RED, number, paragraph, picture, start_page, table
from scipy.linalg import solve_sylvester

from analysis.design.cascade import Cascade, cascade
from analysis.design.quality import (
    Regulator,
    cycle_regulator,
    decay_projectors,
    quality_filter,
    quality_regulator,
)
from analysis.design.riccati import Gain, error_covariance, kalman_gain
from shiplog.errors import UsageError
from shiplog.types import FloatArray

# Nomoto's model of second order with measured yaw rate ω; the states are ω and ω'
T1, T2 = 150.0, 50.0
SHIP = np.array([[0, 1], [-1 / (T1 * T2), -(T1 + T2) / (T1 * T2)]])
RATE, R1, R2 = np.array([[1.0, 0]]), np.diag([0, 1e-12]), np.array([[2.5e-9]])
DOUBLE, PUSH = np.array([[0.0, 1], [0, 0]]), np.array([[0.0], [1]])  # the double integrator
TWO_DECAYS, BOTH = np.diag([-2, -0.2]), np.array([[1.0], [1]])
GROWING, WEIGHT, RATIO = np.array([[0.5]]), 0.25, 0.8  # x' = x/2 + u; ρ = R / (R + B'GB)

SHIFTS = (0.0, 0.1, 0.2, 0.4, 0.8)
WEIGHTS = (0.0, 1e-11, 3e-11, 1e-10, 3e-10, 1e-9)
CYCLES = (1, 2, 3, 10, 30, 100)
SYSTEMS, CYCLED = 100, 20


def main() -> None:
    """Print the page and draw its pictures."""
    start_page("Quality filter: printed against computed")
    paragraph(
        "V. K. Antonov, *Quality optimal regulators and Kalman filters*. This page is made by\n\n"
        "    python examples/papers/quality_filter.py > docs/papers_quality_filter.md"
    )
    paragraph(
        "The paper has formulas and claims, but no number, table or figure to be reproduced. This"
        " page checks its twelve formulas, and each claim with an example of our own; the pictures"
        " are ours, too. The ship is Nomoto's model of second order, T₁ ="
        f" {T1:.0f} s, T₂ = {T2:.0f} s, with measured yaw rate ω; the states are ω and ω',"
        " R1 = diag(0, 1e-12), R2 = 2.5e-9."
    )
    formulas()
    claims()
    speed_and_damping()
    two_shifts()
    cycles()
    cascades()


def formulas() -> None:
    """Print the twelve formulas with their corrections, and the effect of the error in (6)."""
    rows = (
        ("(1), (2), (3), (5)", "", "as printed", ""),
        ("before (3)", "Q positive definite", "semidefinite", "Q = 0 for P = 0 and a fast plant"),
        (
            "V1, V2",
            "X\\*E1 Q X",
            "X\\*E1\\* Q X",
            "E1 and E2 project on motions of A; as printed if on those of A\\*",
        ),
        ("(4) J11\\*, (7) J11", "½(c1 E1 + c2 E2) + …", "½(c1 E1\\* + c2 E2\\*) + …", "as above"),
        ("(6)", "J21 + J11 P + P J12 = 0", "J21 + P J11 + J11\\* P − P J12 P = 0", "see below"),
        ("(7) J21", "R1 + …", "C R1 C' + …", "R1 is defined as that of ω, which enters by C"),
        ("(8), and (7) otherwise", "", "as printed", ""),
        ("(9), (12)", "A X̂ + B L X̂ + …", "A X̂ + B u + …", "u is the input of the plant"),
        ("(10), (11)", "", "as printed", "converge only for BᵀGB > 0, see below"),
    )
    table("The formulas", ("where", "printed", "correct", "reason"), rows)
    as_printed = solve_sylvester(SHIP.T, RATE.T @ RATE / R2, -R1)  # (6) with c = 0, G = 0
    K = np.round(as_printed @ RATE.T / R2, 12) + 0.0
    result = quality_filter(SHIP, RATE, R1, R2)
    equal = np.allclose(result.gain, kalman(R2).gain)
    paragraph(
        "(6) is the dual of (3), but its quadratic term is missing; without it the equation is"
        " linear in P. Solved as printed for the ship, P is not symmetric and K ="
        f" {vector(K)}: the filter ignores its sensor. With the term K is {vector(result.gain)},"
        f" the gain of the Kalman filter ({'equal' if equal else 'not equal'} to that of"
        " `kalman_gain`); the relative residual of the equation is"
        f" {'below' if result.residual < 1e-12 else 'above'} 1e-12."
    )


def kalman(noise: FloatArray) -> Gain:
    """Design the Kalman filter of the ship for a given measurement noise R2."""
    return kalman_gain(SHIP, np.eye(2), RATE, R1, noise)


def vector(values: FloatArray) -> str:
    """Format a column vector in one line."""
    return f"[{', '.join(number(float(value)) for value in values.ravel())}]ᵀ"


def claims() -> None:
    """Print which claims hold, tested with random systems where that is possible."""
    bounded = dual = same = 0
    for seed in range(SYSTEMS):
        rng = np.random.default_rng(seed)
        n, m = rng.integers(1, [6, 4])
        A, B = rng.standard_normal((n, n)), rng.standard_normal((n, m))
        half, rates, c = *rng.standard_normal((2, n, n)), rng.uniform(0, 3)
        P, R, G = half @ half.T, np.eye(m), 0.3 * rates @ rates.T
        result = quality_regulator(A, B, P, R, G=G, shift=c)
        bounded += bool(result.poles.real.max() < -c / 2)
        K = quality_filter(A.T, B.T, P, R, G=G, shift=c).gain
        dual += np.allclose(K, -result.gain.T, rtol=1e-7, atol=1e-9)
        plain = quality_regulator(A + c / 2 * np.eye(n), B, P, R).gain
        same += np.allclose(plain, quality_regulator(A, B, P, R, shift=c).gain, rtol=1e-7)
    of = f"of {SYSTEMS}"
    rows = (
        ("c1 = c2 = c bounds the speed: Re λ < −c/2", "yes", f"{bounded} {of} systems, G > 0"),
        ("filter and regulator are dual: K(A, S) = −Lᵀ(Aᵀ, Sᵀ)", "yes", f"{dual} {of} systems"),
        (
            "(not in the paper) a single c is LQR on A + (c/2) I",
            "yes",
            f"{same} {of} systems, G = 0",
        ),
        ("c1 and c2 limit the fast and the slow motions", "**no**", "can destabilise, see below"),
        ("G limits the oscillation", "partly", "up to a limit; beyond it a mode becomes slow"),
        (
            "cycles converge geometrically",
            "with BᵀGB > 0 only",
            f"{converging()} of {CYCLED} systems of one to three inputs; with G = 0 they do not",
        ),
        (
            "a cascade sharpens estimates without bound",
            "**no**",
            "one stage improves a first stage that is too fast",
        ),
        (
            "robust against wrong noise statistics",
            "partly",
            "for a first stage too fast, not too slow",
        ),
    )
    table("The claims", ("claim", "holds", "evidence"), rows)
    paragraph(
        "Not computed, because the paper gives no formula: adaptive algorithms by choice of c and"
        " G, designs in the frequency domain by Rayleigh's formulas, identification of the noise"
        " from the cascade, and the role of cycles in learning, thought, lasers and distillation."
    )


def decay(K: FloatArray, state: int = 0) -> tuple[FloatArray, FloatArray, float]:
    """Compute how an initial error of 1 in one state of the ship decays.

    Parameters
    ----------
    K
        The gain of the filter, (2, 1).
    state
        The index of the state.

    Returns
    -------
    tuple
        The times (n,), s; the error of the state (n,); the time, s, after which it stays within
        5 %.
    """
    poles, modes = np.linalg.eig(SHIP - K @ RATE)
    times = np.arange(0, 120, 0.01)
    parts = modes[state] * np.linalg.solve(modes, np.eye(2)[state])
    error = np.real(np.exp(np.outer(times, poles)) @ parts)
    return times, error, float(times[np.abs(error) > 0.05][-1])


def relative_std(K: FloatArray) -> float:
    """Compute the standard deviation of the yaw rate's error, relative to the Kalman filter's."""
    variance = error_covariance(SHIP, K, RATE, R1, R2)[0, 0]
    return float(np.sqrt(variance / kalman(R2).covariance[0, 0]))


def design_row(name: str, value: float, design: Gain) -> tuple[str, ...]:
    """Format the row of a design parameter."""
    slowest = design.poles[-1]
    damping = min(-pole.real / abs(pole) for pole in design.poles)
    return (
        f"{name} = {value:g}",
        vector(design.gain),
        f"{number(slowest.real, 4)}" + (f" ± {abs(slowest.imag):.4g}i" if slowest.imag else ""),
        f"{damping:.2f}",
        f"{decay(design.gain)[2]:.1f}",
        f"{decay(design.gain, 1)[2]:.1f}",
        f"{relative_std(design.gain):.2f}",
    )


def speed_and_damping() -> None:
    """Print and draw the effect of the two design parameters of the paper on the ship."""
    speeds = {c: quality_filter(SHIP, RATE, R1, R2, shift=c) for c in SHIFTS}
    damped = {g: quality_filter(SHIP, RATE, R1, R2, G=np.diag([0, g])) for g in WEIGHTS}
    head = (
        "parameter",
        "K",
        "slowest pole (1/s)",
        "least damping",
        "ω settles (s)",
        "ω' settles (s)",
        "σ of ω",
    )
    rows = [
        *(design_row("c", c, design) for c, design in speeds.items()),
        *(design_row("G on ω'", g, design) for g, design in damped.items() if g),
    ]
    table("The design parameters of speed and damping", head, rows)
    paragraph(
        "An initial error of 1 has settled when it stays within 5 %; σ is the standard deviation of"
        " the error of ω, relative to the Kalman filter. The bound −c/2 holds and is conservative;"
        " a faster filter is noisier. A small G raises the damping to one for 3 % more noise. A"
        " larger G makes ω fast and ω' very slow: the pair of poles becomes real, and one of them"
        " approaches zero."
    )
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.5), sharey=True)
    for c, design in speeds.items():
        times, error, _ = decay(design.gain)
        left.plot(times, error, label=f"c = {c:g}, σ × {relative_std(design.gain):.2f}")
    for g in (0.0, 3e-11, 1e-10, 1e-9):
        times, error, _ = decay(damped[g].gain)
        right.plot(times, error, label=f"G = {number(g)}, σ × {relative_std(damped[g].gain):.2f}")
    for axes, title in ((left, "speed: c (1/s)"), (right, "damping: G on ω'")):
        axes.axhspan(-0.05, 0.05, color=GREY, alpha=0.25, lw=0)
        axes.set(xlabel="t (s)", title=title, xlim=(0, 45))
        axes.legend()
    left.set_ylabel("error of ω, initially 1 (–)")
    picture(
        "quality_filter_knobs",
        figure,
        "Decay of an initial error of the ship's filter, and the noise of the estimate; grey: 5 %.",
    )
    plt.close(figure)


def two_shifts() -> None:
    """Show that two different shifts can make a stable plant unstable."""
    E1, E2 = decay_projectors(TWO_DECAYS, 1.0)

    def poles_and_gain(c1: float, c2: float) -> tuple[FloatArray, FloatArray]:
        shifted = TWO_DECAYS + (c1 * E1 + c2 * E2) / 2
        gain = quality_regulator(shifted, BOTH, np.zeros((2, 2)), 1).gain
        return np.sort(np.linalg.eigvals(TWO_DECAYS + BOTH @ gain).real), gain

    poles, gain = poles_and_gain(6, 1)
    try:
        quality_regulator(TWO_DECAYS, BOTH, np.zeros((2, 2)), 1, shift=(6, 1), projectors=(E1, E2))
        response = "accepts these shifts"
    except UsageError as error:
        response = f"rejects these shifts: “{error}”"
    paragraph("## Two shifts")
    paragraph(
        "x' = diag(−2, −0.2) x + (1, 1)ᵀ u, P = 0, R = 1: c1 = 6 for the fast motion and c2 = 1"
        f" for the slow one give L = [{', '.join(number(g, 8) for g in gain[0])}] and a pole at"
        f" **+{poles[-1]:.7f}**. A stable plant becomes unstable, although the paper claims a bound"
        f" of −c2/2 = −0.5. `quality_regulator` {response}."
    )
    # no gain exists at 4 (fast mode shifted onto the axis) and at 4.6 (onto the slow mode)
    pieces = (np.linspace(1, 3.98, 30), np.linspace(4.02, 4.58, 30), np.linspace(4.64, 8, 170))
    figure, axes = plt.subplots(figsize=(6.4, 3.2))
    for speeds in pieces:
        slowest = [poles_and_gain(c1, 1)[0][-1] for c1 in speeds]
        label = "slowest pole, c2 = 1" if speeds is pieces[0] else "_"
        axes.plot(speeds, slowest, color=RED, label=label)
    axes.axhline(-0.5, color=GREY, ls="--", lw=1.2, label="claimed bound: −c2/2")
    axes.axhline(0, color="black", lw=0.8)
    axes.axvline(4.6, color="black", lw=0.8, ls=":")
    axes.plot([6], [poles[-1]], "o", color=RED)
    axes.annotate(f"+{poles[-1]:.4f}", (6, poles[-1]), (5.9, 0.45))
    axes.annotate("both modes shifted\nto one pole: no gain", (4.6, 2), (2.75, 2.1))
    axes.annotate("unstable", (7.2, 0), (7.2, 0.9), color=RED)
    axes.set(xlabel="c1, for the fast motion (1/s)", ylabel="slowest closed-loop pole (1/s)")
    axes.set(xlim=(1, 8), ylim=(-2.2, 3))
    axes.legend(loc="upper right")
    picture(
        "quality_filter_two_shifts",
        figure,
        "Two different shifts do not bound the poles; a single shift does.",
    )
    plt.close(figure)


def cycles() -> None:
    """Print and draw the gains of the cyclic operator, with and without weight on the rates."""
    plain = cycle_regulator(DOUBLE, PUSH, np.eye(2), 1, CYCLES[-1])
    weighted = cycle_regulator(GROWING, [[1]], 1, 1, CYCLES[-1], G=WEIGHT)
    rows = []
    for j in CYCLES:
        once = quality_regulator(DOUBLE, PUSH, j * np.eye(2), 1)
        reduced_R = RATIO**j * WEIGHT / (1 - RATIO**j)
        equivalent = quality_regulator(GROWING, [[1]], 1, reduced_R, G=WEIGHT)
        rows.append(
            (
                str(j),
                format_gains(plain[j - 1]),
                format_gains(once),
                format_gains(weighted[j - 1]),
                format_gains(equivalent),
                number(weighted[j - 1].poles[0].real, 11),
            )
        )
    head = (
        "cycles j",
        "L, G = 0",
        "one design, j P",
        "L, G = 0.25",
        "one design, R = ρʲ BᵀGB/(1 − ρʲ)",
        "its pole",
    )
    table("The cyclic operator", head, rows)
    paragraph(
        "Left: a double integrator, P = I, R = 1, G = 0. Right: x' = 0.5 x + u, P = R = 1, G ="
        " 0.25. The paper claims that the increments decrease as a geometric progression. With G"
        " = 0 they decrease as 1/√j and their sum is unbounded, as is the gain of a single design"
        " with increasing weight: L = −[√j, √(j + 2√j)]. Where BᵀGB > 0 the claim is"
        " correct for any number of inputs: the ratio of the increments tends to ρ, the largest"
        " eigenvalue of (R + BᵀGB)⁻¹R. Here ρ = 0.8, and the pole tends to −2. That j cycles equal"
        " one design holds for one input only."
    )
    count = np.arange(2, CYCLES[-1] + 1)
    figure, axes = plt.subplots(figsize=(6.4, 3.4))
    axes.semilogy(count, increments(plain), color=RED, label="G = 0, double integrator")
    axes.semilogy(count, 0.5 / np.sqrt(count), color="black", ls=":", label="½/√j")
    axes.semilogy(count, increments(weighted), color=BLUE, label="G = 0.25, scalar")
    start = increments(weighted)[-40] / RATIO ** count[-40]
    axes.semilogy(
        count, start * RATIO**count, color=AMBER, ls="--", label="0.8ʲ, geometric as claimed"
    )
    axes.set(xlabel="cycle j", ylabel="increment of |L₁|", xlim=(0, 100), ylim=(1e-10, 2))
    axes.legend(loc="lower left")
    picture(
        "quality_filter_cycles",
        figure,
        "Increment of the gain by each cycle: geometric only where BᵀGB > 0.",
    )
    plt.close(figure)


def converging() -> int:
    """Count the random systems whose increments decrease by the predicted ratio in the end."""
    count = 0
    for seed in range(CYCLED):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 6))
        m = int(rng.integers(1, min(n, 3) + 1))
        A, B, half = (rng.standard_normal(size) for size in ((n, n), (n, m), (n, n)))
        R = np.eye(m)
        ratio = np.linalg.eigvals(np.linalg.solve(R + B.T @ B, R)).real.max()
        needed = int(3 + np.log(1e-5) / np.log(ratio))
        designs = cycle_regulator(A, B, half @ half.T, R, needed, G=np.eye(n))
        sizes = np.linalg.norm(np.diff([design.gain for design in designs], axis=0), axis=(1, 2))
        count += bool(abs(sizes[-1] / sizes[-2] / ratio - 1) < 1e-3)
    return count


def format_gains(regulator: Regulator) -> str:
    """Format the first row of a gain."""
    return ", ".join(number(value) for value in regulator.gain[0])


def increments(designs: tuple[Regulator, ...]) -> FloatArray:
    """Compute by how much each cycle after the first increases the first gain."""
    return np.abs(np.diff([design.gain[0, 0] for design in designs]))


def cascades() -> None:
    """Print and draw the errors of filters in cascade, for a good and two poor first stages."""
    firsts = {"optimal": 1.0, "too fast: R2 × 1e−4": 1e-4, "too slow: R2 × 1e4": 1e4}
    results: dict[str, Cascade] = {
        name: cascade(SHIP, RATE, R1, R2, kalman(factor * R2).gain, stages=5, correlation_secs=10)
        for name, factor in firsts.items()
    }
    rows = [
        (name, *(f"{value:.2f}" for value in result.relative[:, 0]), str(result.best))
        for name, result in results.items()
    ]
    table("The cascade", ("first stage", *(f"stage {k}" for k in range(1, 6)), "best"), rows)
    paragraph(
        "Standard deviation of the yaw rate's error after each stage, relative to the optimal"
        " filter. Each later stage treats the previous estimate as a measurement with white noise"
        " that is constant over 10 s. The paper claims unlimited accuracy. No stage improves an"
        " optimal filter, which has used all information of the measurements already. One stage"
        " improves a filter that is much too fast; no stage improves one that is too slow; all"
        " further stages increase the error."
    )
    figure, axes = plt.subplots(figsize=(6.4, 3.4))
    marks = zip(results.items(), "os^", (BLUE, AMBER, RED), strict=True)
    for (name, result), mark, color in marks:
        axes.semilogy(range(1, 6), result.relative[:, 0], marker=mark, color=color, label=name)
    axes.axhline(1, color=GREY, ls="--", lw=1.2, label="optimal filter")
    axes.set(xlabel="stage", ylabel="σ of ω's error / optimal (–)", xticks=range(1, 6))
    axes.set_yticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
    axes.set_ylim(0.8, 25)
    axes.minorticks_off()
    axes.legend(title="first stage", ncols=2, loc="center", bbox_to_anchor=(0.6, 0.62))
    picture(
        "quality_filter_cascade",
        figure,
        "One stage improves a first filter that is too fast; otherwise stages increase the error.",
    )
    plt.close(figure)


if __name__ == "__main__":
    main()

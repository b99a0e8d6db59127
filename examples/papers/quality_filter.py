"""Antonov: quality optimal regulators and Kalman filters, printed against computed.

The paper prints formulas and claims, no example. The formulas are checked on the yaw of a ship and
on textbook plants, the claims by computing what they say.

    python examples/papers/quality_filter.py > docs/papers_quality_filter.md
"""

import matplotlib.pyplot as plt
import numpy as np
from printed import AMBER, BLUE, GREY, RED, grid, number, page, picture, say
from scipy.linalg import solve_sylvester

from analysis.design.cascade import Cascade, cascade
from analysis.design.quality import (
    Regulator,
    cycle_regulator,
    fast_and_slow,
    quality_filter,
    quality_regulator,
)
from analysis.design.riccati import Gain, error_covariance, kalman_gain
from shiplog.errors import UsageError
from shiplog.types import FloatArray

# Second-order Nomoto, the yaw rate ω measured; the states are ω and ω'
T1, T2 = 150.0, 50.0
SHIP = np.array([[0, 1], [-1 / (T1 * T2), -(T1 + T2) / (T1 * T2)]])
RATE, R1, R2 = np.array([[1.0, 0]]), np.diag([0, 1e-12]), np.array([[2.5e-9]])
DOUBLE, PUSH = np.array([[0.0, 1], [0, 0]]), np.array([[0.0], [1]])  # the double integrator
TWO_DECAYS, BOTH = np.diag([-2, -0.2]), np.array([[1.0], [1]])
GROWING, WEIGHT, RATIO = np.array([[0.5]]), 0.25, 0.8  # x' = x/2 + u; ρ = R / (R + B'GB)

SHIFTS = (0.0, 0.1, 0.2, 0.4, 0.8)
WEIGHTS = (0.0, 1e-11, 3e-11, 1e-10, 3e-10, 1e-9)
CYCLES = (1, 2, 3, 10, 30, 100)
SYSTEMS = 100


def main() -> None:
    """Print the page and draw its pictures."""
    page("Quality filter: printed against computed")
    say(
        "V. K. Antonov, *Quality optimal regulators and Kalman filters*. This page is made by\n\n"
        "    python examples/papers/quality_filter.py > docs/papers_quality_filter.md"
    )
    say(
        "The paper has formulas and claims, and not one number, table or figure: there is nothing"
        " to reproduce digit by digit. So its twelve formulas are gone through here, and each claim"
        " is computed on a system of ours; the pictures are ours, too. The ship is Nomoto's"
        f" of second order, T₁ = {T1:.0f} s, T₂ = {T2:.0f} s, with its yaw rate ω measured; states"
        " ω and ω', R1 = diag(0, 1e-12), R2 = 2.5e-9."
    )
    formulas()
    claims()
    speed_and_damping()
    two_shifts()
    cycles()
    cascades()


def formulas() -> None:
    """The twelve formulas, and what is wrong with (6)."""
    rows = (
        ("(1), (2), (3), (5)", "", "as printed", ""),
        ("before (3)", "Q positive definite", "semidefinite", "Q = 0 for P = 0 and a fast plant"),
        ("V1, V2", "X\\*E1 Q X", "X\\*E1\\* Q X", "E1, E2 are not symmetric; one c needs none"),
        ("(4) J11\\*, (7) J11", "½(c1 E1 + c2 E2) + …", "½(c1 E1\\* + c2 E2\\*) + …", "the same"),
        ("(6)", "J21 + J11 P + P J12 = 0", "J21 + P J11 + J11\\* P − P J12 P = 0", "see below"),
        ("(7) J21", "R1 + …", "C R1 C' + …", "R1 is said to be of ω, which enters by C"),
        ("(7) but for these, (8)", "", "as printed", ""),
        ("(9), (12)", "A X̂ + B L X̂ + …", "A X̂ + B u + …", "u is what the plant is given"),
        ("(10), (11)", "", "as printed", "what is said of convergence is not, see below"),
    )
    grid("The formulas", ("where", "printed", "right", "why"), rows)
    as_printed = solve_sylvester(SHIP.T, RATE.T @ RATE / R2, -R1)  # (6) with c = 0, G = 0
    K = np.round(as_printed @ RATE.T / R2, 12) + 0.0
    found = quality_filter(SHIP, RATE, R1, R2)
    say(
        "(6) is the dual of (3) and has lost its quadratic term, without which it is linear in P."
        f" Solved as printed on the ship it gives a P that is not symmetric and K = {vector(K)}, a"
        f" filter deaf to its sensor; with the term K is {vector(found.gain)}, the Kalman filter"
        f" ({'equal' if np.allclose(found.gain, kalman(R2).gain) else 'not equal'} to that of"
        f" `kalman_gain`), and its equation holds to"
        f" {'better' if found.residual < 1e-12 else 'worse'} than 1e-12 of its terms."
    )


def kalman(noise: FloatArray) -> Gain:
    """The ship's Kalman filter, its measurements taken to be of that noise."""
    return kalman_gain(SHIP, np.eye(2), RATE, R1, noise)


def vector(of: FloatArray) -> str:
    """A column in one line."""
    return f"[{', '.join(number(float(value)) for value in of.ravel())}]ᵀ"


def claims() -> None:
    """What random systems say of the claims that can be true or false."""
    bounded = dual = same = 0
    for seed in range(SYSTEMS):
        rng = np.random.default_rng(seed)
        n, m = rng.integers(1, [6, 4])
        A, B = rng.standard_normal((n, n)), rng.standard_normal((n, m))
        half, rates, c = *rng.standard_normal((2, n, n)), rng.uniform(0, 3)
        P, R, G = half @ half.T, np.eye(m), 0.3 * rates @ rates.T
        found = quality_regulator(A, B, P, R, G=G, shift=c)
        bounded += bool(found.poles.real.max() < -c / 2)
        K = quality_filter(A.T, B.T, P, R, G=G, shift=c).gain
        dual += np.allclose(K, -found.gain.T, rtol=1e-7, atol=1e-9)
        plain = quality_regulator(A + c / 2 * np.eye(n), B, P, R).gain
        same += np.allclose(plain, quality_regulator(A, B, P, R, shift=c).gain, rtol=1e-7)
    of = f"of {SYSTEMS}"
    rows = (
        ("c1 = c2 = c bounds the speed: Re λ < −c/2", "yes", f"{bounded} {of} systems, G > 0"),
        ("filter and regulator are dual: K(A, S) = −Lᵀ(Aᵀ, Sᵀ)", "yes", f"{dual} {of} systems"),
        ("(not said) one c is LQR on A + (c/2) I", "yes", f"{same} {of} systems, G = 0"),
        ("c1 and c2 limit the fast and the slow motions", "**no**", "can destabilise, see below"),
        ("G limits the oscillation", "partly", "up to a point; beyond it a mode turns slow"),
        ("cycles converge geometrically", "with G > 0 only", "one input; with G = 0 not at all"),
        ("a cascade sharpens estimates without bound", "**no**", "repairs a first stage once"),
        ("robust against wrong noise statistics", "partly", "a first stage too fast, not too slow"),
    )
    grid("The claims", ("claim", "holds", "evidence"), rows)
    say(
        "Not computed, for nothing is said that could be: adaptive algorithms by choice of c and G,"
        " designs in the frequency domain by Rayleigh's formulas, identification of the noise from"
        " the cascade, and what cycles are to learning, thought, lasers and distillation."
    )


def settled(K: FloatArray, state: int = 0) -> tuple[FloatArray, FloatArray, float]:
    """Times, the error of a state from one in it at 0, and when it stays within 5 %."""
    poles, modes = np.linalg.eig(SHIP - K @ RATE)
    times = np.arange(0, 120, 0.01)
    parts = modes[state] * np.linalg.solve(modes, np.eye(2)[state])
    error = np.real(np.exp(np.outer(times, poles)) @ parts)
    return times, error, float(times[np.abs(error) > 0.05][-1])


def noisier(K: FloatArray) -> float:
    """σ of the yaw rate's error, the optimal filter's being one."""
    of_it = error_covariance(SHIP, K, RATE, R1, R2)[0, 0]
    return float(np.sqrt(of_it / kalman(R2).covariance[0, 0]))


def knob(name: str, value: float, found: Gain) -> tuple[str, ...]:
    """A row of the table of knobs."""
    slowest = found.poles[-1]
    damping = min(-pole.real / abs(pole) for pole in found.poles)
    return (
        f"{name} = {value:g}",
        vector(found.gain),
        f"{number(slowest.real, 4)}" + (f" ± {abs(slowest.imag):.4g}i" if slowest.imag else ""),
        f"{damping:.2f}",
        f"{settled(found.gain)[2]:.1f}",
        f"{settled(found.gain, 1)[2]:.1f}",
        f"{noisier(found.gain):.2f}",
    )


def speed_and_damping() -> None:
    """The two knobs of the paper, on the ship."""
    speeds = {c: quality_filter(SHIP, RATE, R1, R2, shift=c) for c in SHIFTS}
    damped = {g: quality_filter(SHIP, RATE, R1, R2, G=np.diag([0, g])) for g in WEIGHTS}
    head = (
        "knob",
        "K",
        "slowest pole (1/s)",
        "least damping",
        "ω settles (s)",
        "ω' settles (s)",
        "σ of ω",
    )
    rows = [
        *(knob("c", c, found) for c, found in speeds.items()),
        *(knob("G on ω'", g, found) for g, found in damped.items() if g),
    ]
    grid("The knobs of speed and of damping", head, rows)
    say(
        "An error of one has settled when it stays within 5 %; σ is that of ω's error, the Kalman"
        " filter's being 1. The bound −c/2 holds and is cautious, and speed is bought with noise. A"
        " little G brings the damping to one at 3 % more noise; more of it makes ω fast and ω' very"
        " slow, for the pair splits and one pole goes to zero."
    )
    drawn, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.5), sharey=True)
    for c, found in speeds.items():
        times, error, _ = settled(found.gain)
        left.plot(times, error, label=f"c = {c:g}, σ × {noisier(found.gain):.2f}")
    for g in (0.0, 3e-11, 1e-10, 1e-9):
        times, error, _ = settled(damped[g].gain)
        right.plot(times, error, label=f"G = {number(g)}, σ × {noisier(damped[g].gain):.2f}")
    for axes, title in ((left, "speed: c (1/s)"), (right, "damping: G on ω'")):
        axes.axhspan(-0.05, 0.05, color=GREY, alpha=0.25, lw=0)
        axes.set(xlabel="t (s)", title=title, xlim=(0, 45))
        axes.legend()
    left.set_ylabel("error of ω, its first being 1 (–)")
    picture(
        "quality_filter_knobs",
        drawn,
        "How an error of the ship's filter dies out, and what it costs; grey: 5 %.",
    )
    plt.close(drawn)


def two_shifts() -> None:
    """Two different shifts on two decays."""
    E1, E2 = fast_and_slow(TWO_DECAYS, 1.0)

    def poles_and_gain(c1: float, c2: float) -> tuple[FloatArray, FloatArray]:
        shifted = TWO_DECAYS + (c1 * E1 + c2 * E2) / 2
        gain = quality_regulator(shifted, BOTH, np.zeros((2, 2)), 1).gain
        return np.sort(np.linalg.eigvals(TWO_DECAYS + BOTH @ gain).real), gain

    poles, gain = poles_and_gain(6, 1)
    try:
        quality_regulator(TWO_DECAYS, BOTH, np.zeros((2, 2)), 1, shift=(6, 1), projectors=(E1, E2))
        said = "accepts it"
    except UsageError as refusal:
        said = f"refuses it: “{refusal}”"
    say("## Two shifts")
    say(
        "x' = diag(−2, −0.2) x + (1, 1)ᵀ u, P = 0, R = 1: c1 = 6 for the fast motion and c2 = 1"
        f" for the slow one give L = [{', '.join(number(g, 8) for g in gain[0])}] and a pole at"
        f" **+{poles[-1]:.7f}**. A stable plant is made unstable, where the paper claims a bound of"
        f" −c2/2 = −0.5. `quality_regulator` {said}."
    )
    # at 4 the fast motion is shifted onto the axis, at 4.6 onto the slow one: no gain exists there
    pieces = (np.linspace(1, 3.98, 30), np.linspace(4.02, 4.58, 30), np.linspace(4.64, 8, 170))
    drawn, axes = plt.subplots(figsize=(6.4, 3.2))
    for speeds in pieces:
        slowest = [poles_and_gain(c1, 1)[0][-1] for c1 in speeds]
        said = "slowest pole, c2 = 1" if speeds is pieces[0] else "_"
        axes.plot(speeds, slowest, color=RED, label=said)
    axes.axhline(-0.5, color=GREY, ls="--", lw=1.2, label="bound claimed: −c2/2")
    axes.axhline(0, color="black", lw=0.8)
    axes.axvline(4.6, color="black", lw=0.8, ls=":")
    axes.plot([6], [poles[-1]], "o", color=RED)
    axes.annotate(f"+{poles[-1]:.4f}", (6, poles[-1]), (5.9, 0.45))
    axes.annotate("both motions shifted\nto one place: no gain", (4.6, 2), (2.75, 2.1))
    axes.annotate("unstable", (7.2, 0), (7.2, 0.9), color=RED)
    axes.set(xlabel="c1, for the fast motion (1/s)", ylabel="slowest closed-loop pole (1/s)")
    axes.set(xlim=(1, 8), ylim=(-2.2, 3))
    axes.legend(loc="upper right")
    picture("quality_filter_two_shifts", drawn, "Two shifts bound nothing; one does.")
    plt.close(drawn)


def cycles() -> None:
    """The cyclic operator, with and without weight on the rates."""
    plain = cycle_regulator(DOUBLE, PUSH, np.eye(2), 1, CYCLES[-1])
    weighted = cycle_regulator(GROWING, [[1]], 1, 1, CYCLES[-1], G=WEIGHT)
    rows = []
    for j in CYCLES:
        once = quality_regulator(DOUBLE, PUSH, j * np.eye(2), 1)
        smaller = RATIO**j * WEIGHT / (1 - RATIO**j)
        small = quality_regulator(GROWING, [[1]], 1, smaller, G=WEIGHT)
        rows.append(
            (
                str(j),
                gains(plain[j - 1]),
                gains(once),
                gains(weighted[j - 1]),
                gains(small),
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
    grid("The cyclic operator", head, rows)
    say(
        "Left a double integrator, P = I, R = 1, G = 0; right x' = 0.5 x + u, P = R = 1, G = 0.25."
        " The printed claim is that the increments fall as a geometric progression. With G = 0"
        " they fall as 1/√j and their sum grows without end, as that of one design with ever more"
        " weight: L = −[√j, √(j + 2√j)]. With G > 0 and one input the claim is right, the ratio"
        " being ρ = R/(R + BᵀGB) = 0.8; here the pole goes to −2."
    )
    count = np.arange(2, CYCLES[-1] + 1)
    drawn, axes = plt.subplots(figsize=(6.4, 3.4))
    axes.semilogy(count, increments(plain), color=RED, label="G = 0, double integrator")
    axes.semilogy(count, 0.5 / np.sqrt(count), color="black", ls=":", label="½/√j")
    axes.semilogy(count, increments(weighted), color=BLUE, label="G = 0.25, scalar")
    start = increments(weighted)[-40] / RATIO ** count[-40]
    axes.semilogy(
        count, start * RATIO**count, color=AMBER, ls="--", label="0.8ʲ, geometric as claimed"
    )
    axes.set(xlabel="cycle j", ylabel="what it adds to |L₁|", xlim=(0, 100), ylim=(1e-10, 2))
    axes.legend(loc="lower left")
    picture("quality_filter_cycles", drawn, "What each cycle adds: geometric only where G > 0.")
    plt.close(drawn)


def gains(of: Regulator) -> str:
    """A row of gains."""
    return ", ".join(number(value) for value in of.gain[0])


def increments(done: tuple[Regulator, ...]) -> FloatArray:
    """What each cycle after the first adds to the first gain."""
    return np.abs(np.diff([step.gain[0, 0] for step in done]))


def cascades() -> None:
    """A filter behind a filter, from a good and from bad first stages."""
    firsts = {"optimal": 1.0, "too fast: R2 × 1e−4": 1e-4, "too slow: R2 × 1e4": 1e4}
    found: dict[str, Cascade] = {
        name: cascade(SHIP, RATE, R1, R2, kalman(factor * R2).gain, stages=5, correlation_secs=10)
        for name, factor in firsts.items()
    }
    rows = [
        (name, *(f"{value:.2f}" for value in one.relative[:, 0]), str(one.best))
        for name, one in found.items()
    ]
    grid("The cascade", ("first stage", *(f"stage {k}" for k in range(1, 6)), "best"), rows)
    say(
        "σ of the yaw rate's error after each stage, the optimal filter's being 1; later stages"
        " take the estimate before for a measurement of white noise that stays the same for 10 s."
        " The paper claims accuracy without bound. No stage adds to an optimal filter, for it has"
        " used all that the measurements hold; one repairs a filter that was tuned much too fast;"
        " a slow one is beyond repair; every further stage harms."
    )
    drawn, axes = plt.subplots(figsize=(6.4, 3.4))
    marks = zip(found.items(), "os^", (BLUE, AMBER, RED), strict=True)
    for (name, one), mark, color in marks:
        axes.semilogy(range(1, 6), one.relative[:, 0], marker=mark, color=color, label=name)
    axes.axhline(1, color=GREY, ls="--", lw=1.2, label="no filter is better")
    axes.set(xlabel="stage", ylabel="σ of ω's error / optimal (–)", xticks=range(1, 6))
    axes.set_yticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
    axes.set_ylim(0.8, 25)
    axes.minorticks_off()
    axes.legend(title="first stage", ncols=2, loc="center", bbox_to_anchor=(0.6, 0.62))
    picture(
        "quality_filter_cascade",
        drawn,
        "One stage repairs a first filter that is too fast. Else: more stages, more error.",
    )
    plt.close(drawn)


if __name__ == "__main__":
    main()

"""Comparison of the per-tick observer's paper with the values computed by shiplog.

The paper: Zubov, Mikrin, Oleinik, Ryabchenko, "Algorithms for the synthesis of linear observers for
nonlinear dynamic systems", 2014, no. 5, pages 3-16. Prints docs/papers_per_tick_observer.md and
draws its pictures.
"""

import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

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
from scipy.linalg import null_space
from scipy.signal import place_poles

from analysis.design.noise_placement import place_for_noise
from analysis.design.observability import ComplexArray
from analysis.design.per_tick import StateFunction, TickObserver, block_gains, tick_observer
from analysis.design.placement import format_mode, place_multilevel, polynomial_error
from analysis.design.riccati import error_covariance, kalman_gain
from shiplog.errors import UsageError
from shiplog.ships.paper import Coefficients, surge_acceleration, yaw_acceleration_rate
from shiplog.types import FloatArray
from shiplog.vessel.vessel_parser import load_vessel

Order = Literal["full", "reduced"]

I1, I2, I3 = 2000.0, 3000.0, 2500.0  # kg m²
FLIGHT = np.array([0.1, -0.2, 0.3, 0.05, -0.04, 0.06])  # roll, pitch, yaw in rad; rates in rad/s
ANGLES = np.eye(3, 6)
POLE = -0.5  # 1/s
SECS, PER_SEC = 40, 40
NO_INPUT = np.zeros(0)
TABLE1 = load_vessel("table1-rad")[0].coefficients
TABLE1_DEGREES = load_vessel("table1")[0].coefficients
SHIP = np.array([0.01, 1e-4, 7.0])  # yaw rate in rad/s, its derivative, speed in m/s
RATE_AND_SPEED = np.eye(3)[[0, 2]]
HARD_OVER = np.array([8.88e-3, 0.0, 4.43])  # a steady turn at 35° of rudder and 80 rpm
HARD_OVER_INPUTS = np.array([np.radians(35), 0.0, 80.0])
# intensities of the noise of the ship and of its sensors in the sample data, as its filters take it
LOG_NOISE = np.diag([1.04e-4, 0.113]) ** 2 * 0.1
SHIP_NOISE = np.diag([0.0, 6.25e-10, 2.5e-5]) @ np.diag([0.0, *np.diag(LOG_NOISE)])
SHIP_POLES = (  # of yaw and of surge; the second are those of the steady-state filter
    ((-0.1, -0.1), -0.05),
    ((-0.0133 - 0.0596j, -0.0133 + 0.0596j), -0.0063),
)
SYSTEMS = 30
NOISY_SYSTEMS = 20
RPM, RUDDER, PERIOD_SECS = 36.0, 0.35, 120.0  # a sinusoidal rudder, rad

INTRODUCTION = """\
N. E. Zubov, E. A. Mikrin, A. S. Oleinik, V. N. Ryabchenko, *Algorithms for the synthesis of linear
observers for nonlinear dynamic systems*, 2014, no. 5, pages 3-16. This page is made by

    python examples/papers/per_tick_observer.py > docs/papers_per_tick_observer.md

Our copy of the text ends with (2.12), in the middle of section 2, and contains no table, figure or
number. The analytical observers of a spacecraft and the simulation results that the abstract
announces are in the missing part. Their figures, and the inertias and angular rates of the authors,
are therefore unknown. This page computes what is possible: the formulas as printed; the example
reconstructed from the abstract (three angles measured, three angular rates estimated, observers of
full and reduced order) with numbers of our own; and the statements that can be tested."""


def spacecraft(x: FloatArray, _: FloatArray) -> FloatArray:
    """Return the rates of change of a free rigid body's Euler angles 3-2-1 and body rates.

    The state (6,) is roll, pitch, yaw (rad) and p, q, r (rad/s).
    """
    phi, theta, _yaw, p, q, r = x
    turn = q * np.sin(phi) + r * np.cos(phi)
    return np.array(
        [
            p + np.tan(theta) * turn,
            q * np.cos(phi) - r * np.sin(phi),
            turn / np.cos(theta),
            (I2 - I3) / I1 * q * r,
            (I3 - I1) / I2 * r * p,
            (I1 - I2) / I3 * p * q,
        ]
    )


def spacecraft_jacobian(x: FloatArray, _: FloatArray) -> FloatArray:
    """Return the Jacobian (6, 6) of `spacecraft`, A of (1.3)."""
    phi, theta, _yaw, p, q, r = x
    s, c, tan, sec = np.sin(phi), np.cos(phi), np.tan(theta), 1 / np.cos(theta)
    turn, across = q * s + r * c, q * c - r * s
    return np.array(
        [
            [tan * across, sec**2 * turn, 0, 1, tan * s, tan * c],
            [-turn, 0, 0, 0, c, -s],
            [across * sec, turn * sec * tan, 0, 0, s * sec, c * sec],
            [0, 0, 0, 0, (I2 - I3) / I1 * r, (I2 - I3) / I1 * q],
            [0, 0, 0, (I3 - I1) / I2 * r, 0, (I3 - I1) / I2 * p],
            [0, 0, 0, (I1 - I2) / I3 * q, (I1 - I2) / I3 * p, 0],
        ]
    )


def ship(x: FloatArray, u: FloatArray) -> FloatArray:
    """Return the rates of change of the ship of the identification paper.

    The state (3,) is yaw rate, its derivative and speed; the input (3,) is the rudder angle, its
    rate and the shaft speed.
    """
    (w, w_dot, v), (delta, delta_dot, n) = x, u
    w_ddot = yaw_acceleration_rate(TABLE1, w, w_dot, v, n, delta, delta_dot)
    return np.array([w_dot, w_ddot, surge_acceleration(TABLE1, w, v, n)])


def ship_jacobian(x: FloatArray, u: FloatArray, c: Coefficients = TABLE1) -> FloatArray:
    """Return the Jacobian (3, 3) of `ship`, A of (1.3), for any coefficients."""
    (w, _, v), (delta, delta_dot, n) = x, u
    rudder_gain = c.alpha1 - c.alpha2 * c.alpha3 * n * np.exp(-c.alpha3 * v)
    stiffness = c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w * w
    return np.array(
        [
            [0, 1, 0],
            [stiffness, c.a, rudder_gain * (c.d * delta + c.e * delta_dot)],
            [2 * c.f * w, 0, 2 * c.g * v],
        ]
    )


def printed_gain(A: FloatArray, B: FloatArray, Phi: list[FloatArray], sign: int) -> FloatArray:
    """Compute the gain L (n, m) by the recursion as printed.

    Parameters
    ----------
    A, B
        The matrices of the recursion, (n, n) and (n, m): the transposes of A and C.
    Phi
        The matrices that define the poles of each level. A last one of n_J < m, for which (2.5) has
        no place, is multiplied from the right of B⁺.
    sign
        1 for (2.5) and (2.6), -1 for (2.10).
    """
    plus = np.linalg.pinv(B)
    if len(Phi) == 1:
        last = Phi[0] @ plus if len(Phi[0]) == len(plus) else plus @ Phi[0]
        return sign * (plus @ A - last).T
    N = null_space(B.T).T
    below = printed_gain(N @ A @ N.T, N @ A @ B, Phi[1:], sign)
    minus = plus + sign * below.T @ N
    return sign * (minus @ A - Phi[0] @ minus).T


def format_poles(poles: ComplexArray) -> str:
    """Format poles for a table, each conjugate pair once."""
    upper = [pole for pole in np.sort_complex(poles)[::-1] if pole.imag >= 0]
    return ", ".join(format_mode(pole) for pole in upper).replace("-", "−").replace("j", " j")


def misprints() -> Iterator[Row]:
    """Apply the printed recursion to the ship: n = 3, m = 2, levels of 2 and 1."""
    A, C = ship_jacobian(SHIP, np.array([RUDDER, 0, RPM])), RATE_AND_SPEED
    Phi0, Phi1 = np.diag([-0.1, -0.2]), np.diag([-0.3])
    wanted = "−0.1, −0.2, −0.3"
    correct = printed_gain(A.T, C.T, [Phi0, Phi1], 1)
    yield Row(
        "(2.2) to (2.6): poles of A − L C",
        wanted,
        poles(A - correct @ C),
        "correct, with Φ_J of 1 × 1 to the right of B_J⁺",
    )
    negated = printed_gain(A.T, C.T, [Phi0, Phi1], -1)
    remark = "wrong sign, unstable: L is the negative of that of (2.5), (2.6)"
    yield Row("(2.10): poles of A − L C", wanted, poles(A - negated @ C), remark)
    yield Row(
        "(2.10): poles of A + L C",
        "–",
        poles(A + negated @ C),
        "(2.10) places the poles of this matrix",
    )
    untransposed = printed_gain(A, C.T, [Phi0, Phi1], 1)
    remark = "A_0 must be the transpose, as in (2.2); our copy is a scan and may lack its sign"
    yield Row("(2.7), A_0 = A_L: poles of A − L C", wanted, poles(A - untransposed @ C), remark)
    A = np.array([[0, 1, 0], [0, 0, 0], [0, 1.0, 0]])
    m_by_m = printed_gain(A.T, C.T, [Phi0, np.diag([-0.3, -0.6])], 1)
    remark = (
        "one state measured twice, Φ_J = diag(−0.3, −0.6): a mean of both. Φ_J must be n_J × n_J"
    )
    yield Row(
        "Φ_J of m × m: poles of A − L C", "−0.1, −0.2, −0.3 or −0.6", poles(A - m_by_m @ C), remark
    )
    J = spacecraft_jacobian(FLIGHT, NO_INPUT)
    B1 = np.abs(J[3:, :3]).max()
    remark = "spacecraft, A_L not transposed: there is no further level and no gain"
    yield Row("(2.7): largest entry of B_1", "not zero", f"{B1:g}", remark)
    chains = np.diag([1.0, 1, 0], 1)
    count = levels(chains.T, np.eye(4)[[0, 3]].T)
    remark = "n = 4, m = 2, ranks 2, 1, 1: valid for full ranks only, hence (2.11), (2.12)"
    yield Row("(2.8): J of a chain of three integrators and a single one", "1", count - 1, remark)


def poles(F: FloatArray) -> str:
    """Format the eigenvalues of F, 1/s."""
    return format_poles(np.linalg.eigvals(F).astype(complex))


def levels(A: FloatArray, B: FloatArray) -> int:
    """Count the levels of (2.9)."""
    N = null_space(B.T).T
    return 1 if not len(N) else 1 + levels(N @ A @ N.T, N @ A @ B)


def corrections() -> Iterator[Row]:
    """Evaluate ΔA* + ΔG*: how A(x̂N) x̂ + G(x̂N) depends on the point of linearisation."""
    x = FLIGHT
    end = true_flight()[PER_SEC]

    def dependence(now: FloatArray) -> float:
        h = 1e-5
        columns = [
            (linearised(x + h * e)(now, NO_INPUT) - linearised(x - h * e)(now, NO_INPUT)) / (2 * h)
            for e in np.eye(6)
        ]
        return float(np.abs(np.array(columns)).max())

    yield Row(
        "largest entry of ΔA* + ΔG* at the start of a tick",
        None,
        "0" if dependence(x) < 1e-9 else f"{dependence(x):.1g}",
        "hence A_L of (1.13) is the Jacobian at x̂, and the gain is computed from it",
    )
    yield Row(
        "the same at the end of a tick of 1 s",
        None,
        f"{dependence(end):.2g}",
        "1/s, compared with entries of A of up to"
        f" {np.abs(spacecraft_jacobian(x, NO_INPUT)).max():.2g}",
    )


def linearised(x: FloatArray) -> StateFunction:
    """Return the linearised model (1.2): A(x̂N) x + G(x̂N)."""
    f, A = spacecraft(x, NO_INPUT), spacecraft_jacobian(x, NO_INPUT)
    return lambda now, _: f + A @ (now - x)


def observer_of_the_spacecraft(order: Order) -> TickObserver:
    """Design the observer of the spacecraft, all poles at `POLE`."""
    count = 6 if order == "full" else 3
    return tick_observer(spacecraft, spacecraft_jacobian, ANGLES, [POLE] * count, order=order)


def true_flight() -> FloatArray:
    """Return the true states of the flight, (SECS · PER_SEC + 1, 6)."""
    return truth(spacecraft, FLIGHT, np.arange(SECS * PER_SEC + 1) / PER_SEC)


def truth(rate: StateFunction, x: FloatArray, times: FloatArray) -> FloatArray:
    """Integrate a motion from x; return its states at `times`, (len(times), n)."""
    states: FloatArray = solve_ivp(
        lambda t, x: rate(x, ship_inputs(t) if len(x) == 3 else NO_INPUT),
        (0.0, float(times[-1])),
        x,
        "DOP853",
        times,
        rtol=1e-13,
        atol=1e-15,
    ).y.T
    return states


def estimated(
    observer: TickObserver, flight: FloatArray, per_tick: int, *, printed: bool = False
) -> FloatArray:
    """Run an observer over the flight, its rates starting from zero.

    Parameters
    ----------
    observer
        The observer.
    flight
        The true states, `PER_SEC` a second, of which the angles are measured.
    per_tick
        The number of samples in a tick.
    printed
        Whether the estimate moves by the linearised model, (1.5) as printed, instead of the model.

    Returns
    -------
    FloatArray
        The estimates at the ends of the ticks, (count + 1, 6).
    """
    x = observer.init(np.r_[FLIGHT[:3], 0, 0, 0], flight[0, :3])
    estimates = [x]
    for k in range(0, len(flight) - 1, per_tick):
        now = replace(observer, rate=linearised(x)) if printed else observer
        x = now.step(x, flight[k : k + per_tick + 1, :3], tick_secs=per_tick / PER_SEC)
        estimates.append(x)
    return np.array(estimates)


def ship_inputs(t: float) -> FloatArray:
    """Return the inputs of the ship (3,): rudder angle, its rate, shaft speed."""
    turn = 2 * np.pi / PERIOD_SECS
    return np.array([RUDDER * np.sin(turn * t), RUDDER * turn * np.cos(turn * t), RPM])


def gains() -> Iterator[tuple[str, ...]]:
    """List the gains at the start of the flight."""
    reduced = observer_of_the_spacecraft("reduced").gain(FLIGHT)
    full = observer_of_the_spacecraft("full").gain(FLIGHT)
    names = ("roll", "pitch", "yaw", "p", "q", "r")
    for k, row in enumerate(full):
        yield f"L: {names[k]}", *(f"{value:.10f}".replace("-", "−") for value in row)
    for k, row in enumerate(reduced):
        yield f"N: {names[3 + k]}", *(f"{value:.10f}".replace("-", "−") for value in row)


def closed_form_difference() -> float:
    """Compute the largest difference between the gains by levels and those in closed form."""
    Phi = POLE * np.eye(3)
    N, L1, L2 = block_gains(spacecraft_jacobian(FLIGHT, NO_INPUT), Phi, Phi)
    full = observer_of_the_spacecraft("full").gain(FLIGHT) - np.vstack((L1, L2))
    return float(
        max(
            np.abs(full).max(), np.abs(observer_of_the_spacecraft("reduced").gain(FLIGHT) - N).max()
        )
    )


def flights() -> dict[str, tuple[int, FloatArray]]:
    """Run each observer; return by its name the samples per tick and the estimates."""
    flight = true_flight()
    full, reduced = observer_of_the_spacecraft("full"), observer_of_the_spacecraft("reduced")
    return {
        "truth": (1, flight),
        "reduced order, tick 1 s": (40, estimated(reduced, flight, 40)),
        "full order, tick 1 s": (40, estimated(full, flight, 40)),
        "full order, (1.5) as printed, tick 1 s": (40, estimated(full, flight, 40, printed=True)),
        "full order, (1.5) as printed, tick 0.1 s": (4, estimated(full, flight, 4, printed=True)),
    }


def rate_error(runs: dict[str, tuple[int, FloatArray]], name: str) -> FloatArray:
    """Return the largest error of the three angular rates at the end of each tick, rad/s."""
    per_tick, x = runs[name]
    largest: FloatArray = np.abs(x - runs["truth"][1][::per_tick])[:, 3:].max(axis=1)
    return largest


def flight_errors(runs: dict[str, tuple[int, FloatArray]]) -> Iterator[tuple[str, ...]]:
    """List the largest error of a rate for each observer."""
    for name in list(runs)[1:]:
        e, per_sec = rate_error(runs, name), PER_SEC // runs[name][0]
        yield name, *(number(e[secs * per_sec], 2) for secs in (0, 5, 10, 20, 40))


def draw_flight(runs: dict[str, tuple[int, FloatArray]]) -> None:
    """Draw the angular rates with their estimates, and the errors."""
    figure, axes = plt.subplots(3, 1, figsize=(6.4, 5.2), sharex=True)
    for k, (ax, name) in enumerate(zip(axes, ("p, roll", "q, pitch", "r, yaw"), strict=True)):
        per_tick, x = runs["truth"]
        times = np.arange(len(x)) / PER_SEC
        ax.plot(times, np.degrees(x[:, 3 + k]), color=GREY, ls="--", label="truth")
        for which, colour in (("reduced order", BLUE), ("full order", RED)):
            per_tick, x = runs[f"{which}, tick 1 s"]
            times = np.arange(len(x)) * per_tick / PER_SEC
            ax.plot(times, np.degrees(x[:, 3 + k]), color=colour, marker=".", ms=5, label=which)
        ax.set_ylabel(f"{name}, °/s")
    axes[-1].set_xlabel("time, s")
    axes[-1].set_xlim(0, 20)
    axes[-1].set_xticks(range(0, 21, 5))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    picture(
        "per_tick_observer_1",
        figure,
        "Angular rates of the spacecraft estimated from its three angles, all poles at −0.5 1/s,"
        " the gain computed anew at each tick of 1 s. It replaces the figures that our copy"
        " lacks.",
    )
    plt.close(figure)
    figure, errors = plt.subplots(figsize=(6.4, 3.8))
    for name, colour in zip(list(runs)[1:], (BLUE, RED, AMBER, GREEN), strict=True):
        times = np.arange(len(runs[name][1])) * runs[name][0] / PER_SEC
        errors.semilogy(times, rate_error(runs, name), color=colour, label=name)
    errors.semilogy(times, 0.06 * np.exp(POLE * times), color=GREY, ls="--", label="e^(−0.5 t)")
    errors.set_xlabel("time, s")
    errors.set_ylabel("largest error of a rate, rad/s")
    errors.set_xlim(0, SECS)
    errors.set_ylim(1e-11, 1)
    errors.legend(loc="lower left")
    picture(
        "per_tick_observer_2",
        figure,
        "The errors of these estimates. (1.5) as printed moves the estimate by the linearised model"
        " within a tick, and an error remains; shiplog moves it by the model itself.",
    )
    plt.close(figure)


def draw_singular() -> None:
    """Draw the gains as the pitch approaches 90°."""
    distances = np.logspace(1.9, -7, 120)  # degrees from a pitch of 90°
    largest: dict[str, list[float]] = {"full": [], "reduced": []}
    for order in ("full", "reduced"):
        observer = observer_of_the_spacecraft("full" if order == "full" else "reduced")
        for degrees in distances:
            x = FLIGHT.copy()
            x[1] = np.pi / 2 - np.radians(degrees)
            try:
                largest[order].append(float(np.abs(observer.gain(x)).max()))
            except UsageError:
                largest[order].append(np.nan)
    figure, ax = plt.subplots(figsize=(6.4, 3.2))
    for (order, sizes), colour in zip(largest.items(), (RED, BLUE), strict=True):
        ax.loglog(
            distances,
            sizes,
            color=colour,
            label=f"{order} order, {'L' if order == 'full' else 'N'}",
        )
    ax.invert_xaxis()
    ax.set_xlabel("90° − pitch, °")
    ax.set_ylabel("largest gain (1/s, 1/s²)")
    ax.legend()
    full, reduced = (
        min(d for d, size in zip(distances, largest[order], strict=True) if np.isfinite(size))
        for order in ("full", "reduced")
    )
    picture(
        "per_tick_observer_3",
        figure,
        "Not mentioned in our part of the paper: Euler angles have no rates where cos θ = 0. The"
        " gain of the full order grows as 1 / cos² θ. That of the reduced order does not, but its"
        f" model becomes singular. shiplog rejects angles nearer than {number(full, 1)}° (full"
        f" order) and {number(reduced, 1)}° (reduced order) with a message.",
    )
    plt.close(figure)


def draw_ship() -> str:
    """Draw the errors on the ship, with the gain of each tick and with a constant gain.

    Returns
    -------
    str
        The largest difference of both errors, relative to the largest error.
    """
    tick, count = 2.0, 100
    times = np.arange(4 * count + 1) * tick / 4
    run = truth(ship, SHIP, times)
    u = np.array([ship_inputs(t) for t in times])
    observer = tick_observer(ship, ship_jacobian, RATE_AND_SPEED, [-0.1] * 3)
    initial_jacobian = ship_jacobian(SHIP, ship_inputs(0))
    errors_by_variant = {}
    for name, variant in (
        ("relinearised at each tick", observer),
        ("constant gain of the start", replace(observer, jacobian=lambda *_: initial_jacobian)),
    ):
        x = SHIP + np.array([0.005, -5e-4, -1.0])
        errors = [np.abs(x - run[0])]
        for k in range(0, 4 * count, 4):
            x = variant.step(x, run[k : k + 5, [0, 2]], u[k : k + 5], tick_secs=tick)
            errors.append(np.abs(x - run[k + 4]))
        errors_by_variant[name] = np.array(errors)
    figure, axes = plt.subplots(3, 1, figsize=(6.4, 5.2), sharex=True)
    labels = ("yaw rate, °/s", "its derivative, °/s²", "speed, m/s")
    for k, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        for (name, e), colour, ls in zip(
            errors_by_variant.items(), (BLUE, AMBER), ("-", "--"), strict=True
        ):
            scale = np.degrees(1) if k < 2 else 1
            ax.semilogy(times[::4], e[:, k] * scale, color=colour, ls=ls, label=name)
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time, s")
    axes[-1].set_xlim(0, times[-1])
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    picture(
        "per_tick_observer_4",
        figure,
        "Errors of the estimates for a ship with a sinusoidal rudder of 20°, poles at −0.1 1/s,"
        " yaw rate and speed measured. Relinearising at each tick has no advantage here. The"
        " lower limit is the error of the Runge-Kutta steps of 1 s.",
    )
    plt.close(figure)
    each_tick, constant = (e[:, 1] for e in errors_by_variant.values())
    return number(np.abs(each_tick - constant).max() / each_tick.max(), 1)


def exact() -> Iterator[tuple[str, ...]]:
    """List the errors of the characteristic polynomial, for random systems of each size."""
    warnings.filterwarnings("ignore", "Convergence was not reached")  # a warning of SciPy
    for n, m in ((4, 2), (6, 3), (8, 3), (10, 2)):
        rng = np.random.default_rng(0)
        ours, scipy, equal, rejected = [], [], [], 0
        for _ in range(SYSTEMS):
            A, C = rng.standard_normal((n, n)), rng.standard_normal((m, n))
            wanted = -rng.uniform(1, 3, n)
            gain = place_poles(A.T, C.T, wanted, maxiter=1).gain_matrix.T
            scipy.append(polynomial_error(A - gain @ C, wanted.astype(complex)))
            same = np.full(n, -1.0 + 0j)
            try:
                ours.append(polynomial_error(A - place_multilevel(A, C, wanted) @ C, wanted + 0j))
                equal.append(polynomial_error(A - place_multilevel(A, C, same) @ C, same))
            except UsageError:
                rejected += 1
        sizes = (np.median(ours), max(ours), np.median(equal), np.median(scipy), max(scipy))
        cells = (number(size, 1) for size in sizes)
        yield f"({n}, {m})", *cells, str(rejected)


def ship_together() -> Iterator[tuple[str, ...]]:
    """List the poles and the noise of yaw and surge hard over, placed apart and together."""
    A, C = ship_jacobian(HARD_OVER, HARD_OVER_INPUTS, TABLE1_DEGREES), RATE_AND_SPEED
    for of_yaw, surge in SHIP_POLES:
        wanted = np.array([*of_yaw, surge])
        apart = np.zeros((3, 2))
        apart[:2, :1] = place_multilevel(A[:2, :2], [[1, 0]], of_yaw)
        apart[2, 1] = A[2, 2] - surge
        removed = apart.copy()
        removed[1, 1] = A[1, 2]
        gains = {
            "yaw and surge apart": apart,
            "the same, coupling removed": removed,
            "together, multi-level": place_multilevel(A, C, wanted),
            "together, least noise": place_for_noise(A, C, wanted, SHIP_NOISE, LOG_NOISE).gain,
        }
        first = np.diag(error_covariance(A, apart, C, SHIP_NOISE, LOG_NOISE))
        for name, gain in gains.items():
            variances = np.diag(error_covariance(A, gain, C, SHIP_NOISE, LOG_NOISE))
            ratios = (number(float(ratio), 3) for ratio in np.sqrt(variances / first))
            found = (
                np.linalg.eigvals(A - gain @ C).astype(complex).round(7)
            )  # a double pole's digits
            yield format_poles(wanted.astype(complex)), name, format_poles(found), *ratios


def noise_of_random_systems() -> Iterator[tuple[str, ...]]:
    """List by how much the error of the worst state exceeds that of the Kalman filter."""
    ratios: dict[str, list[float]] = {"multi-level": [], "SciPy": [], "least noise": []}
    for seed in range(NOISY_SYSTEMS):
        rng = np.random.default_rng(seed)
        n, m = (4, 2) if seed % 2 else (5, 2)
        A, C = rng.standard_normal((n, n)), rng.standard_normal((m, n))
        wanted, W, R = -rng.uniform(1, 3, n), np.eye(n), np.eye(m)
        optimum = np.diag(kalman_gain(A, np.eye(n), C, W, R).covariance)
        gains = (
            place_multilevel(A, C, wanted),
            place_poles(A.T, C.T, wanted, maxiter=100).gain_matrix.T,
            place_for_noise(A, C, wanted, W, R).gain,
        )
        for own, gain in zip(ratios.values(), gains, strict=True):
            variances = np.diag(error_covariance(A, gain, C, W, R))
            own.append(float(np.sqrt(variances / optimum).max()))
    for name, own in ratios.items():
        yield name, number(float(np.median(own)), 3), number(max(own), 3)


def main() -> None:
    """Print the page and draw its pictures."""
    start_page("Per-tick observer: printed against computed")
    paragraph(INTRODUCTION)
    comparison("The formulas as printed", misprints())
    comparison("The corrections of (1.12), (1.13)", corrections())
    head = ("spacecraft", "on roll", "on pitch", "on yaw")
    table("The gains of the spacecraft", head, gains())
    difference = number(closed_form_difference(), 1)
    paragraph(
        f"Inertias {I1:g}, {I2:g} and {I3:g} kg·m², Euler angles 3-2-1, all poles at"
        f" {number(POLE)} 1/s, angles (0.1, −0.2, 0.3) rad and rates (0.05, −0.04, 0.06) rad/s. L"
        " is the gain of the full order, N that of the reduced order, ω̂ = z + N y. The recursion"
        f" and the closed form for an invertible A12 agree to {difference}."
    )
    runs = flights()
    columns = ("largest error of a rate, rad/s", *(f"{secs} s" for secs in (0, 5, 10, 20, 40)))
    table("The flight", columns, flight_errors(runs))
    draw_flight(runs)
    paragraph("## Where it fails, and where it has no advantage")
    draw_singular()
    difference = draw_ship()
    paragraph(
        "The errors of the derivative of the yaw rate, which is not measured, differ by at most"
        f" {difference} of the largest error."
    )
    columns = ("asked, 1/s", "design", "poles, 1/s", "σ of w", "of w'", "of v")
    table("A ship's yaw and surge, apart and together", columns, ship_together())
    paragraph(
        "The ship of Table 1 in degrees in a steady turn at 35° of rudder; σ of yaw rate, its"
        " derivative and speed relative to the first design, with the noise that the filters assume"
        " for the sample data. `--filter per-tick` places yaw and surge apart and neglects that"
        " speed acts on yaw by the rudder and yaw on speed by the drag: its poles are exact for"
        " each channel, and hard over those of both together deviate as listed. If the speed's"
        " measurement removes its effect on yaw, they are exact, but the noise of the log enters"
        " the yaw rate, and in the multi-level gain far more so. Of all gains that place them"
        " exactly, that of the least noise nearly equals the first design. For a ship, designs"
        " apart are therefore better: they have the least noise in yaw and need no search."
    )
    sizes = ("(n, m)", "median", "worst", "all poles equal, median")
    table('"Exact placement"', (*sizes, "SciPy, median", "SciPy, worst", "rejected"), exact())
    paragraph(
        f"Relative errors of the characteristic polynomial, {SYSTEMS} random systems of each size,"
        " poles between −3 and −1 1/s. The placement is exact up to rounding, which grows with the"
        " number of levels; `place_multilevel` rejects a result with an error above 1e−4."
        " `scipy.signal.place_poles` does not accept equal poles. It makes one iteration here"
        " instead of its thirty, to save time."
    )
    columns = ("gain", "median", "worst")
    table("Many gains have the same poles", columns, noise_of_random_systems())
    paragraph(
        f"σ of the worst state over that of the Kalman filter, {NOISY_SYSTEMS} random systems of"
        " four or five states and two sensors, poles between −3 and −1 1/s, state and"
        " sensor noise of unit intensity. The paper places the poles by any Φ_k with the right"
        " eigenvalues; with m sensors that leaves n (m − 1) numbers free: the Schur vectors of Φ_k,"
        " the entries beside the diagonal of its Schur form, and the part of K_k that V_k does not"
        " contain. `place_multilevel` sets them to zero. `place_for_noise` searches those of the"
        " least product of the variances; the poles remain exact. What is still above one is the"
        " price of the poles; at the poles of the Kalman filter it is one."
    )


if __name__ == "__main__":
    main()

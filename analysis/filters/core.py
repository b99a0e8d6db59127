"""The core of a filter: the ship's own states, chosen in compiled code by the type of the core.

A core is a NamedTuple of the ship's coefficients (`model`) and of what its functions need. Its
states are the first of the filter's, yaw rate and yaw acceleration before all others. The module of
a core registers its functions by `shiplog.compiled.overload_for`.
"""

from typing import Any, NamedTuple

from shiplog.types import FloatArray


class StepInputs(NamedTuple):
    """What acts on the ship at an instant and during the step after it.

    Attributes
    ----------
    delta, delta_dot
        The rudder angle, rad, and its rate during the step, rad/s.
    n, n_dot
        The revolutions, rpm, and their rate during the step, rpm/s.
    moment, force
        The specific yaw moment, rad/s³, and surge force, m/s², that are states of the filter.
    """

    delta: float
    delta_dot: float
    n: float
    n_dot: float
    moment: float
    force: float


def begin_instant(core: Any, x: FloatArray, u: StepInputs) -> None:  # noqa: ANN401
    """Change the state (s,) in place by what happens at the instant itself."""
    raise NotImplementedError(f"no states for {type(core).__name__}")


def gain(
    core: Any,  # noqa: ANN401
    x: FloatArray,
    Pc: FloatArray,
    S: float,
    u: StepInputs,
    output: int,
    K: FloatArray,
) -> None:
    """Set the gain K (s,) of an output, from P c (s,) and S = c' P c + r."""
    raise NotImplementedError(f"no gain for {type(core).__name__}")


def advance(
    core: Any,  # noqa: ANN401
    x: FloatArray,
    F: FloatArray,
    B: FloatArray,
    u: StepInputs,
    dt: float,
) -> None:
    """Advance the core's states by a step of dt seconds, in place.

    F (s, s) and B (c, 2) get the derivatives of the step by these states and by a constant moment
    and force, where they depend on the state; B has no columns where there are none.
    """
    raise NotImplementedError(f"no equations for {type(core).__name__}")


def output_row(
    core: Any,  # noqa: ANN401
    x: FloatArray,
    P: FloatArray,
    u: StepInputs,
    slopes: FloatArray,
    row: FloatArray,
) -> None:
    """Compute w, w', w'', v and v' of an instant and their variances.

    Parameters
    ----------
    core, x, P
        The core, the state (s,) and its covariance (s, s).
    u
        The inputs, with the moment and the force at the instant itself.
    slopes
        (2, s): derivatives of moment and force by the state. Those by the core's own states are
        work space of the core.
    row
        (10,): set to the five states in rad/s^k and m/s^k, then their variances.
    """
    raise NotImplementedError(f"no outputs for {type(core).__name__}")

"""Every design rejects invalid arguments with their name, shape and what is expected."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from analysis.design.cascade import cascade
from analysis.design.exosystem import Plant, ambiguities, disturbance_observer
from analysis.design.per_tick import block_gains
from analysis.design.placement import place_multilevel, unobservable_modes
from analysis.design.quality import (
    cycle_regulator,
    decay_projectors,
    quality_filter,
    quality_regulator,
)
from analysis.design.riccati import error_covariance, kalman_gain
from analysis.design.shaping import TransferFunction, augment_with_shaping
from shiplog import UsageError

A, COLUMN, ROW, I = (
    np.array([[0.0, 1], [-0.2, -1]]),
    np.array([[1.0], [0]]),
    np.eye(1, 2),
    np.eye(2),
)
SHAPING = TransferFunction(np.array([1.0]), np.array([1.0, 1]))


def observed(A: Any, B: Any, C: Any) -> object:  # noqa: ANN401
    plant = Plant(A, B, C, ("w", "w'"), ("gyro",))
    ambiguities(plant, ())
    return disturbance_observer(plant, (), frequency=0.1)


# each design function with valid arguments
VALID_ARGUMENTS: dict[Callable[..., object], dict[str, Any]] = {
    kalman_gain: {"A": A, "G": I, "C": ROW, "Q": I, "R": [[1.0]], "N": np.zeros((2, 1))},
    error_covariance: {"A": A, "L": COLUMN, "C": ROW, "W": I, "R": [[1.0]]},
    quality_regulator: {"A": A, "B": COLUMN, "P": I, "R": [[1.0]], "G": I},
    quality_filter: {"A": A, "S": ROW, "R1": I, "R2": [[1.0]], "G": I},
    cycle_regulator: {"A": A, "B": COLUMN, "P": I, "R": [[1.0]], "cycles": 2, "G": I},
    cascade: {
        "A": A, "S": ROW, "R1": I, "R2": [[1.0]], "first": np.ones((2, 1)), "stages": 2,
        "correlation_secs": 1.0,
    },
    augment_with_shaping: {
        "A": A, "B": COLUMN, "C": ROW, "G": COLUMN, "shaping": SHAPING, "noise": I,
    },
    place_multilevel: {"A": A, "C": ROW, "poles": np.array([-1.0, -2])},
    unobservable_modes: {"A": A, "C": ROW},
    decay_projectors: {"A": A, "border": 0.5},
    block_gains: {"A": A, "Phi0": [[-1.0]], "Phi1": [[-1.0]]},
    observed: {"A": A, "B": COLUMN, "C": ROW},
}  # fmt: skip
WEIGHTS = {
    kalman_gain: ("Q", "R"), error_covariance: ("W", "R"), quality_regulator: ("P", "R", "G"),
    quality_filter: ("R1", "R2", "G"), cycle_regulator: ("P", "R", "G"), cascade: ("R1", "R2"),
}  # fmt: skip
OPTIONS = ("cycles", "stages", "correlation_secs", "shaping", "border")
ARGUMENTS = [
    (of, name) for of, given in VALID_ARGUMENTS.items() for name in given if name not in OPTIONS
]
of_each_argument = pytest.mark.parametrize(
    ("of", "name"), ARGUMENTS, ids=[f"{of.__name__}-{name}" for of, name in ARGUMENTS]
)


def error_message(of: Callable[..., object], name: str, value: object) -> str:
    with pytest.raises(UsageError) as caught:
        of(**(VALID_ARGUMENTS[of] | {name: value}))
    message = str(caught.value)
    assert "\n" not in message
    assert name in message
    assert "expected" in message
    return message


@pytest.mark.parametrize("of", VALID_ARGUMENTS, ids=lambda of: of.__name__)
def test_valid_arguments_are_accepted(of: Callable[..., object]) -> None:
    of(**VALID_ARGUMENTS[of])


@of_each_argument
@pytest.mark.parametrize("wrong", [(5,), (3, 5), (2, 2, 2), (0, 0), (3, 1)], ids=str)
def test_wrong_shape_raises_an_error_with_the_argument(
    of: Callable[..., object], name: str, wrong: tuple[int, ...]
) -> None:
    message = error_message(of, name, np.ones(wrong))
    assert f"of shape ({wrong[0]}," in message


@of_each_argument
@pytest.mark.parametrize("hole", [np.nan, np.inf])
def test_nan_and_infinity_raise_an_error_with_the_shape(
    of: Callable[..., object], name: str, hole: float
) -> None:
    given = np.array(VALID_ARGUMENTS[of][name], dtype=float)
    given.flat[-1] = hole
    message = error_message(of, name, given)
    assert str(given.shape) in message
    assert "NaN or infinities; expected finite numbers" in message


@of_each_argument
def test_values_that_are_not_numbers_raise_an_error(of: Callable[..., object], name: str) -> None:
    for value in ("fast", [[1, 2], [3]], None):
        if value is not None or name not in ("N", "G", "noise"):  # optional arguments
            error_message(of, name, value)


@pytest.mark.parametrize(
    ("of", "name"), [(of, name) for of, names in WEIGHTS.items() for name in names]
)
def test_asymmetric_or_indefinite_weight_raises_an_error_with_the_shape(
    of: Callable[..., object], name: str
) -> None:
    n = len(np.array(VALID_ARGUMENTS[of][name]))
    indefinite = -np.eye(n)
    indefinite[0, 0] = 1.0 if n > 1 else -1.0
    message = error_message(of, name, indefinite)
    assert f"{name}, ({n}, {n}), has the eigenvalue -1; expected a positive" in message
    if n > 1:
        message = error_message(of, name, np.eye(n) + np.triu(np.ones((n, n)), 1))
        assert (
            f"{name}, ({n}, {n}), differs from its transpose by 1; expected a symmetric" in message
        )


@pytest.mark.parametrize(
    ("of", "change", "message"),
    [
        (kalman_gain, {"A": np.eye(2)}, r"A \(2, 2\) and C: the mode at 1 does not decay"),
        (quality_filter, {"A": np.eye(2)}, r"A \(2, 2\) and S: the mode at 1 does not decay"),
        (quality_regulator, {"A": np.eye(2)}, r"A \(2, 2\) and B: the mode at 1 does not decay"),
        (cycle_regulator, {"A": np.eye(2)}, r"A \(2, 2\) and B: the mode at 1 does not decay"),
        (place_multilevel, {"A": np.eye(2)}, r"A \(2, 2\) and C \(1, 2\): the mode at 1 cannot be"),
        (observed, {"A": np.diag([-1.0, -2])}, r"at the mode -2 the state \"w'\" cannot be seen"),
    ],
)
def test_unobservable_pair_raises_an_error_with_mode_and_remedy(
    of: Callable[..., object], change: dict[str, Any], message: str
) -> None:
    with pytest.raises(UsageError, match=message) as caught:
        of(**(VALID_ARGUMENTS[of] | change))
    assert any(remedy in str(caught.value) for remedy in ("measure ", "add an input"))


@pytest.mark.parametrize(
    "poles", [[-1 + 1j, -1], [-1 + 1j, -1 + 1j], [-1 + 1j, -1.001 - 1j], [-1 - 1j, -2]]
)
def test_pole_without_its_conjugate_raises_an_error(poles: list[complex]) -> None:
    message = error_message(place_multilevel, "poles", poles)
    assert "poles, (2,), have -1" in message
    assert "without its conjugate; expected both" in message

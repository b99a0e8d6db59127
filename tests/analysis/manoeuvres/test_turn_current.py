"""The current of a turn that settles, from its positions."""

import numpy as np
import pytest

from analysis.manoeuvres.found_manoeuvre import FoundManoeuvre
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.manoeuvres.trial_signals import TrialSignals
from analysis.manoeuvres.turn_current import current_in_turn

CURRENT = np.array([0.5, -0.3])
RATE, COUNT = 0.01, 1300  # rad/s; s


def turn(noise: float, turned: float = RATE * COUNT) -> tuple[TrialSignals, FoundManoeuvre]:
    """Make a turn whose speed falls by a half within the first circle, with a drift of 20°."""
    time = np.arange(round(turned / RATE)) * 1.0
    heading, speed = RATE * time, 4.0 * (1 + np.exp(-time / 150.0))
    steps = speed * np.exp(1j * (heading - 0.35))
    path = np.cumsum(steps) + complex(*CURRENT) * time
    rng = np.random.default_rng(1)
    positions = np.column_stack((path.real, path.imag)) + rng.normal(0, noise, (len(time), 2))
    none = np.full(len(time), np.nan)
    signals = TrialSignals(1.0, none, heading, none, none, none, positions, none, none, none)
    return signals, FoundManoeuvre(ManoeuvreKind.TURNING_CIRCLE, 0, len(time), level=0.6)


def test_a_turn_that_is_not_steady_yet_has_no_bias() -> None:
    estimate = current_in_turn(*turn(0.0))
    assert estimate is not None
    assert estimate[0] == pytest.approx(CURRENT, abs=0.003)


def test_noise_of_the_positions_is_in_the_uncertainty() -> None:
    estimate = current_in_turn(*turn(5.0))
    assert estimate is not None
    current, std = estimate
    assert np.abs(current - CURRENT).max() < 3 * std
    assert std < 0.02


def test_a_turn_of_less_than_560_degrees_gives_none() -> None:
    assert current_in_turn(*turn(0.0, np.radians(550.0))) is None

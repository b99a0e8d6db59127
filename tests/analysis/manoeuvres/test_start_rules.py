"""The instant of an execute by each rule."""

from math import radians

import numpy as np
import pytest

from analysis.manoeuvres.found_manoeuvre import FoundManoeuvre
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.manoeuvres.start_rules import RuleSettings, StartRule, find_executes, ramp_start
from analysis.manoeuvres.trial_signals import TrialSignals

DT, START = 0.5, 50.2
TIME = np.arange(0.0, 120.0, DT)
RUDDER = radians(1.0) + radians(2.5) * np.clip(TIME - START, 0.0, 8.0)


def trial(*, orders: bool, events: tuple[tuple[float, str], ...] = ()) -> TrialSignals:
    none = np.full(len(TIME), np.nan)
    order = np.where(START - 0.7 <= TIME, RUDDER[-1], RUDDER[0]) if orders else none
    return TrialSignals(
        DT, RUDDER, 0 * TIME, 0 * TIME, none, none, np.full((len(TIME), 2), np.nan), order, none,
        none, events=events,
    )  # fmt: skip


FOUND = FoundManoeuvre(ManoeuvreKind.TURNING_CIRCLE, round(49 / DT), 240, level=0.35)


@pytest.mark.parametrize(
    ("rule", "expected", "word"),
    [
        (StartRule.ORDER, START - 0.7, "channel"),
        (StartRule.MOVED, START + 0.2, "moved 0.5°"),
        (StartRule.EVENT, 47.0, "event"),
        (StartRule.STATED, 45.0, "stated"),
    ],
)
def test_each_rule_gives_its_own_instant(rule: StartRule, expected: float, word: str) -> None:
    signals = trial(orders=True, events=((47.0, "Execute, 20 starboard"), (10.0, "wind 5 m/s")))
    settings = RuleSettings(rule, execute_secs=(45.0, 500.0))
    execute, others = find_executes(signals, FOUND, settings)
    assert execute.sample * DT == pytest.approx(expected, abs=0.3)
    assert word in execute.rule
    assert len(others) == 3


def test_without_orders_the_execute_is_the_beginning_of_the_movement() -> None:
    execute, _ = find_executes(trial(orders=False), FOUND, RuleSettings())
    assert execute.sample * DT == pytest.approx(START, abs=0.02)
    assert "movement" in execute.rule


def test_a_rule_that_does_not_apply_gives_way_to_the_order() -> None:
    execute, _ = find_executes(trial(orders=False), FOUND, RuleSettings(StartRule.EVENT))
    assert "order" in execute.rule


def test_the_uncertainty_of_a_start_is_that_of_its_scatter() -> None:
    rng = np.random.default_rng(1)
    starts, stds = zip(
        *(
            ramp_start(RUDDER + rng.normal(0, radians(0.3), len(TIME)), 98, 1.0, DT)
            for _ in range(200)
        ),
        strict=True,
    )
    assert np.std(starts) * DT == pytest.approx(np.sqrt(np.mean(np.square(stds))), rel=0.3)
    assert np.mean(starts) * DT == pytest.approx(START, abs=0.05)

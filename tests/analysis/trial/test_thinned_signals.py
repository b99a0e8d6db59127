"""Signals thinned in chunks: averages of stretches, wherever the chunks are cut."""

import numpy as np
import pytest

from analysis.trial.thinned_signals import ThinnedSignals


def thinned(values: np.ndarray, cuts: tuple[int, ...] = ()) -> ThinnedSignals:
    signals = ThinnedSignals(len(values), 0.1, ("rudder",))
    for first, part in zip((0, *cuts), np.split(values, cuts), strict=True):
        signals.add(first, {"rudder": part})
    return signals


def test_a_short_trial_stays_as_it_is() -> None:
    values = np.array([1.0, np.nan, 3.0])
    signals = thinned(values)
    np.testing.assert_array_equal(signals.values()["rudder"], values)
    np.testing.assert_allclose(signals.time_secs, [0.0, 0.1, 0.2])


def test_a_long_trial_is_averaged_over_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("analysis.trial.thinned_signals.MAX_SAMPLES", 4)
    values = np.array([1.0, 2.0, np.nan, 4.0, 5.0, np.nan, np.nan, np.nan, np.nan, 10.0])
    signals = thinned(values)
    np.testing.assert_allclose(signals.values()["rudder"], [1.5, 4.5, np.nan, 10.0])
    np.testing.assert_allclose(signals.time_secs, [0.1, 0.4, 0.7, 1.0])
    assert signals.trial_signals().dt_secs == pytest.approx(0.3)


def test_where_chunks_are_cut_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("analysis.trial.thinned_signals.MAX_SAMPLES", 30)
    values = np.random.default_rng(0).standard_normal(1000)
    whole = thinned(values).values()["rudder"]
    np.testing.assert_array_equal(thinned(values, (1, 333, 334, 900)).values()["rudder"], whole)


def test_what_was_not_added_is_not_measured_in_the_signals_of_the_trial() -> None:
    trial = thinned(np.zeros(20)).trial_signals()
    assert trial.has("rudder")
    assert not trial.has("heading")
    assert not trial.has("positions")

"""A screened log has one source of each quantity and no value that is impossible."""

import numpy as np
import pytest
from channels import channel

from shiplog import LogError, TrialLog
from shiplog.screening import ScreenedLog, screen_log


def a_log(rudder: np.ndarray) -> TrialLog:
    yaw_rate = channel(np.sin(0.1 * np.arange(len(rudder))))
    return TrialLog("trial.mcap", (yaw_rate, channel(rudder, name="rudder")))


def screened(log: TrialLog, **options: object) -> ScreenedLog:
    return screen_log(log, ("yaw_rate", "rudder"), purpose="a replay", **options)  # type: ignore[arg-type]


def test_an_impossible_value_is_not_measured() -> None:
    rudder = 0.1 * np.cos(0.1 * np.arange(100))
    rudder[40] = 9.99
    log = screened(a_log(rudder))
    (chunk,) = log.chunks()
    expected = np.where(np.arange(100) == 40, np.nan, rudder)
    np.testing.assert_array_equal(chunk[1].values, expected)
    assert any("impossible" in warning and "rudder" in warning for warning in log.warnings)


def test_a_missing_channel_is_refused_with_what_needs_it() -> None:
    log = TrialLog("trial.mcap", (channel(np.zeros(20)),))
    with pytest.raises(LogError, match=r"no channel 'rudder' in trial.mcap; .* a replay needs"):
        screened(log)


def test_a_chosen_source_is_used_and_an_unknown_one_refused() -> None:
    log = a_log(np.zeros(100))
    assert "rudder/a" in screened(log, sources={"rudder": "a"}).screening.stats
    with pytest.raises(LogError, match="no source 'b' of 'rudder'"):
        screened(log, sources={"rudder": "b"})

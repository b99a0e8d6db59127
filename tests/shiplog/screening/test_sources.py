"""Among several sources of one quantity the right one is used, and disagreement is reported."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from trial_logs import as_log

from analysis import analyse, identify
from recorders.simulated.simulate import simulate
from shiplog import Channel, TrialLog, Vessel
from shiplog.screening import ScreenedLog, screen_log

NAMES = ("yaw_rate", "speed", "rudder", "rpm")

Change = Callable[[np.ndarray], np.ndarray]


@pytest.fixture(scope="module")
def trial(vessel: Vessel) -> TrialLog:
    return as_log(simulate(vessel, "zigzag-20-20", duration_secs=300.0, seed=5))


def screened(log: TrialLog, sources: dict[str, str] | None = None) -> ScreenedLog:
    return screen_log(log, NAMES, ("heading", "position"), purpose="a replay", sources=sources)


def with_source(log: TrialLog, name: str, change: Change, *, source: str = "other") -> TrialLog:
    """Return the log with a changed copy of a channel as the first source of the quantity."""
    channel = log[name]
    values = change(np.array(channel.values))
    return replace(log, channels=(replace(channel, source=source, values=values), *log.channels))


def used(log: TrialLog, name: str) -> tuple[str, str]:
    """Return the source used, and the warning about it."""
    result = screened(log)
    (warning,) = [text for text in result.warnings if text.startswith(f"{name}: ")]
    return result.screening.stats[name].source, warning


def test_a_log_with_one_source_each_has_no_choice(trial: TrialLog) -> None:
    assert screened(trial).screening.sources == {}
    assert screened(trial).warnings == ()


@pytest.mark.parametrize(
    ("name", "change", "figures"),
    [
        ("yaw_rate", lambda x: 0 * x, "constant at 0 deg/s"),
        ("yaw_rate", lambda x: x + np.radians(0.3), "1.00 x simulated +0.3 deg/s"),
        ("yaw_rate", lambda x: -x, "-1.00 x simulated"),
        ("yaw_rate", lambda x: 1.3 * x, "1.30 x simulated"),
        ("yaw_rate", lambda x: np.roll(x, 200), "differs by"),
        ("speed", lambda x: x / 1.94384, "0.51 x simulated"),
        ("speed", lambda x: 0 * x + 3.0, "constant at 5.83 kn"),
        ("rudder", lambda x: 0.3 * x + np.radians(2.0), "0.30 x simulated +2 deg"),
        ("rudder", lambda x: x - np.radians(3.0), "1.00 x simulated -3 deg"),
    ],
)
def test_a_wrong_source_is_not_used_and_its_error_is_stated(
    trial: TrialLog, name: str, change: Change, figures: str
) -> None:
    source, warning = used(with_source(trial, name, change), name)
    assert source == "simulated"
    assert figures in warning
    assert f"--source {name}=other selects another" in warning


def test_sources_that_agree_are_named_without_disagreement(trial: TrialLog) -> None:
    rng = np.random.default_rng(1)
    noisy = with_source(trial, "yaw_rate", lambda x: x + 1e-5 * rng.standard_normal(len(x)))
    source, warning = used(noisy, "yaw_rate")
    assert source in ("other", "simulated")
    assert "disagree" not in warning


def test_the_odd_one_of_three_is_not_used(trial: TrialLog) -> None:
    log = with_source(trial, "rpm", lambda x: 1.0 * x, source="port")
    log = with_source(log, "rpm", lambda x: 0.8 * x + np.sin(np.arange(len(x))), source="centre")
    source, warning = used(log, "rpm")
    assert source in ("port", "simulated")
    assert "centre differs by" in warning


def test_the_right_one_of_three_rudders_that_all_differ_is_used(trial: TrialLog) -> None:
    def stuck(values: np.ndarray) -> np.ndarray:
        values[len(values) // 6 :] = values[len(values) // 6]
        return values

    log = with_source(trial, "rudder", lambda x: 0.5 * x + np.radians(3.0), source="slipping")
    source, warning = used(with_source(log, "rudder", stuck, source="stuck"), "rudder")
    assert source == "simulated"
    assert "slipping = 0.50 x simulated +3 deg" in warning
    assert "the others do not explain the yaw rate" in warning


def test_a_source_with_long_gaps_is_not_used(trial: TrialLog) -> None:
    def mostly_missing(values: np.ndarray) -> np.ndarray:
        values[: 3 * len(values) // 4] = np.nan
        return values

    source, warning = used(with_source(trial, "yaw_rate", mostly_missing), "yaw_rate")
    assert source == "simulated"
    assert "of the time" in warning


def test_the_faster_of_two_equal_sources_is_used(trial: TrialLog) -> None:
    channel = trial["yaw_rate"]
    slow = replace(channel.take(slice(None, None, 5)), source="slow")
    source, warning = used(replace(trial, channels=(slow, *trial.channels)), "yaw_rate")
    assert source == "simulated"
    assert "the fastest" in warning


def test_a_second_position_source_elsewhere_is_reported(trial: TrialLog) -> None:
    def shifted(values: np.ndarray) -> np.ndarray:
        values[100:, 0] += 400.0
        return values

    _, warning = used(with_source(trial, "position", shifted), "position")
    assert "differs by" in warning


def test_a_second_position_source_with_a_single_fix_is_not_used(trial: TrialLog) -> None:
    def only_first(values: np.ndarray) -> np.ndarray:
        values[1:] = np.nan
        return values

    result = screened(with_source(trial, "position", only_first))
    assert result.screening.stats["position"].source == trial["position"].source


def test_two_receivers_at_one_place_agree_although_one_starts_later(trial: TrialLog) -> None:
    fixes = trial["position"]
    late = replace(fixes.take(slice(len(fixes) // 3, None)), source="late")
    result = screened(replace(trial, channels=(*trial.channels, late)))
    (warning,) = [text for text in result.warnings if text.startswith("position: 2 sources")]
    assert "disagree" not in warning


def test_a_stuck_heading_with_noise_does_not_choose_the_yaw_rate(trial: TrialLog) -> None:
    rng = np.random.default_rng(4)
    log = with_source(trial, "yaw_rate", lambda x: x / 57.3, source="TI")
    log = with_source(log, "heading", lambda x: 1.0 + 1e-3 * rng.standard_normal(len(x)))
    stats = screened(log).screening.stats
    assert (stats["heading"].source, stats["yaw_rate"].source) == ("simulated", "simulated")


def test_the_speed_through_the_water_is_preferred_to_that_of_the_fixes(trial: TrialLog) -> None:
    secs = (trial["position"].measured_ns - trial["position"].measured_ns[0]) * 1e-9
    drifting = replace(
        trial["position"], values=trial["position"].values + np.outer(secs, [1.0, 0.0])
    )
    log = replace(
        trial, channels=tuple(drifting if c.name == "position" else c for c in trial.channels)
    )
    source, warning = used(with_source(log, "speed", lambda x: x + 1.0, source="gps"), "speed")
    assert source == "simulated"
    assert "through the water" in warning


def test_the_fastest_of_the_good_sources_is_used_beside_a_bad_one(trial: TrialLog) -> None:
    slow = replace(trial["yaw_rate"].take(slice(None, None, 10)), source="slow")
    bad = replace(trial["yaw_rate"], source="bad", values=3.0 * trial["yaw_rate"].values)
    log = replace(trial, channels=(slow, bad, *trial.channels))
    assert screened(log).screening.stats["yaw_rate"].source == "simulated"


def test_the_user_can_choose_any_source(trial: TrialLog) -> None:
    log = with_source(trial, "yaw_rate", lambda x: -x)
    result = screened(log, {"yaw_rate": "other"})
    assert result.screening.stats["yaw_rate"].source == "other"
    assert not any("sources" in warning for warning in result.warnings)


@pytest.mark.parametrize("sources", [None, {"yaw_rate": "other"}])
def test_the_statistics_of_sources_that_are_not_used_are_kept_apart(
    trial: TrialLog, sources: dict[str, str] | None
) -> None:
    screening = screened(with_source(trial, "yaw_rate", lambda x: -x), sources).screening
    names = [channel.name for channel in screening.stats]
    assert names.count("yaw_rate") == 1
    assert len(screening.all_stats) == len(screening.stats) + 1


def test_a_speed_that_is_not_used_does_not_judge_the_fixes(trial: TrialLog) -> None:
    alone = screened(trial).screening.stats["position"]
    log = with_source(trial, "speed", lambda x: 5.0 * x)
    kept = screened(log, {"speed": "simulated"}).screening.stats["position"]
    fixes = alone.fixes, kept.fixes
    assert repr(fixes[0]) == repr(fixes[1])
    assert repr(screened(log, {"speed": "other"}).screening.stats["position"].fixes) != repr(
        fixes[0]
    )


def test_where_the_log_is_cut_into_chunks_does_not_change_the_choice(trial: TrialLog) -> None:
    log = with_source(trial, "rudder", lambda x: 0.5 * x)

    class Parted(TrialLog):
        def chunks(self):  # type: ignore[no-untyped-def]  # noqa: ANN202
            cuts = [int(c.received_ns[i]) for c in (self.channels[0],) for i in (700, 1500)]
            for start, end in zip([0, *cuts], [*cuts, 2**62], strict=True):
                yield tuple(_between(c, start, end) for c in self.channels)

    parted = Parted(log.name, log.channels, log.metadata)
    assert screened(parted).warnings == screened(log).warnings


def _between(channel: Channel, start: int, end: int) -> Channel:
    return channel.part(*np.searchsorted(channel.received_ns, (start, end)).tolist())


@pytest.mark.usefixtures("fit_alone")
def test_replay_and_identification_choose_alike(trial: TrialLog) -> None:
    log = with_source(trial, "rudder", lambda x: 0.3 * x + np.radians(2.0))
    (of_replay,) = [w for w in analyse(log).findings.warnings if w.startswith("rudder: 2 sources")]
    ship = identify(log, fixed={"T3": 0.5})
    assert any(of_replay in warning for warning in ship.warnings)
    assert ship.parameters["d"] == pytest.approx(identify(trial, fixed={"T3": 0.5}).parameters["d"])

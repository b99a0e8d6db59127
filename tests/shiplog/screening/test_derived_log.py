"""Derived channels: marked, bounded in their claims, and never without being asked for."""

import pickle
from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest
from trial_logs import as_log

from analysis import ReadingOptions, analyse, identify
from analysis.report.replay_json import replay_json
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import LogError, TrialLog, UsageError, load_vessel, read, write
from shiplog.cli.main import main
from shiplog.screening import DerivedLog, plan_derivations, screen_log
from shiplog.tables.convert import convert

NEEDED = ("yaw_rate", "speed", "rudder", "rpm")


@pytest.fixture(scope="module")
def trial() -> tuple[TrialLog, TrialLog]:
    """A zig-zag with a heading of 0.01 deg noise at 5 Hz and no yaw rate, and its truth."""
    vessel, text = load_vessel("table1")
    sensors = dict(suite("paper"))
    sensors["heading"] = replace(sensors["heading"], rate_hz=5.0, white=radians(0.01))
    simulated = simulate(
        vessel, "zigzag-20-20", duration_secs=500.0, seed=3, sensors=sensors, vessel_toml=text
    )
    log = as_log(simulated, "zigzag.mcap")
    channels = tuple(c for c in log if c.name != "yaw_rate")
    return replace(log, channels=channels), simulated.truth(50.0)


def test_a_derived_yaw_rate_is_as_near_to_the_truth_as_stated(
    trial: tuple[TrialLog, TrialLog],
) -> None:
    log, truth = trial
    (derivation,) = plan_derivations(log, ["yaw_rate"])
    assert derivation.rate is not None
    assert derivation.rate.heading_noise == pytest.approx(radians(0.01), rel=0.1)
    derived = next(DerivedLog(log, [derivation]).chunks())[-1]
    assert (derived.topic, derived.unit) == ("/yaw_rate/derived.simulated", "rad/s")
    assert derived.metadata["derived_from"] == "/heading/simulated"
    true = np.interp(derived.measured_ns, truth["yaw_rate"].measured_ns, truth["yaw_rate"].values)
    error = np.abs(derived.values - true) / derivation.rate.noise
    assert len(derived) > 2400
    assert float(np.mean(error <= 3)) > 0.99
    assert float(np.max(error)) < 5
    assert float(np.sqrt(np.mean(error**2))) == pytest.approx(1.0, abs=0.1)


def test_a_missing_yaw_rate_is_reported_with_what_would_derive_it(
    trial: tuple[TrialLog, TrialLog],
) -> None:
    log, _ = trial
    with pytest.raises(LogError, match=r"no channel 'yaw_rate'.*--derive yaw_rate computes it "
                       r"from /heading/simulated, with a noise of 0\.01\d deg/s"):  # fmt: skip
        screen_log(log, NEEDED, purpose="a replay")
    without = replace(log, channels=tuple(c for c in log if c.name != "heading"))
    with pytest.raises(LogError, match=r"needs yaw_rate, speed, rudder, rpm$"):
        screen_log(without, NEEDED, purpose="a replay")
    with pytest.raises(LogError, match="no channel 'heading' to derive 'yaw_rate' from"):
        screen_log(without, NEEDED, purpose="a replay", derive=["yaw_rate"])
    with pytest.raises(UsageError, match="cannot derive 'yawrate'; did you mean 'yaw_rate'"):
        screen_log(log, NEEDED, purpose="a replay", derive=["yawrate"])


def test_a_channel_that_the_log_has_is_not_derived(zigzag_log: TrialLog) -> None:
    assert plan_derivations(zigzag_log, ["yaw_rate", "speed"][:1]) == ()


def test_a_screening_with_derived_channels_can_be_pickled_and_used_again(
    trial: tuple[TrialLog, TrialLog],
) -> None:
    log, _ = trial
    screened = screen_log(log, NEEDED, ("heading",), purpose="a replay", derive=["yaw_rate"])
    copy = pickle.loads(pickle.dumps(screened.screening))  # noqa: S301 - our own
    assert copy.derivations == screened.screening.derivations or len(copy.derivations) == 1
    assert "noise 0.01" in screened.warnings[0]
    assert screened.screening.stats["yaw_rate"].source == "derived.simulated"


def test_a_replay_shows_that_its_yaw_rate_is_derived(trial: tuple[TrialLog, TrialLog]) -> None:
    log, _ = trial
    analysis = analyse(log, ReadingOptions(derive=("yaw_rate",)))
    assert any(w.startswith("yaw_rate: derived from") for w in analysis.findings.warnings)
    derived = replay_json(analysis.findings)["log"]["derived"]
    assert derived["/yaw_rate/derived.simulated"]["derived_from"] == "/heading/simulated"


def test_speed_over_ground_is_taken_for_speed_only_when_asked(
    trial: tuple[TrialLog, TrialLog],
) -> None:
    log, _ = trial
    ground = replace(log["speed"], name="speed_over_ground", source="GP")
    channels = tuple(c for c in log if c.name != "speed")
    log = replace(log, channels=(*channels, ground))
    with pytest.raises(LogError, match=r"--derive speed takes /speed_over_ground/GP for it"):
        screen_log(log, ("speed",), purpose="a replay")
    screened = screen_log(log, ("speed",), purpose="a replay", derive=["speed"])
    assert "the current is in it in full" in screened.warnings[0]
    (chunk,) = screened.chunks()
    (speed,) = (c for c in chunk if c.name == "speed")
    assert speed.source == "derived.GP"
    np.testing.assert_array_equal(speed.values, ground.values)


def test_conversion_adds_a_marked_channel(trial: tuple[TrialLog, TrialLog], tmp_path: Path) -> None:
    log, _ = trial
    write(log, tmp_path / "in.mcap")
    _, warnings = convert(tmp_path / "in.mcap", tmp_path / "out.mcap", derive=["yaw_rate"])
    assert warnings[0].startswith("yaw_rate: derived from")
    derived = read(tmp_path / "out.mcap")["yaw_rate"]
    assert derived.source == "derived.simulated"
    assert derived.metadata["derived_from"] == "/heading/simulated"


def test_the_verbs_derive_on_demand(
    trial: tuple[TrialLog, TrialLog],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    write(trial[0], tmp_path / "in.mcap")
    assert main(["replay", "in.mcap"]) == 1
    assert "--derive yaw_rate computes it" in capsys.readouterr().err
    assert main(["replay", "in.mcap", "--derive", "yaw_rate"]) == 0
    assert "yaw_rate: derived from /heading/simulated" in capsys.readouterr().err


@pytest.mark.usefixtures("fit_alone")
def test_an_identification_derives_on_demand(trial: tuple[TrialLog, TrialLog]) -> None:
    ship = identify([trial[0]], fixed={"T3": 0.5}, options=ReadingOptions(derive=("yaw_rate",)))
    assert any("yaw_rate: derived from" in warning for warning in ship.warnings)

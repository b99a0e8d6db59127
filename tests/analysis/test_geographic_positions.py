"""A trial gives the same figures with local and with geographic positions."""

from functools import cache

import numpy as np
import pytest
from geographic import geographic_log, with_fixes
from trial_logs import as_log

from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.runs import run_from_log
from analysis.identification.validation import Validation, validate
from analysis.replay.replay import analyse
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, load_vessel, read, write
from shiplog.ships import ship_model

VESSEL, TOML = load_vessel("table1")
DATUMS = [(60.0, 20.0), (-17.0, 179.999), (-17.0, -179.999), (0.0, 0.0), (89.99, 30.0)]


@cache
def local_log() -> TrialLog:
    sensors = suite("white")
    trial = simulate(
        VESSEL, "zigzag-20-20", duration_secs=300.0, seed=2, sensors=sensors, vessel_toml=TOML
    )
    return as_log(trial)


@cache
def exact_fit() -> OutputError:
    (segment,) = run_from_log(local_log()).segments
    return output_error([segment], ship_model("burylin"), fixed=VESSEL.coefficients._asdict())


def validated(log: TrialLog) -> Validation:
    (validation,) = validate(exact_fit(), run_from_log(log))
    return validation


@pytest.mark.parametrize("datum", DATUMS)
def test_a_validation_has_the_same_figures(datum: tuple[float, float]) -> None:
    local, globe = validated(local_log()), validated(geographic_log(local_log(), datum))
    assert globe.rms == pytest.approx(local.rms, rel=1e-6)
    assert globe.measured_track == pytest.approx(
        local.measured_track, rel=1e-6, abs=1e-3, nan_ok=True
    )
    assert [i.measured for i in globe.indices] == pytest.approx(
        [i.measured for i in local.indices], rel=1e-6
    )


@pytest.mark.parametrize("datum", DATUMS[:3])
def test_a_replay_has_the_same_track(datum: tuple[float, float], tmp_path: object) -> None:
    local = analyse(local_log())
    write(geographic_log(local_log(), datum), f"{tmp_path}/globe.mcap")
    globe = analyse(read(f"{tmp_path}/globe.mcap"))
    assert globe.findings.track_origin == "recorded positions"
    assert globe.track.time_secs.tolist() == local.track.time_secs.tolist()
    for name in ("north", "east"):
        here, there = getattr(local.track, name), getattr(globe.track, name)
        assert there == pytest.approx(here, rel=1e-6, abs=1e-3)
    assert [text for text in globe.findings.plan.warnings if "position" in text] == []
    states = globe.estimates.states, local.estimates.states
    assert np.array_equal(*states, equal_nan=True)


@pytest.mark.parametrize(
    ("rows", "values", "warning"),
    [
        (slice(0, 40), (0.0, 0.0), "40 fixes at latitude 0, longitude 0"),
        (slice(100, 140), (0.0, 0.0), "40 fixes at latitude 0, longitude 0"),
        (slice(100, 140), (91.0, 181.0), "40 at latitude 91, longitude 181"),
        (slice(0, 1), (61.0, 20.0), "1 fix in 1 stretch that the ship cannot reach"),
        (slice(200, 220), (60.0, 21.0), "20 fixes in 1 stretch that the ship cannot reach"),
    ],
)
def test_unusable_fixes_are_reported_and_change_no_figure(
    rows: slice, values: tuple[float, float], warning: str
) -> None:
    log = geographic_log(local_log())
    run = run_from_log(with_fixes(log, rows, values))
    assert any(warning in text for text in run.warnings)
    unused = run_from_log(with_fixes(log, rows, (np.nan, np.nan)))
    both = ([each.fixes for each in made.segments] for made in (run, unused))
    for one, other in zip(*both, strict=True):
        assert one is not None
        assert np.array_equal(one, other, equal_nan=True)


def test_a_wild_jump_in_a_local_frame_is_reported() -> None:
    run = run_from_log(with_fixes(local_log(), slice(50, 60), (90_000.0, 0.0)))
    assert any("10 fixes in 1 stretch that the ship cannot reach" in text for text in run.warnings)
    positions = run.segments[0].fixes
    assert positions is not None
    assert np.nanmax(np.abs(positions)) < 10_000


def test_a_log_without_any_usable_fix_is_dead_reckoned() -> None:
    log = with_fixes(geographic_log(local_log()), slice(None), (91.0, 181.0))
    assert "dead reckoning" in analyse(log).findings.track_origin
    assert [each.fixes for each in run_from_log(log).segments] == [None]

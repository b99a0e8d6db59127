"""The slow error of the compass in the uncertainty of the indices that depend on the heading."""

from dataclasses import replace
from math import hypot, radians, sqrt

import numpy as np
import pytest
from places import SAMPLE_DATA

import shiplog
from analysis import TrialOptions, analyse_trial
from analysis.manoeuvres.index_uncertainty import COMPASS, GYRO
from analysis.manoeuvres.sailed_manoeuvre import SailedManoeuvre
from analysis.replay.reading_options import ReadingOptions
from shiplog import TrialLog
from shiplog.geodesy import LocalFrame, LocalPositions
from shiplog.vessel.vessel_parser import parse_vessel

OVERSHOOTS = ("overshoot 1", "overshoot 2", "overshoot 3")


@pytest.fixture(scope="module")
def log() -> TrialLog:
    return shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap")


def analysed(log: TrialLog, **options: float) -> SailedManoeuvre:
    (found,) = analyse_trial(log, trial_options=TrialOptions(**options)).manoeuvres  # type: ignore[arg-type]
    return found


def from_log(log: TrialLog, vessel: str = "") -> SailedManoeuvre:
    options = ReadingOptions(vessel=parse_vessel(vessel, "ship.toml") if vessel else None)
    (found,) = analyse_trial(log, options).manoeuvres
    return found


def test_the_vessel_file_states_the_compass_s_error(log: TrialLog) -> None:
    found = from_log(log, "[compass]\nerror_deg = 0.4\n")
    assert sources(found, COMPASS) == pytest.approx([radians(0.4)] * 3)


def test_the_error_grows_with_the_secant_of_the_latitude(log: TrialLog) -> None:
    position = log["position"]
    fixes = LocalFrame((60.0, 20.0), geographic=True).to_geographic(
        LocalPositions(position.values[:, 0], position.values[:, 1])
    )
    moved = replace(
        position,
        unit="deg",
        fields=("latitude", "longitude"),
        values=np.column_stack((fixes.latitude, fixes.longitude)),
    )
    far = replace(log, channels=tuple(moved if c is position else c for c in log.channels))
    assert sources(from_log(far), COMPASS) == pytest.approx([radians(0.5)] * 3, rel=1e-3)


def sources(found: SailedManoeuvre, source: str) -> list[float]:
    indices = [found.index(name) for name in OVERSHOOTS]
    return [index.sources.get(source, 0.0) for index in indices if index is not None]


def test_an_overshoot_is_as_uncertain_as_the_compass_s_change(log: TrialLog) -> None:
    found = analysed(log)
    assert sources(found, COMPASS) == pytest.approx([radians(0.25)] * 3)
    first = found.index("overshoot 1")
    assert first is not None
    assert first.high - first.low > radians(0.97)
    time = found.index("initial turning time")
    assert time is not None
    assert time.sources[COMPASS] > 0.1


def test_another_error_can_be_stated(log: TrialLog) -> None:
    found = analysed(log, compass_change_std=radians(0.5))
    assert sources(found, COMPASS) == pytest.approx([radians(0.5)] * 3)


def test_the_step_in_which_the_heading_is_recorded_counts(log: TrialLog) -> None:
    heading = log["heading"]
    step = radians(1.0)
    rounded = replace(heading, values=step * np.round(heading.values / step) % (2 * np.pi))
    coarse = replace(log, channels=tuple(rounded if c is heading else c for c in log.channels))
    expected = hypot(radians(0.25), step / sqrt(6.0))
    assert sources(analysed(coarse), COMPASS) == pytest.approx([expected] * 3, rel=1e-6)


def test_a_heading_from_the_gyro_has_the_gyro_s_error_instead(log: TrialLog) -> None:
    without = replace(log, channels=tuple(c for c in log.channels if c.name != "heading"))
    found = analysed(without)
    assert sources(found, COMPASS) == [0.0] * 3
    assert min(sources(found, GYRO)) > 0.0

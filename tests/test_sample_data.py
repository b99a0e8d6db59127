"""The foreign table of the sample data: how it is made, and what is found from it.

It is a simulated trial, so the coefficients of the ship are known. An interval of 95 % misses one
of them in twenty; the limits here are those that all nine keep together with 95 % (Šidák).
"""

import runpy
from pathlib import Path

import numpy as np
import pytest
from places import LAYOUTS, SAMPLE_DATA
from scipy.stats import norm

from analysis import ReadingOptions, analyse, identify
from shiplog import TrialLog, load_vessel
from shiplog.tables.convert import convert

TABLE = SAMPLE_DATA / "bridge.csv"
VESSEL = load_vessel("table1")[0]
TRUE = VESSEL.paper_coefficients._asdict()
ESTIMATED = ("a", "b1", "b2", "b3", "d", "e", "f", "g", "h")
MAX_STDS = norm.ppf((1 + 0.95 ** (1 / len(ESTIMATED))) / 2)  # 2.77


@pytest.fixture(scope="module")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> TrialLog:
    target = tmp_path_factory.mktemp("bridge") / "bridge.mcap"
    log, warnings = convert(TABLE, target, LAYOUTS / "bridge.toml", strict=True)
    assert warnings == []
    return log


def test_the_table_is_what_its_script_writes(tmp_path: Path) -> None:
    script = runpy.run_path(str(SAMPLE_DATA / "make.py"))
    script["write_bridge_table"](tmp_path / "bridge.csv")
    assert (tmp_path / "bridge.csv").read_text() == TABLE.read_text()


def test_every_column_of_the_table_is_converted(bridge: TrialLog) -> None:
    names = {channel.name for channel in bridge}
    assert names == {"heading", "yaw_rate", "speed", "rudder", "rpm", "position"}
    for channel in bridge:
        assert len(channel) == 1201
        assert np.isfinite(channel.values[:, :2] if channel.fields else channel.values).all()
    assert np.degrees(np.abs(bridge["rudder"].values).max()) == pytest.approx(20.0, abs=0.1)


def test_a_replay_of_the_table_finds_the_simulated_ship(bridge: TrialLog) -> None:
    findings = analyse(bridge, ReadingOptions(vessel=VESSEL)).findings
    assert findings.warnings == ()
    assert findings.track_origin == "recorded positions"
    found = {**findings.yaw.coefficients, **findings.surge.coefficients}
    errors = {name: (found[name].value - TRUE[name]) / found[name].std for name in ESTIMATED}
    assert max(map(abs, errors.values())) < MAX_STDS, errors
    assert all(found[name].determined for name in ESTIMATED)


@pytest.mark.usefixtures("fit_alone")
def test_an_identification_of_the_table_finds_the_simulated_ship(bridge: TrialLog) -> None:
    result = identify(bridge, options=ReadingOptions(vessel=VESSEL)).uncertainty
    assert result.names == ESTIMATED
    assert result.unidentifiable == ()
    true = np.array([TRUE[name] for name in ESTIMATED])
    errors = (result.values - true) / result.std
    assert np.abs(errors).max() < MAX_STDS, dict(zip(ESTIMATED, errors, strict=True))
    assert (np.abs(result.std / true) < 0.15).all()  # the intervals are not wide for that

"""Wrong units and signs are found and assigned to one channel; right logs give no finding."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from trial_logs import InChunks, as_log

from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, Vessel
from shiplog.checks.consistency.consistency_check import consistency_findings
from shiplog.checks.consistency.findings import Finding, refuse_contradictions
from shiplog.errors import LogError
from shiplog.geodesy import LocalFrame, LocalPositions

DEG = np.pi / 180
Values = np.ndarray


@pytest.fixture(scope="module")
def trial(vessel: Vessel) -> TrialLog:
    """A zigzag with heading and fixes."""
    return simulated(vessel, "zigzag-20-20", 0)


def simulated(vessel: Vessel, manoeuvre: str, seed: int) -> TrialLog:
    sensors = suite("paper", {"heading.white": 0.2 * DEG, "position.white": 1.0})
    return as_log(simulate(vessel, manoeuvre, duration_secs=500.0, seed=seed, sensors=sensors))


def changed(log: TrialLog, **functions: Callable[[Values], Values]) -> TrialLog:
    """Return the log with the values of some channels changed."""
    channels = [
        replace(c, values=functions[c.name](c.values)) if c.name in functions else c for c in log
    ]
    return replace(log, channels=tuple(channels))


def scaled(factor: float) -> Callable[[Values], Values]:
    return lambda values: factor * values


def contradictions(log: TrialLog) -> list[Finding]:
    return [f for f in consistency_findings(log) if f.kind != "bias"]


def test_channels_that_agree_give_no_finding(trial: TrialLog) -> None:
    assert contradictions(trial) == []


@pytest.mark.parametrize("manoeuvre", ["zigzag-10-10", "zigzag-20-20", "turning-circle-35"])
@pytest.mark.parametrize("seed", range(4))
def test_simulated_trials_give_no_finding(vessel: Vessel, manoeuvre: str, seed: int) -> None:
    assert contradictions(simulated(vessel, manoeuvre, seed)) == []


WRONG_UNITS = [
    ("yaw_rate", 1 / DEG, "deg/s read as rad/s"),
    ("yaw_rate", 60.0, "deg/min read as deg/s"),
    ("yaw_rate", DEG, "rad/s read as deg/s"),
    ("yaw_rate", 1 / 60, "deg/s read as deg/min"),
    ("speed", 3600 / 1852, "kn read as m/s"),
    ("speed", 3.6, "km/h read as m/s"),
    ("speed", 1852 / 3600, "m/s read as kn"),
    ("rudder", DEG, "rad read as deg"),
    ("rudder", 1 / DEG, "deg read as rad"),
    ("rudder", 10.0, "deg"),
    ("rpm", 1 / 60, "rev/s read as rpm"),
    ("position", 1 / 0.3048, "ft read as m"),
]


@pytest.mark.parametrize(("name", "factor", "cause"), WRONG_UNITS)
def test_a_wrong_unit_is_named(trial: TrialLog, name: str, factor: float, cause: str) -> None:
    findings = contradictions(changed(trial, **{name: scaled(factor)}))
    assert any(f.kind == "unit" and cause in f.text for f in findings), findings
    assert all("\n" not in f.text for f in findings)


@pytest.mark.parametrize(
    "names", [("yaw_rate",), ("heading",), ("rudder",), ("yaw_rate", "rudder")]
)
def test_reversed_signs_are_assigned_to_their_channels(
    trial: TrialLog, names: tuple[str, ...]
) -> None:
    findings = contradictions(changed(trial, **{name: scaled(-1.0) for name in names}))
    signs = {f.text.split("/")[1] for f in findings if f.kind == "sign"}
    assert signs == set(names), findings


def test_swapped_north_and_east_are_found(trial: TrialLog) -> None:
    findings = contradictions(changed(trial, position=lambda values: values[:, ::-1]))
    assert any(f.text.startswith("/position") and "swapped" in f.text for f in findings), findings


def test_a_heading_from_east_is_found(trial: TrialLog) -> None:
    findings = contradictions(changed(trial, heading=lambda values: values - np.pi / 2))
    assert [f.kind for f in findings] == ["sign"]
    assert "from east" in findings[0].text
    with pytest.raises(LogError, match="from east"):
        refuse_contradictions(findings)


@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "pseudo-random", "turning-circle"])
def test_a_rudder_in_the_column_of_the_yaw_rate_is_found(vessel: Vessel, manoeuvre: str) -> None:
    log = simulated(vessel, manoeuvre, 0)
    rudder = log["rudder"].values / 60
    (finding,) = [
        f for f in contradictions(changed(log, yaw_rate=lambda _: rudder)) if f.kind == "column"
    ]
    assert "/yaw_rate/simulated: does not turn as /heading/simulated does" in finding.text


def test_a_wrong_unit_of_the_yaw_rate_does_not_hide_a_heading_from_east(trial: TrialLog) -> None:
    log = changed(trial, yaw_rate=scaled(60.0), heading=lambda values: values - np.pi / 2)
    findings = {(f.kind, f.channel) for f in contradictions(log)}
    assert findings == {("unit", "yaw_rate"), ("sign", "heading")}


def test_fixes_without_a_position_are_no_wrong_unit(trial: TrialLog) -> None:
    def interrupted(latitude: float) -> list[Finding]:
        log = changed(geographic(trial), position=lambda x: np.where(
            np.arange(len(x))[:, None] % 3 == 0, (latitude, 181.0, 0.0), x))  # fmt: skip
        return contradictions(log)

    assert interrupted(91.0) == []
    (finding,) = interrupted(91.5)
    assert (finding.kind, finding.channel) == ("unit", "position")
    assert "latitude 91.5, longitude 181" in finding.text


def test_a_position_that_never_moves_gives_no_finding_of_the_heading(trial: TrialLog) -> None:
    stuck = changed(trial, position=lambda x: np.tile(x[:1], (len(x), 1)))
    assert not [f for f in consistency_findings(stuck) if f.channel == "heading"]


def test_a_repeated_sentinel_is_no_wrong_unit(trial: TrialLog) -> None:
    def with_sentinel(values: Values) -> Values:
        return np.where(np.arange(len(values)) % 4, values, np.radians(3600.0))

    assert not contradictions(changed(trial, heading=with_sentinel))


def test_a_mathematical_heading_is_found(trial: TrialLog) -> None:
    findings = contradictions(changed(trial, heading=lambda values: np.pi / 2 - values))
    assert any(f.kind == "sign" and f.text.startswith("/heading") for f in findings), findings


@pytest.mark.parametrize(("unit", "factor"), [("rad", DEG), ("grad", 400 / 360)])
def test_the_unit_of_a_heading_is_found(trial: TrialLog, unit: str, factor: float) -> None:
    log = changed(trial, heading=lambda values: (values % (2 * np.pi)) * factor)
    findings = contradictions(log)
    assert any(f"{unit} read as deg" in f.text for f in findings), findings


def test_two_faults_at_once_are_both_found(trial: TrialLog) -> None:
    log = changed(trial, yaw_rate=scaled(-60.0), speed=scaled(3600 / 1852))
    text = "\n".join(f.text for f in contradictions(log))
    assert "deg/min read as deg/s" in text
    assert "/yaw_rate" in text
    assert "sign" in text
    assert "kn read as m/s" in text


def test_a_late_heading_is_reported(trial: TrialLog) -> None:
    late = [
        replace(c, measured_ns=c.measured_ns + 2 * 10**9) if c.name == "heading" else c
        for c in trial
    ]
    findings = contradictions(replace(trial, channels=tuple(late)))
    lag = [f for f in findings if f.kind == "lag"]
    assert len(lag) == 1
    assert "/heading" in lag[0].text
    assert float(lag[0].text.split(" by ")[1].split()[0]) == pytest.approx(2.0, abs=0.3)


def test_no_advice_about_the_rudder_from_going_astern(trial: TrialLog) -> None:
    log = changed(trial, rudder=scaled(-1.0), speed=scaled(-1.0), rpm=scaled(-1.0))
    without_fixes = replace(log, channels=tuple(c for c in log if c.name != "position"))
    assert not any("/rudder" in f.text for f in contradictions(without_fixes))


def test_strict_refuses_signs_and_units_only(trial: TrialLog) -> None:
    refuse_contradictions([Finding(kind, "heading", kind) for kind in ("bias", "lag", "zero")])
    with pytest.raises(LogError, match="sign is reversed"):
        refuse_contradictions(consistency_findings(changed(trial, rudder=scaled(-1.0))))


def geographic(log: TrialLog) -> TrialLog:
    """Return the log with positions in latitude, longitude and altitude."""
    frame = LocalFrame((60.2, 20.4), geographic=True)
    (position,) = (c for c in log if c.name == "position")
    fixes = frame.to_geographic(LocalPositions(*position.values.T))
    values = np.column_stack((fixes.latitude, fixes.longitude, np.zeros(len(position))))
    fields = ("latitude", "longitude", "altitude")
    converted = replace(position, fields=fields, values=values)
    return replace(log, channels=tuple(converted if c is position else c for c in log))


def printed_as(function: Callable[[Values], Values]) -> Callable[[Values], Values]:
    return lambda values: np.column_stack((function(values[:, :2]), values[:, 2]))


@pytest.mark.parametrize(
    ("function", "cause"),
    [
        (lambda x: x * DEG, "in rad read as deg"),
        (lambda x: x // 1 * 100 + x % 1 * 60, "ddmm.mmmm read as degrees"),
        (lambda x: x // 1 + x % 1 * 0.6, "printed as dd.mmmm"),
        (lambda x: x[:, ::-1], "latitude and longitude, are swapped"),
    ],
)
def test_misread_latitudes_and_longitudes_are_named(
    trial: TrialLog, function: Callable[[Values], Values], cause: str
) -> None:
    log = geographic(trial)
    assert contradictions(log) == []
    findings = contradictions(changed(log, position=printed_as(function)))
    assert any(cause in f.text for f in findings), findings


@pytest.mark.parametrize("factor", [100.0, 0.01, 1 / 0.3048, 0.3048, 3.6, 1 / 3.6])
def test_a_wrong_unit_of_the_speed_is_found_in_both_directions(
    trial: TrialLog, factor: float
) -> None:
    findings = contradictions(changed(trial, speed=scaled(factor)))
    assert next(f.text.split("/")[1] for f in findings if f.kind == "unit") == "speed"


@pytest.mark.parametrize("current", [0.0, 1.5])
@pytest.mark.parametrize("offset_deg", [-12.0, 0.0, 3.0, 8.0])
def test_an_offset_of_the_heading_is_separated_from_a_current(
    trial: TrialLog, offset_deg: float, current: float
) -> None:
    secs = np.linspace(0.0, 500.0, sum(len(c) for c in trial if c.name == "position"))
    drift = current * np.column_stack((secs, -0.5 * secs))
    log = changed(
        trial, heading=lambda x: x + offset_deg * DEG, position=lambda values: values + drift
    )
    findings = contradictions(log)
    if abs(offset_deg) < 5:
        assert findings == []
    else:
        (finding,) = findings
        assert finding.kind == "zero"
        added = float(finding.text.split("differs from it by ")[1].split()[0])
        assert added == pytest.approx(-offset_deg, abs=1.0)


@pytest.mark.parametrize("secs", [8, -8])
def test_a_lag_of_the_speed_against_the_fixes_is_reported(trial: TrialLog, secs: int) -> None:
    shifted = [
        replace(c, measured_ns=c.measured_ns + secs * 10**9) if c.name == "speed" else c
        for c in trial
    ]
    (finding,) = contradictions(replace(trial, channels=tuple(shifted)))
    assert finding.kind == "lag"
    assert finding.text.startswith("/speed" if secs > 0 else "/position")


def test_where_chunks_are_cut_changes_no_finding(trial: TrialLog) -> None:
    log = changed(geographic(trial), heading=lambda x: x + 0.2, speed=scaled(3.6))
    assert consistency_findings(InChunks(log, [33.3, 34.0, 250.7])) == consistency_findings(log)


def test_a_log_of_half_a_minute_gives_no_finding(trial: TrialLog) -> None:
    assert contradictions(trial.between(200.0, 230.0)) == []

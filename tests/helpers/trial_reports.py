"""Reports of trials made by hand: a circle and zig-zags of a ship that turns as it is ordered."""

from dataclasses import replace
from math import radians

import numpy as np

from analysis.manoeuvres.sailed_manoeuvre import (
    ManoeuvreKind,
    ManoeuvreMark,
    ManoeuvreSeries,
    NotComputed,
    SailedManoeuvre,
)
from analysis.manoeuvres.trial_index import Criterion, TrialIndex
from analysis.report.page.trial_report import LogDigest, ReportedLog, TrialReport
from analysis.trial.trial_analysis import CriterionFinding, TrialAnalysis, TrialConditions
from shiplog.checks.log_stats import compute_log_stats
from shiplog.types import Channel, TrialLog

LENGTH = 200.0  # m
START_NS = 1_700_000_000_000_000_000
PARAGRAPH = "IMO MSC.137(76), 5.3.1"
ADVANCE_LIMIT = Criterion("advance", 4.5 * LENGTH, "4.5 L", PARAGRAPH)
ADVANCE = TrialIndex(
    "advance", "Ad", 612.3, "m", 8.0, 596.6, 628.0,
    {"sensor noise": 3.0, "start rule": 7.4}, {"rudder moved by 0.5°": 601.0},
    3.0615, ADVANCE_LIMIT, 1.0, "along the approach heading",
)  # fmt: skip
DIAMETER = TrialIndex("tactical diameter", "Dt", 700.0, "m", 9.0, 682.4, 717.6, in_lengths=3.5)
OVERSHOOT = TrialIndex(
    "overshoot 1", "", radians(10.5), "rad", radians(0.5), radians(9.5), radians(11.5),
    criterion=Criterion("first overshoot", radians(11.0), "11.0°", "IMO MSC.137(76), 5.3.3"),
    probability=0.84,
)  # fmt: skip


def circle(side: str = "starboard") -> SailedManoeuvre:
    """Return a turning circle at a constant rate of turn, mirrored for port."""
    sign = -1.0 if side == "port" else 1.0
    at = np.arange(-60.0, 500.0)
    heading = sign * radians(0.8) * np.maximum(at, 0.0)
    steps = 8.0 * np.column_stack((np.cos(heading), np.sin(heading)))
    track = np.cumsum(steps, axis=0)
    series = ManoeuvreSeries(
        at,
        rudder=sign * radians(35.0) * (at > 0),
        heading_change=heading,
        yaw_rate=np.gradient(heading),
        speed=8.0 - 3.0 * np.clip(at / 300.0, 0.0, 1.0),
        rpm=np.full(len(at), 80.0),
        track=track - track[60],
    )
    return _manoeuvre(
        ManoeuvreKind.TURNING_CIRCLE, f"turning circle 35° to {side}", side, 35.0, series,
        indices=(ADVANCE, DIAMETER), marks=(ManoeuvreMark("90°", 112.5),),
    )  # fmt: skip


def zigzag() -> SailedManoeuvre:
    """Return a zig-zag 10°/10° whose heading is a sine."""
    at = np.arange(-30.0, 400.0)
    phase = 2 * np.pi * np.maximum(at, 0.0) / 200.0
    heading = radians(18.0) * np.sin(phase)
    series = ManoeuvreSeries(
        at, rudder=radians(10.0) * np.sign(np.cos(phase)) * (at > 0), heading_change=heading
    )
    title = "zig-zag 10°/10°, first to starboard"
    return _manoeuvre(
        ManoeuvreKind.ZIGZAG, title, "starboard", 10.0, series, indices=(OVERSHOOT,),
        switch_heading=radians(10.0),
        not_computed=tuple(
            NotComputed(subject, "the log has no positions")
            for subject in ("initial turning distance", "track")
        ),
    )  # fmt: skip


def _manoeuvre(
    kind: ManoeuvreKind,
    title: str,
    side: str,
    rudder_deg: float,
    series: ManoeuvreSeries,
    **further: object,
) -> SailedManoeuvre:
    sign = -1.0 if side == "port" else 1.0
    fields = {"switch_heading": np.nan, **further}
    return SailedManoeuvre(
        number=1, kind=kind, title=title, start_secs=0.0, execute_secs=60.0, end_secs=500.0,
        side=side, rudder=sign * radians(rudder_deg), start_rule="at the rudder order",
        approach_heading=0.1, approach_speed=8.0, approach_rpm=80.0, approach_yaw_rate=0.0,
        neutral_rudder=0.01, series=series, notes=("the speed is that of the log",), **fields,
    )  # type: ignore[arg-type]  # fmt: skip


def reported_log(*manoeuvres: SailedManoeuvre, name: str = "trial.mcap") -> ReportedLog:
    """Return a log with manoeuvres, without a replay."""
    stamps = START_NS + 1_000_000_000 * np.arange(4)
    channel = Channel("rudder", "feedback", "rad", stamps, stamps, np.zeros(4))
    log = TrialLog(name, (channel,))
    numbered = tuple(replace(each, number=i) for i, each in enumerate(manoeuvres, start=1))
    tested = next((each for each in numbered if each.index("advance")), None)
    advance = CriterionFinding("advance", "4.5 L", PARAGRAPH, reason="no turning circle was sailed")
    if tested is not None:
        advance = replace(
            advance, manoeuvre=tested.number, index=ADVANCE, side=tested.side, reason=""
        )
    reach = CriterionFinding(
        "track reach", "15 L", "IMO MSC.137(76), 5.3.4", reason="no stopping test was sailed"
    )
    conditions = TrialConditions(
        "MV Example", LENGTH, 8.0, "mean of the approaches",
        {"loading": "ballast", "draught_forward": "7.9 m", "draught_aft": "8.5 m"},
    )  # fmt: skip
    trial = TrialAnalysis(
        name, START_NS, 600.0, conditions, "at the rudder order", numbered, (advance, reach)
    )
    digest = LogDigest(name, 1234, "ab" * 32)
    error = f"no channel 'yaw_rate' in {name}; it has rudder"
    return ReportedLog(trial, compute_log_stats(log), (), False, (digest,), None, error)


def trial_report(*logs: ReportedLog) -> TrialReport:
    """Return a report of logs; by default of a circle to each side and a zig-zag."""
    logs = logs or (reported_log(circle(), circle("port"), zigzag()),)
    return TrialReport(logs, "1.2.3", command="shiplog report trial.mcap -o report.html")

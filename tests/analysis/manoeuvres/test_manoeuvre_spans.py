"""Spans of manoeuvres against the analysis of the whole trial, and against what was sailed."""

import numpy as np
import pytest
from places import SAMPLE_DATA

import shiplog
from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan, manoeuvre_spans
from analysis.manoeuvres.trial_signals import TrialSignals
from analysis.replay.reading_options import DEFAULT_OPTIONS
from analysis.trial.analyse_trial import analyse_trial
from analysis.trial.trial_record import read_trial
from shiplog.progress import no_progress


def trial_signals(name: str) -> TrialSignals:
    log = shiplog.read(SAMPLE_DATA / f"{name}.mcap")
    return read_trial(log, DEFAULT_OPTIONS, no_progress).signals


def spans(name: str) -> tuple[ManoeuvreSpan, ...]:
    return manoeuvre_spans(trial_signals(name))


@pytest.mark.parametrize("name", ["turning_circle_35", "zigzag_20_20"])
def test_spans_are_those_of_the_analysis_of_the_trial(name: str) -> None:
    (span,) = spans(name)
    (sailed,) = analyse_trial(shiplog.read(SAMPLE_DATA / f"{name}.mcap")).manoeuvres
    assert (span.title, span.kind, span.number) == (sailed.title, sailed.kind, sailed.number)
    for attribute in ("start_secs", "execute_secs", "end_secs"):
        assert getattr(span, attribute) == pytest.approx(getattr(sailed, attribute), abs=1e-6)
    assert [mark.label for mark in span.marks] == [mark.label for mark in sailed.marks]
    for mark, other in zip(span.marks, sailed.marks, strict=True):
        # an extreme of the heading is flat, and the analysis smooths the heading
        tolerance = 2.0 if "overshoot" in mark.label else 0.5
        assert mark.time_secs == pytest.approx(other.time_secs, abs=tolerance)


def test_the_ship_has_turned_by_the_angle_of_a_mark() -> None:
    signals = trial_signals("turning_circle_35")
    (span,) = manoeuvre_spans(signals)
    at = np.arange(len(signals)) * signals.dt_secs
    for mark in span.marks[1:]:
        heading = np.interp(span.execute_secs + mark.time_secs, at, signals.heading)
        turned = np.degrees(heading - span.approach_heading)
        assert turned == pytest.approx(float(mark.label.removesuffix("°")), abs=0.1)


def test_a_log_of_random_rudder_or_of_a_straight_course_has_no_manoeuvre() -> None:
    assert spans("pseudo_random") == ()
    signals = trial_signals("zigzag_20_20").part(0, 90)  # before the execute
    assert manoeuvre_spans(signals) == ()


def test_the_marks_of_a_long_manoeuvre_are_as_exact_as_its_signals(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    signals = trial_signals("zigzag_20_20")
    (whole,) = manoeuvre_spans(signals)
    monkeypatch.setattr("analysis.manoeuvres.manoeuvre_part.MAX_PART_SAMPLES", 60)
    (thinned,) = manoeuvre_spans(signals)
    assert len(thinned.marks) == len(whole.marks)
    for mark, exact in zip(thinned.marks, whole.marks, strict=True):
        assert mark.time_secs == pytest.approx(exact.time_secs, abs=1e-6)

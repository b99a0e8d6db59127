import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faults import FAULTS
from windy_trials import WINDY, windy_analysis, windy_log

from analysis.check.compare import (
    Comparison,
    compare,
    comparison_json,
    logs_in,
    reference_path,
    update_reference,
)
from analysis.check.reference import make_reference
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from recorders.record import record
from recorders.simulated.simulate import SimulatedTrial
from shiplog import ShiplogError, TrialLog, Vessel, read, write
from shiplog.vessel.vessel import with_settings


@pytest.fixture(scope="module")
def reference(zigzag_analysis: Analysis) -> TrialLog:
    return make_reference(zigzag_analysis)


def test_an_unchanged_replay_passes_the_check(zigzag_log: TrialLog, reference: TrialLog) -> None:
    found = compare(zigzag_log, reference)
    assert found.ok, str(found)
    assert len(found.differences) > 40


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_fails_the_check_and_its_channel_comes_first(
    zigzag_log: TrialLog, reference: TrialLog, fault: str
) -> None:
    change, topic = FAULTS[fault]
    found = compare(change(zigzag_log), reference)
    assert not found.ok
    assert found.changed[0].topic == topic, str(found)
    assert topic in str(found)


@pytest.mark.parametrize("fault", FAULTS)
def test_channels_without_the_fault_still_agree(
    zigzag_log: TrialLog, reference: TrialLog, fault: str
) -> None:
    change, topic = FAULTS[fault]
    found = compare(change(zigzag_log), reference)
    measured = {d.topic: d.ok for d in found.differences if d.topic.endswith("/measured")}
    assert not measured.pop(topic)
    assert all(measured.values()), str(found)


@pytest.mark.parametrize(
    "name", ["a", "b1", "b2", "b3", "d", "e", "f", "g", "h", "alpha1", "alpha2", "alpha3"]
)
def test_a_millionth_of_one_coefficient_fails_the_check(
    zigzag_log: TrialLog, reference: TrialLog, vessel: Vessel, name: str
) -> None:
    value = getattr(vessel.coefficients, name) * (1 + 1e-6)
    changed = replace(vessel, coefficients=vessel.coefficients._replace(**{name: value}))
    found = compare(zigzag_log, reference, vessel=changed)
    assert found.changed[0].topic == f"/{name}/model"
    assert {"/yaw_rate/estimate", "/speed/estimate"} & {d.topic for d in found.changed}


@pytest.mark.parametrize("name", ["a", "b1", "b2", "b3", "d", "e", "f", "g", "h"])
def test_a_millionth_of_one_estimated_coefficient_fails_the_check(
    zigzag_analysis: Analysis, reference: TrialLog, name: str
) -> None:
    equation = "yaw" if name in zigzag_analysis.findings.yaw.coefficients else "surge"
    found = getattr(zigzag_analysis.findings, equation)
    was = found.coefficients[name]
    coefficients = found.coefficients | {name: replace(was, value=was.value * (1 + 1e-6))}
    moved = make_reference(
        with_findings(zigzag_analysis, **{equation: replace(found, coefficients=coefficients)})
    )
    changed = [c.topic for c in moved if not _same(c.values, reference, c.topic)]
    assert changed == [f"/{name}/trial"]


def with_findings(analysis: Analysis, **changed: object) -> Analysis:
    return replace(analysis, findings=replace(analysis.findings, **changed))


def _same(values: np.ndarray, reference: TrialLog, topic: str) -> bool:
    known = reference[topic]
    distance = np.abs(values - known.values)
    return bool(np.all((distance <= float(known.metadata["tolerance"])) | np.isnan(distance)))


def test_rounding_in_the_last_place_of_every_sample_passes_the_check(
    zigzag_log: TrialLog, reference: TrialLog
) -> None:
    ulp = float(np.finfo(float).eps)
    nudged = tuple(replace(c, values=c.values * (1 + ulp)) for c in zigzag_log)
    found = compare(replace(zigzag_log, channels=nudged), reference)
    assert found.ok, str(found)


def test_two_samples_that_change_places_are_detected_in_their_channel(
    zigzag_log: TrialLog, reference: TrialLog
) -> None:
    swapped = []
    for c in zigzag_log:
        values = c.values.copy()
        if c.name == "yaw_rate":
            values[[1003, 1005]] = values[[1005, 1003]]
        swapped.append(replace(c, values=values))
    found = compare(replace(zigzag_log, channels=tuple(swapped)), reference)
    assert found.changed[0].topic == "/yaw_rate/weighted"


def test_every_number_of_the_results_is_compared(
    zigzag_analysis: Analysis, reference: TrialLog
) -> None:
    """Change one result after another, as a wrong edit of an estimator would."""
    a, findings = zigzag_analysis, zigzag_analysis.findings
    found, residuals, yaw = a.disturbance, findings.residuals[1], findings.yaw
    b1, noise, yaw_summary = (
        yaw.coefficients["b1"],
        findings.plan.noise,
        findings.disturbances["yaw"],
    )
    changes = {
        "/yaw_rate_measurement_std/noise_model": with_findings(
            a,
            plan=replace(
                findings.plan,
                noise=replace(noise, measurement_std=noise.measurement_std * [1.01, 1]),
            ),
        ),
        "/speed_rms/residual_test": with_findings(
            a, residuals=(findings.residuals[0], replace(residuals, rms=residuals.rms * 1.0001))
        ),
        "/speed_whiteness/residual_test": with_findings(
            a, residuals=(findings.residuals[0], replace(residuals, whiteness_p=0.5))
        ),
        "/rudder_disturbance/estimate": replace(
            a, disturbance=replace(found, rudder=found.rudder * 2)
        ),
        "/yaw_disturbance/std": with_findings(
            a, disturbances=findings.disturbances | {"yaw": replace(yaw_summary, noise_std=0.0)}
        ),
        "/b1/trial_std": with_findings(
            a,
            yaw=replace(yaw, coefficients=yaw.coefficients | {"b1": replace(b1, std=1.1 * b1.std)}),
        ),
        "/a/history_std": replace(
            a, yaw_history=replace(a.yaw_history, stds=a.yaw_history.stds * 1.01)
        ),
        "/east/track": replace(a, track=replace(a.track, east=-a.track.east)),
    }
    for topic, changed in changes.items():
        channels = make_reference(changed)
        differing = [c.topic for c in channels if not _same(c.values, reference, c.topic)]
        assert differing[0] == topic


def test_the_first_time_and_the_size_of_a_difference_are_reported(
    zigzag_log: TrialLog, reference: TrialLog
) -> None:
    change, _ = FAULTS["spike of the gyro"]
    first = compare(change(zigzag_log), reference).changed[0]
    assert first.first_secs == pytest.approx(150.0, abs=4.0)
    assert first.largest == pytest.approx(np.radians(0.01) / 40, rel=1e-6)  # a mean of 40 samples
    assert first.unit == "rad/s"


def test_a_missing_or_new_channel_fails_the_check(
    zigzag_log: TrialLog, reference: TrialLog
) -> None:
    less = replace(reference, channels=reference.channels[1:])
    assert "new: not in the reference" in str(compare(zigzag_log, less))
    extra = replace(reference.channels[0], name="heave")
    more = replace(reference, channels=(*reference.channels, extra))
    assert "missing: only in the reference" in str(compare(zigzag_log, more))


def test_a_shorter_log_fails_the_check(zigzag: SimulatedTrial, reference: TrialLog) -> None:
    half = tuple(
        replace(
            c,
            measured_ns=c.measured_ns[: len(c) // 2],
            received_ns=c.received_ns[: len(c) // 2],
            values=c.values[: len(c) // 2],
        )
        for c in zigzag.channels
    )
    assert "other times" in str(compare(TrialLog("x", half, {}, zigzag.vessel_toml), reference))


def test_tolerances_are_in_the_channels_own_unit(reference: TrialLog) -> None:
    tolerances = {c.topic: float(c.metadata["tolerance"]) for c in reference}
    assert tolerances["/speed/estimate"] == pytest.approx(1e-9 * 10.3, rel=0.1)
    assert tolerances["/yaw_rate/estimate"] == pytest.approx(1e-9 * np.radians(0.6), rel=0.3)


def test_a_reference_is_a_log_and_survives_its_file(reference: TrialLog, tmp_path: Path) -> None:
    write(reference, tmp_path / "a.ref.mcap")
    again = read(tmp_path / "a.ref.mcap")
    for written, kept in zip(reference, again, strict=True):
        assert written.topic == kept.topic
        assert written.metadata["tolerance"] == kept.metadata["tolerance"]
        assert np.array_equal(written.values, kept.values, equal_nan=True)


def test_a_missing_reference_fails_with_the_remedy(zigzag: SimulatedTrial, tmp_path: Path) -> None:
    record(zigzag, tmp_path / "z.mcap")
    found = compare(tmp_path / "z.mcap")
    assert not found.ok
    assert "no reference" in str(found)
    assert "--update" in str(found)
    update_reference(tmp_path / "z.mcap", found)
    assert compare(tmp_path / "z.mcap").ok


def test_a_log_is_refused_as_a_reference(zigzag: SimulatedTrial, zigzag_log: TrialLog) -> None:
    assert "not a reference" in str(compare(zigzag_log, zigzag.truth()))


def test_a_log_with_lost_data_fails_the_check(zigzag_log: TrialLog, reference: TrialLog) -> None:
    damaged = replace(zigzag_log, data_lost=True, warnings=("a chunk was damaged",))
    found = compare(damaged, reference)
    assert not found.ok
    assert "a chunk was damaged" in str(found)
    with pytest.raises(ShiplogError, match="no results to keep"):
        update_reference(Path("z.mcap"), found)


def test_a_new_warning_and_a_moved_position_fail_the_check(
    zigzag_log: TrialLog, reference: TrialLog
) -> None:
    position = zigzag_log["position"]
    values = position.values.copy()
    values[301, 0] += 60.0
    moved = tuple(replace(c, values=values) if c.name == "position" else c for c in zigzag_log)
    found = compare(replace(zigzag_log, channels=moved), reference)
    assert [d.topic for d in found.changed] == ["/north/track"]
    warned = compare(replace(zigzag_log, warnings=("something new",)), reference)
    assert [d.topic for d in warned.changed] == ["/warnings/count"]


def test_a_log_that_cannot_be_replayed_fails_with_its_error(tmp_path: Path) -> None:
    (tmp_path / "z.mcap").write_bytes(b"")
    (tmp_path / "z.ref.mcap").write_bytes(b"")
    assert "the file is empty" in str(compare(tmp_path / "z.mcap"))


def test_the_logs_of_a_folder_exclude_references_and_truths(tmp_path: Path) -> None:
    for name in ("b.mcap", "a.mcap", "a.ref.mcap", "a.truth.mcap", "notes.txt"):
        (tmp_path / name).touch()
    assert [p.name for p in logs_in(tmp_path)] == ["a.mcap", "b.mcap"]
    assert reference_path(tmp_path / "a.mcap") == tmp_path / "a.ref.mcap"


def test_a_reference_without_its_log_is_an_error(tmp_path: Path) -> None:
    for name in ("a.mcap", "a.ref.mcap", "b.ref.mcap"):
        (tmp_path / name).touch()
    with pytest.raises(ShiplogError, match=r"references without their logs \(b\.ref\.mcap\)"):
        logs_in(tmp_path)


def test_a_folder_without_logs_is_an_error_not_a_success(tmp_path: Path) -> None:
    with pytest.raises(ShiplogError, match="no logs"):
        logs_in(tmp_path)


def test_the_comparison_as_json_names_the_channel(
    zigzag_log: TrialLog, reference: TrialLog
) -> None:
    change, topic = FAULTS["dropout of the gyro"]
    result = json.loads(
        json.dumps(comparison_json(compare(change(zigzag_log), reference)), allow_nan=False)
    )
    assert result["ok"] is False
    assert next(c["topic"] for c in result["channels"] if not c["ok"]) == topic
    assert comparison_json(Comparison("x", (), "lost"))["error"] == "lost"


def test_analyses_of_the_same_log_are_the_same_to_the_last_bit(
    zigzag_log: TrialLog, reference: TrialLog
) -> None:
    again = make_reference(analyse(zigzag_log))
    for one, other in zip(reference, again, strict=True):
        assert np.array_equal(one.values, other.values, equal_nan=True)


def test_sensor_errors_are_part_of_the_reference_where_they_are_estimated(
    sensor_analysis: Analysis, reference: TrialLog
) -> None:
    known = make_reference(sensor_analysis)
    topics = [channel.topic for channel in known]
    assert len(set(topics)) == len(topics)
    assert {
        "/gyro_error/estimate", "/gyro_error/std", "/log_error/estimate", "/heading/innovation",
        "/north_nis/residual_test", "/current_north/estimate", "/drift_length/std",
        "/compass_measurement_std/noise_model", "/yaw_moment_frequency/noise_model",
        "/gyro_determined/count",
    } <= set(topics)  # fmt: skip
    assert known["gyro_error/estimate"].unit == "rad/s"
    assert not any(
        "gyro" in channel.topic or "heading/inn" in channel.topic for channel in reference
    )


def test_a_change_of_a_sensor_error_fails_the_check(sensor_analysis: Analysis) -> None:
    known = make_reference(sensor_analysis)
    further = sensor_analysis.estimates.further
    assert further is not None
    values = further.values.copy()
    values[:, further.names.index("gyro")] *= 1 + 1e-6
    moved = replace(sensor_analysis.estimates, further=replace(further, values=values))
    changed = [
        c.topic
        for c in make_reference(replace(sensor_analysis, estimates=moved))
        if not _same(c.values, known, c.topic)
    ]
    assert changed == ["/gyro_error/estimate"]


def test_the_wind_is_part_of_the_check(vessel: Vessel) -> None:
    reference, windy = make_reference(windy_analysis()), with_settings(vessel, WINDY)
    assert compare(windy_log(), reference, vessel=windy).ok
    turned = [
        replace(c, values=c.values + 1e-4) if c.name == "apparent_wind_angle" else c
        for c in windy_log()
    ]
    found = compare(replace(windy_log(), channels=tuple(turned)), reference, vessel=windy)
    changed = {difference.topic for difference in found.changed}
    assert {
        "/wind_beam/measured",
        "/wind_beam/estimate",
        "/yaw_wind_disturbance/estimate",
    } <= changed
    assert "/yaw_rate/measured" not in changed

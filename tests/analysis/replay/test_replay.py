import pickle
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from faults import bias, dropout, freeze, spike
from places import KVLCC2
from tanker_logs import tanker_log
from trial_logs import InChunks, as_log

from analysis.regression.weak_form import weak_form
from analysis.replay.passes import REQUIRED_CHANNELS
from analysis.replay.plan import FITTED_MODEL, Plan, plan_replay
from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import PROGRESS_STEPS, Replay, analyse
from analysis.replay.replay_results import Analysis
from analysis.report.replay_tables import replay_markdown
from analysis.signals.concat import concatenate
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import START_NS, SimulatedTrial, simulate
from shiplog import Channel, LogError, TrialLog, Vessel, VesselError, read, write
from shiplog.errors import UsageError
from shiplog.units import GEOGRAPHIC


def without(log: TrialLog, name: str) -> TrialLog:
    return replace(log, channels=tuple(c for c in log.channels if c.name != name))


def test_the_steps_are_reported_in_order(zigzag_log: TrialLog) -> None:
    reported: list[tuple[str, float]] = []
    analyse(zigzag_log, on_progress=lambda step, share: reported.append((step, share)))
    steps = [step for step in PROGRESS_STEPS if step != "smooth"]  # only where it is asked for
    assert list(dict.fromkeys(step for step, _ in reported)) == steps
    shares = [share for step, share in reported if step == "replay"]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)


def test_a_log_is_replayed_with_the_model_attached_to_it(
    zigzag_analysis: Analysis, vessel: Vessel
) -> None:
    assert zigzag_analysis.findings.plan.model_origin == "attached to the log"
    assert zigzag_analysis.findings.plan.vessel.coefficients == vessel.coefficients


def test_a_vessel_given_takes_precedence_over_the_attached_one(
    zigzag_log: TrialLog, vessel: Vessel
) -> None:
    other = replace(vessel, name="another")
    assert analyse(zigzag_log, ReadingOptions(other)).findings.plan.vessel is other


def test_without_a_model_a_first_one_is_fitted(zigzag_log: TrialLog) -> None:
    found = analyse(replace(zigzag_log, vessel_toml=None))
    assert "fitted to this log" in found.findings.plan.model_origin
    assert found.findings.plan.noise.tuned
    yaw = found.estimates.states[:, 0]
    assert (
        np.nanstd(found.signals["yaw_rate"] - yaw)
        < 1.3 * found.findings.plan.noise.measurement_std[0]
    )


@pytest.mark.parametrize("name", REQUIRED_CHANNELS)
def test_a_missing_channel_is_named_with_those_present(zigzag_log: TrialLog, name: str) -> None:
    with pytest.raises(LogError, match=rf"no channel '{name}' in zigzag\.mcap; it has"):
        analyse(without(zigzag_log, name))


@pytest.mark.parametrize("name", [name for name in REQUIRED_CHANNELS if name != "rpm"])
def test_a_channel_of_one_sample_is_named(zigzag_log: TrialLog, name: str) -> None:
    cut = tuple(
        replace(
            c, measured_ns=c.measured_ns[:1], received_ns=c.received_ns[:1], values=c.values[:1]
        )
        if c.name == name
        else c
        for c in zigzag_log
    )
    with pytest.raises(LogError, match=f"'?{name}'?.*one sample"):
        analyse(replace(zigzag_log, channels=cut))


@pytest.mark.parametrize("fill", [np.inf, -np.inf])
def test_an_infinite_value_is_named_with_its_place(zigzag_log: TrialLog, fill: float) -> None:
    with pytest.raises(LogError, match=r"yaw_rate.*infin"):
        analyse(spike("yaw_rate", 100.0, fill)(zigzag_log))


def test_times_that_run_backwards_are_named_with_the_remedy(zigzag_log: TrialLog) -> None:
    swapped = []
    for c in zigzag_log:
        measured = c.measured_ns.copy()
        if c.name == "yaw_rate":
            measured[[100, 200]] = measured[[200, 100]]
        swapped.append(replace(c, measured_ns=measured))
    with pytest.raises(LogError, match=r"yaw_rate.*backwards.*shiplog convert"):
        analyse(replace(zigzag_log, channels=tuple(swapped)))


def test_nan_is_not_measured_and_warned_of(zigzag_log: TrialLog) -> None:
    found = analyse(spike("yaw_rate", 100.0, np.nan)(zigzag_log))
    assert np.isnan(found.estimates.innovations[1000, 0])
    assert np.isfinite(found.estimates.states).all()
    assert any("yaw_rate" in w and "not measured" in w for w in found.findings.warnings)


def test_a_channel_of_nan_only_is_refused(zigzag_log: TrialLog) -> None:
    with pytest.raises(LogError, match="speed"):
        analyse(bias("speed", np.nan)(zigzag_log))


def test_a_dropout_is_predicted_through_and_warned_of(
    zigzag: SimulatedTrial, zigzag_log: TrialLog
) -> None:
    found = analyse(dropout("yaw_rate", 200.0, 30.0)(zigzag_log))
    assert np.isnan(found.signals["yaw_rate"][2001:2299]).all()
    truth = zigzag.trajectory.at(found.signals.time_secs)["yaw_rate"]
    away = np.abs(found.estimates.states[:, 0] - truth)
    assert np.all(away[2000:2300] < 4 * found.estimates.stds[2000:2300, 0])
    assert any("yaw_rate" in w and "gap" in w for w in found.findings.warnings)


def test_a_rudder_is_held_in_a_gap_and_warned_of(zigzag_log: TrialLog) -> None:
    found = analyse(dropout("rudder", 200.0, 30.0)(zigzag_log))
    assert np.isfinite(found.estimates.states).all()
    assert any(w.startswith("rudder: not measured for") for w in found.findings.warnings)


def test_a_frozen_gyro_is_warned_of(zigzag_log: TrialLog) -> None:
    found = analyse(freeze("yaw_rate", 100.0, 60.0)(zigzag_log))
    assert any("stuck" in w for w in found.findings.warnings)


def test_a_rudder_of_the_wrong_sign_is_warned_of(zigzag_log: TrialLog) -> None:
    contrary = tuple(
        replace(c, values=-c.values) if c.name == "rudder" else c for c in zigzag_log.channels
    )
    found = analyse(replace(zigzag_log, channels=contrary))
    assert any("rudder" in w and "reversed" in w for w in found.findings.warnings)


def test_a_vessel_with_faults_in_the_log_is_refused_with_all_of_them(zigzag_log: TrialLog) -> None:
    spoilt = replace(zigzag_log, vessel_toml="[yaw]\nT1 = -1\n[surge]\nf = nan\nq = 1\n")
    with pytest.raises(VesselError, match=r"T1.*f must be finite.*surge\.q.*in zigzag\.mcap"):
        analyse(spoilt)


def test_a_divergent_model_is_refused(zigzag_log: TrialLog, vessel: Vessel) -> None:
    wild = replace(vessel, coefficients=vessel.coefficients._replace(b3=1e9, b1=10.0))
    with pytest.raises(LogError, match="diverges"):
        analyse(zigzag_log, ReadingOptions(wild))


def test_channels_of_other_rates_with_jitter_are_replayed(vessel: Vessel) -> None:
    settings = {
        "yaw_rate.jitter_secs": 0.01,
        "speed.rate_hz": 1.0,
        "rudder.rate_hz": 25.0,
        "rpm.rate_hz": 2.0,
    }
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, sensors=suite("paper", settings))
    found = analyse(as_log(trial), ReadingOptions(vessel))
    offset = (found.signals.start_ns - START_NS) * 1e-9
    truth = trial.trajectory.at(found.signals.time_secs + offset)
    rms = np.sqrt(np.mean((found.estimates.states[:, 0] - truth["yaw_rate"]) ** 2))
    assert rms < np.radians(0.0015)
    assert np.isfinite(found.signals["speed"]).mean() == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.49, 0.5])
def test_a_gyro_out_of_step_with_the_rudder_is_not_moved_on_its_clock(
    vessel: Vessel, rate_hz: float, phase: float
) -> None:
    sensors = suite("white", {"yaw_rate.rate_hz": rate_hz})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=400.0, seed=3, sensors=sensors)
    shift = round(phase / rate_hz * 1e9)
    moved = tuple(
        replace(c, measured_ns=c.measured_ns + shift) if c.name in ("rudder", "rpm") else c
        for c in as_log(trial)
    )
    found = analyse(replace(as_log(trial), channels=moved))
    assert np.isfinite(found.signals["yaw_rate"]).mean() > 0.99
    offset = (found.signals.start_ns - START_NS) * 1e-9
    truth = trial.trajectory.at(found.signals.time_secs + offset)["yaw_rate"]
    z = (found.estimates.states[:, 0] - truth) / found.estimates.stds[:, 0]
    assert np.sqrt(np.mean(z**2)) < 1.5


@pytest.mark.parametrize("name", REQUIRED_CHANNELS)
def test_a_channel_that_starts_late_starts_the_replay_and_is_warned_of(
    zigzag: SimulatedTrial, zigzag_log: TrialLog, name: str
) -> None:
    found = analyse(dropout(name, 0.0, 120.0)(zigzag_log))
    assert (found.signals.start_ns - START_NS) * 1e-9 == pytest.approx(120.0, abs=0.2)
    assert any(w.startswith(f"{name}: starts 120") for w in found.findings.warnings)
    truth = zigzag.trajectory.at(found.signals.time_secs + 120.0)
    for output, state in (("yaw_rate", 0), ("speed", 3)):
        away = np.abs(found.estimates.states[:, state] - truth[output])
        assert np.all(away < 6 * found.estimates.stds[:, state])


@pytest.mark.parametrize("name", REQUIRED_CHANNELS)
def test_a_channel_that_ends_early_is_warned_of(zigzag_log: TrialLog, name: str) -> None:
    found = analyse(dropout(name, 400.0, 200.0)(zigzag_log))
    ended = name in ("rudder", "rpm")
    expected = f"{name}: ends 100" if ended else f"{name}: no samples in the last 100"
    assert any(w.startswith(expected) for w in found.findings.warnings)
    assert found.signals.time_secs[-1] == pytest.approx(400.0 if ended else 500.0, abs=0.2)


@pytest.mark.parametrize("name", ["rudder", "rpm"])
def test_an_input_that_starts_with_nan_does_not_spoil_the_filter(
    zigzag_log: TrialLog, name: str
) -> None:
    changed = []
    for c in zigzag_log:
        values = c.values.copy()
        if c.name == name:
            values[:5] = np.nan
        changed.append(replace(c, values=values))
    found = analyse(replace(zigzag_log, channels=tuple(changed)))
    assert np.isfinite(found.estimates.states).all()


@pytest.mark.parametrize("name", ["rudder", "rpm"])
def test_a_dead_input_sensor_is_warned_of(zigzag_log: TrialLog, name: str) -> None:
    dead = tuple(replace(c, values=0 * c.values) if c.name == name else c for c in zigzag_log)
    found = analyse(replace(zigzag_log, channels=dead))
    expected = "constant throughout" if name == "rudder" else "0 throughout"
    assert any(w.startswith(f"/{name}/") and expected in w for w in found.findings.warnings)


def test_a_heading_of_nan_only_is_ignored(zigzag_log: TrialLog) -> None:
    unmeasured = bias("heading", np.nan)(zigzag_log)
    found = analyse(unmeasured)
    assert "heading" not in found.signals


def test_a_clock_that_starts_in_a_gap_of_the_rudder_holds_its_last_value(
    zigzag_log: TrialLog,
) -> None:
    late = dropout("speed", 0.0, 20.0)(dropout("rudder", 0.05, 100.0)(zigzag_log))
    found = analyse(late)
    assert np.isfinite(found.estimates.states).all()


def test_impossible_values_are_removed_and_warned_of(zigzag_log: TrialLog) -> None:
    found = analyse(spike("speed", 100.0, 1e300)(zigzag_log))
    assert np.isnan(found.signals["speed"][1000])
    assert any("speed" in w and "impossible" in w for w in found.findings.warnings)


def test_a_ship_whose_rudder_does_nothing_replays(zigzag_log: TrialLog, vessel: Vessel) -> None:
    adrift = replace(vessel, coefficients=vessel.coefficients._replace(d=0.0, e=0.0))
    found = analyse(zigzag_log, ReadingOptions(adrift))
    assert np.isnan(found.disturbance.rudder).all()
    page = replay_markdown(found.findings)
    assert "yaw, as rudder angle [deg] |  |" in page


def test_noise_set_for_one_sample_is_reduced_for_the_mean_of_several(vessel: Vessel) -> None:
    sensors = suite("white", {"speed.rate_hz": 50.0})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=300.0, sensors=sensors)
    stated = replace(vessel.filter, speed_std=0.1, yaw_rate_std=np.radians(0.005))
    found = analyse(as_log(trial), ReadingOptions(replace(vessel, filter=stated)))
    assert found.findings.residuals[1].mean_nis == pytest.approx(1, abs=0.1)


def test_the_order_of_the_channels_does_not_matter(
    zigzag_log: TrialLog, zigzag_analysis: Analysis
) -> None:
    turned = analyse(replace(zigzag_log, channels=zigzag_log.channels[::-1]))
    assert np.array_equal(turned.estimates.states, zigzag_analysis.estimates.states)


def flat(result: object, name: str = "") -> dict[str, str | np.ndarray]:
    """Every number of a result, by its place."""
    if isinstance(result, np.ndarray):
        return {name: result}
    if isinstance(result, Mapping):
        parts = list(result.items())
    elif is_dataclass(result):
        parts = [(field.name, getattr(result, field.name)) for field in fields(result)]
    else:
        return {name: repr(result)}
    return {k: v for key, part in parts for k, v in flat(part, f"{name}.{key}").items()}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("model", ["carried", "fitted"])
def test_where_a_log_is_cut_changes_no_bit_of_the_results(
    zigzag_log: TrialLog, model: str, seed: int
) -> None:
    """With gaps across the cuts, chunks of few samples and of many, channels of many rates."""
    rng = np.random.default_rng(seed)
    log = dropout("rudder", 150.0, 20.0)(dropout("yaw_rate", 0.0, 7.0)(zigzag_log))
    log = dropout("heading", 300.0, 40.0)(dropout("speed", 400.0, 9.0)(log))
    if seed:
        log = without(log, "position")
    if model == "fitted":
        log = replace(log, vessel_toml=None)
    edges = {0: [6.9, 150.0, 150.1, 169.9, 410.0], 1: np.arange(1.0, 500.0, 1.3).tolist()}
    cuts = edges.get(seed, np.sort(rng.uniform(0, 500, 9)).tolist())
    whole, parted = flat(analyse(log)), flat(analyse(InChunks(log, cuts)))
    assert_same(whole, parted)


def assert_same(one: Mapping[str, object], other: Mapping[str, object]) -> None:
    """To the last bit."""
    assert one.keys() == other.keys()
    for place, numbers in one.items():
        if isinstance(numbers, np.ndarray):
            assert np.array_equal(numbers, other[place], equal_nan=True), place
        else:
            assert numbers == other[place], place


def with_channel(log: TrialLog, changed: Channel) -> TrialLog:
    return replace(
        log, channels=tuple(changed if c.name == changed.name else c for c in log.channels)
    )


def test_coefficients_are_estimated_from_a_sensor_that_sends_bursts(zigzag_log: TrialLog) -> None:
    """Its median interval is not that from burst to burst, which counts on the clock."""
    c = zigzag_log["speed"]
    rows = np.repeat(np.arange(0, len(c), 20), 3)
    late = np.tile([0, 50_000_000, 100_000_000], len(rows) // 3)
    bursts = replace(
        c,
        measured_ns=c.measured_ns[rows] + late,
        received_ns=c.received_ns[rows] + late,
        values=c.values[rows],
    )
    log = with_channel(zigzag_log, bursts)
    found = analyse(log)
    assert all(np.isfinite(c.value) for c in found.findings.yaw.coefficients.values())
    assert all(np.isfinite(c.value) for c in found.findings.surge.coefficients.values())
    assert analyse(replace(log, vessel_toml=None)).findings.plan.model_origin == FITTED_MODEL


def test_impossible_positions_are_counted_whatever_the_chunks(zigzag_log: TrialLog) -> None:
    at = zigzag_log["yaw_rate"].measured_ns[:3000:10]
    values = np.column_stack((np.full(300, 95.0), np.linspace(10, 10.1, 300), np.zeros(300)))
    for nans in (0, 1):
        values[200, :] = np.nan if nans else values[200]
        fixes = Channel("position", "gps", "deg", at, at, values, GEOGRAPHIC)
        log = with_channel(zigzag_log, fixes)
        for cut in (log, InChunks(log, [150.0])):
            expected = f"{300 - nans} fixes at an impossible position"
            assert any(expected in warning for warning in analyse(cut).findings.warnings)


def test_a_trial_before_1970_starts_with_its_inputs_held(zigzag_log: TrialLog) -> None:
    late = dropout("speed", 0.0, 5.0)(dropout("rudder", 0.15, 30.0)(zigzag_log))
    shifted = tuple(
        replace(c, measured_ns=c.measured_ns - 3 * 10**18, received_ns=c.received_ns - 3 * 10**18)
        for c in late
    )
    before = analyse(replace(late, channels=shifted))
    assert np.array_equal(before.estimates.states, analyse(late).estimates.states)


@pytest.mark.parametrize("changes", [{"g": 1000.0}, {"a": 1e4}])
def test_a_model_without_an_observer_is_refused_as_divergent(
    zigzag_log: TrialLog, vessel: Vessel, changes: dict[str, float]
) -> None:
    away = replace(vessel, coefficients=vessel.coefficients._replace(**changes))
    with pytest.raises(LogError, match="diverges"):
        analyse(zigzag_log, ReadingOptions(away))


def test_the_chunks_of_a_replay_can_be_read_once(zigzag_log: TrialLog) -> None:
    replay = Replay(zigzag_log, plan_replay(zigzag_log))
    with pytest.raises(ValueError, match="no findings yet"):
        _ = replay.findings
    assert sum(len(chunk.signals) for chunk in replay.chunks()) == replay.plan.clock.count
    assert replay.findings.plan is replay.plan
    with pytest.raises(ValueError, match="once only"):
        next(replay.chunks())


@pytest.mark.parametrize("kind", ["pseudo-input", "extended"])
def test_a_log_cut_anywhere_is_smoothed_the_same(zigzag_log: TrialLog, kind: str) -> None:
    settings = {"filter.kind": kind, "filter.smooth": True}
    whole = analyse(zigzag_log, settings=settings)
    cut = analyse(InChunks(zigzag_log, [0.05, 100.0, 100.3, 333.0]), settings=settings)
    for one, other in (
        (whole.estimates.states, cut.estimates.states),
        (whole.estimates.stds, cut.estimates.stds),
    ):
        np.testing.assert_allclose(one / np.abs(one).max(axis=0), other / np.abs(one).max(axis=0))
    assert np.array_equal(
        whole.estimates.innovations, cut.estimates.innovations, equal_nan=True
    )  # which are the filter's


def test_smoothing_reduces_the_standard_deviations_and_takes_the_disturbance_from_the_filter(
    zigzag_log: TrialLog, zigzag_analysis: Analysis
) -> None:
    found = analyse(zigzag_log, settings={"filter.smooth": True})
    for one, other in zip(
        found.findings.residuals, zigzag_analysis.findings.residuals, strict=True
    ):
        assert one.mean_nis == pytest.approx(other.mean_nis, rel=0.02)
    yaw = slice(200, -200), slice(2)
    assert np.all(found.estimates.stds[yaw] < zigzag_analysis.estimates.stds[yaw])
    assert found.estimates.states[-1] == pytest.approx(
        zigzag_analysis.estimates.states[-1], rel=0.02
    )
    rudder = zigzag_log["rudder"]
    wrong = replace(rudder, values=rudder.values + np.radians(1.0))
    channels = tuple(wrong if c is rudder else c for c in zigzag_log)
    found = analyse(replace(zigzag_log, channels=channels), settings={"filter.smooth": True})
    moment, std = found.estimates.further.of("yaw_moment")
    assert np.array_equal(found.disturbance.yaw, moment)
    assert np.array_equal(found.disturbance.stds[:, 0], std)


def test_a_spike_at_the_end_is_rejected_by_the_filter_counted_and_harmless(
    zigzag_log: TrialLog, zigzag_analysis: Analysis
) -> None:
    """The screening does not judge the last three samples of a channel."""
    spiked = spike("yaw_rate", 499.9, np.radians(1.0))(zigzag_log)
    found = analyse(spiked)
    assert found.findings.residuals[0].rejected == 1
    away = np.abs(found.estimates.states - zigzag_analysis.estimates.states)
    assert np.all(away < 0.3 * zigzag_analysis.estimates.stds)
    moment = np.abs(found.disturbance.yaw - zigzag_analysis.disturbance.yaw)
    assert (
        moment.max() < zigzag_analysis.findings.disturbances["yaw"].noise_std
    )  # the observer ignores it, too
    unlimited = analyse(spiked, settings={"filter.gate": 1e6})
    assert unlimited.findings.residuals[0].rejected == 0
    assert unlimited.findings.residuals[0].mean_nis > found.findings.residuals[0].mean_nis


def test_poles_slower_than_the_optimal_ones_are_used(zigzag_log: TrialLog) -> None:
    slow = {"filter.kind": "per-tick", "filter.yaw_decay": 0.004, "filter.surge_decay": 0.004}
    found = analyse(zigzag_log, settings={**slow, "filter.process_ratio": 1e-3})
    best = analyse(zigzag_log, settings={"filter.kind": "extended", "filter.process_ratio": 1e-3})
    assert np.array_equal(found.estimates.states[:2000], best.estimates.states[:2000])
    assert not np.array_equal(found.estimates.states[4000:], best.estimates.states[4000:])


def test_more_rejected_samples_than_spikes_explain_are_warned_of(zigzag_log: TrialLog) -> None:
    found = analyse(zigzag_log, settings={"filter.gate": 1.0})
    assert any("of the samples, too many for spikes" in text for text in found.findings.warnings)


def test_invalid_settings_are_refused_before_any_pass(zigzag_log: TrialLog) -> None:
    reported: list[str] = []
    for log in (zigzag_log, replace(zigzag_log, vessel_toml=None)):
        with pytest.raises(UsageError, match=r"filter\.kind must be one of"):
            plan_replay(
                log, settings={"filter.kind": "kalman"}, on_progress=lambda s, _: reported.append(s)
            )
    assert not reported


RUNS = sorted(KVLCC2.glob("*/*.dat"))


@pytest.mark.skipif(not RUNS, reason="the SIMMAN data are not in ../shared/data/kvlcc2")
@pytest.mark.parametrize("run", RUNS, ids=lambda run: run.stem)
def test_every_real_run_of_the_kvlcc2_replays(run: Path) -> None:
    found = analyse(tanker_log(run))
    assert "fitted to this log" in found.findings.plan.model_origin
    # the fitted model explains most of the weak form's left-hand sides
    coefficients = found.findings.plan.vessel.coefficients
    rows_of_both = weak_form(found.signals, coefficients)
    for rows, share in zip(rows_of_both, (0.25, 0.5), strict=True):
        left_side = rows.target - np.nanmean(rows.target)
        model = [
            getattr(found.findings.plan.vessel.coefficients, name) for name in rows.equation.names
        ]
        left_over = rows.target - rows.regressors @ model
        assert np.nanvar(left_over) < share * np.nanvar(left_side)
    assert found.findings.yaw.coefficients["a"].value < 0
    assert found.findings.yaw.coefficients["e"].value > 0
    assert found.findings.surge.coefficients["f"].determined
    assert not any("contrary" in w for w in found.findings.warnings)


def window_warnings(found: Analysis) -> list[str]:
    return [text for text in found.findings.warnings if "identifier.window_secs" in text]


def test_windows_are_as_long_as_the_settings_say(zigzag_log: TrialLog) -> None:
    found = analyse(zigzag_log, settings={"identifier.window_secs": 300})
    assert found.yaw_history.time_secs[0] == pytest.approx(300.0, abs=1.0)
    assert found.surge_history.time_secs[0] == pytest.approx(300.0, abs=1.0)
    assert np.isfinite(found.yaw_history.values).any()
    assert window_warnings(found) == []
    bare = analyse(without_vessel(zigzag_log), settings={"identifier.window_secs": 300})
    assert bare.yaw_history.time_secs[0] == pytest.approx(300.0, abs=1.0)


def without_vessel(log: TrialLog) -> TrialLog:
    return replace(log, vessel_toml=None)


def test_a_window_longer_than_the_log_covers_it_and_is_warned_of(zigzag_log: TrialLog) -> None:
    found = analyse(zigzag_log, settings={"identifier.window_secs": 1000})
    (warning,) = window_warnings(found)
    assert "longer than the log (500 s): one window covers the whole log" in warning
    assert found.yaw_history.values.shape == (1, 6)


@pytest.mark.parametrize(("secs", "too_short"), [(170, ["yaw"]), (100, ["yaw", "surge"])])
def test_windows_too_short_for_the_coefficients_are_empty_and_warned_of(
    zigzag_log: TrialLog, secs: float, too_short: list[str]
) -> None:
    found = analyse(zigzag_log, settings={"identifier.window_secs": secs})
    (warning,) = window_warnings(found)
    assert f"coefficients of {' and '.join(too_short)}: their windows are empty" in warning
    for name, history in (("yaw", found.yaw_history), ("surge", found.surge_history)):
        assert np.isfinite(history.values).any() == (name not in too_short)
    needed = float(warning.split("more than ")[1].split(" s")[0])
    enough = analyse(zigzag_log, settings={"identifier.window_secs": needed + 1})
    assert np.isfinite(enough.yaw_history.values).any()


@pytest.mark.parametrize("manoeuvre", ["turning-circle", "zigzag-20-20"])
def test_ten_seconds_determine_no_coefficient(vessel: Vessel, manoeuvre: str) -> None:
    trial = simulate(vessel, manoeuvre, duration_secs=10.0, sensors=suite("paper"))
    found = analyse(as_log(trial), ReadingOptions(vessel))
    every = found.findings.yaw.coefficients | found.findings.surge.coefficients
    assert not any(coefficient.determined for coefficient in every.values())
    assert "use a longer log" in window_warnings(found)[0]
    assert "shorten the windows" not in window_warnings(found)[0]
    with pytest.raises(LogError, match="too little motion to fit"):
        analyse(as_log(trial))


def test_a_rudder_at_rest_determines_no_coefficient(vessel: Vessel) -> None:
    """A straight run of ten minutes, its revolutions kept: not even surge is determined."""
    trial = simulate(vessel, "turning-circle", duration_secs=10.0, sensors=suite("none"))
    times = np.arange(6001) / 10
    stamps = START_NS + (times * 1e9).astype(np.int64)
    rng, constant = np.random.default_rng(0), {c.name: c.values[0] for c in trial.channels}
    noise = {"yaw_rate": 1e-4, "speed": 0.1}
    log = TrialLog(
        "straight.mcap",
        tuple(
            Channel(
                c.name, c.source, c.unit, stamps, stamps,
                constant[c.name] + noise.get(c.name, 0.0) * rng.standard_normal(len(times)),
            )
            for c in trial.channels
            if c.name in REQUIRED_CHANNELS
        ),
    )  # fmt: skip
    found = analyse(log, ReadingOptions(vessel))
    every = found.findings.yaw.coefficients | found.findings.surge.coefficients
    assert not any(coefficient.determined for coefficient in every.values())
    assert found.findings.changes == ()
    with pytest.raises(LogError, match="too little motion to fit yaw and surge"):
        analyse(log)


def test_two_replays_of_one_plan_are_equal(zigzag_log: TrialLog) -> None:
    plan = plan_replay(zigzag_log)
    before = flat(deepcopy(plan))
    results = []
    for _ in range(2):
        replay = Replay(zigzag_log, plan)
        chunks = list(replay.chunks())
        results.append(flat(concatenate(chunks), "chunk") | flat(replay.findings, "findings"))
    assert_same(*results)
    assert_same(before, flat(plan))


def test_a_replay_makes_no_pass_over_the_log_before_its_chunks(zigzag_log: TrialLog) -> None:
    plan = plan_replay(zigzag_log)
    Replay(NoPasses(zigzag_log), plan)
    with pytest.raises(AssertionError, match="a pass over the log"):
        next(Replay(NoPasses(zigzag_log), plan).chunks())


class NoPasses(InChunks):
    def __init__(self, log: TrialLog) -> None:
        super().__init__(log, [])

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        raise AssertionError("a pass over the log")


def test_a_path_is_analysed_as_the_log_it_names(zigzag_log: TrialLog, tmp_path: Path) -> None:
    write(zigzag_log, tmp_path / "zigzag.mcap")
    for path in (tmp_path / "zigzag.mcap", str(tmp_path / "zigzag.mcap")):
        assert_same(flat(analyse(path)), flat(analyse(read(path))))


@pytest.mark.parametrize("copied", [deepcopy, lambda it: pickle.loads(pickle.dumps(it))])  # noqa: S301
def test_plan_findings_chunk_and_analysis_can_be_pickled_and_copied(
    zigzag_log: TrialLog, zigzag_analysis: Analysis, copied: Callable[[object], object]
) -> None:
    findings, chunk = zigzag_analysis.findings, zigzag_analysis.as_chunk()
    for result in (findings.plan, findings, chunk, zigzag_analysis):
        assert_same(flat(result), flat(copied(result)))
    plan = copied(findings.plan)
    assert isinstance(plan, Plan)
    replay = Replay(zigzag_log, plan)
    assert_same(flat(concatenate(list(replay.chunks()))), flat(chunk))


def test_a_disturbance_setting_too_high_for_the_samples_stays_a_usage_error(
    zigzag_log: TrialLog,
) -> None:
    expected = r"disturbance\.yaw_frequency of 400 rad/s is too high .* lower it below 100"
    with pytest.raises(UsageError, match=expected):
        analyse(zigzag_log, settings={"disturbance.yaw_frequency": 400.0})

"""Tests of recorders.streams.gnss_clock."""

import tracemalloc

import numpy as np
import pytest

from recorders.streams.gnss_clock import ROLLOVER_NS, GnssClock, Utc, rollovers
from recorders.streams.receiver_times import Latency

SECOND_NS = 10**9
DAY_NS = 86_400 * SECOND_NS
DAY = 16_283  # 2014-08-01


class _Run:
    """A receiver heard once a second with a latency."""

    def __init__(self, *, received_is_known: bool = True) -> None:
        self.warnings: list[str] = []
        self.clock = GnssClock(
            lambda text, _time_ns: self.warnings.append(text), received_is_known=received_is_known
        )

    def hear(self, count: int, latency_secs: float, *, first: int = 0, day: int = DAY) -> list[int]:
        times = []
        for n in range(first, first + count):
            received_ns = DAY * DAY_NS + n * SECOND_NS + round(latency_secs * SECOND_NS)
            time_ns = self.clock.set_time("GP", "RMC", Utc(n * SECOND_NS, day), received_ns)
            assert time_ns is not None
            times.append(time_ns)
        return times


@pytest.mark.parametrize(
    ("days_early", "count"),
    [(0, 0), (1, 0), (7168, 1), (7169, 1), (7171, 0), (14_336, 2), (21_504, 0), (-7168, 0)],
)
def test_a_rollover_is_an_error_of_1024_or_2048_weeks(days_early: int, count: int) -> None:
    assert rollovers(30_000 * DAY_NS - days_early * DAY_NS, 30_000 * DAY_NS) == count


@pytest.mark.parametrize("weeks", [1024, 2048])
def test_a_rolled_over_date_is_corrected_and_reported_once(weeks: int) -> None:
    run = _Run()
    times = run.hear(5, 0.1, day=DAY - 7 * weeks)
    assert times == [DAY * DAY_NS + n * SECOND_NS for n in range(5)]
    [warning] = run.warnings
    assert f"{weeks} weeks early (rollover of the GPS week), corrected to 2014-08-01" in warning
    assert weeks * 7 * DAY_NS % ROLLOVER_NS == 0


def test_a_date_that_contradicts_reception_is_not_used_and_reported_once() -> None:
    run = _Run()
    for n in range(3):
        utc = Utc(n * SECOND_NS, DAY - 100)
        assert run.clock.set_time("GP", "RMC", utc, DAY * DAY_NS + n * SECOND_NS) is None
    assert run.warnings == [
        "GP: date 2014-04-23 contradicts the time of reception 2014-08-01; its times are not used"
    ]


def test_times_without_a_date_pass_midnight_at_the_time_of_reception() -> None:
    run = _Run()
    before = run.clock.set_time("GP", "GGA", Utc(DAY_NS - SECOND_NS, None), DAY * DAY_NS + 10)
    after = run.clock.set_time("GP", "GGA", Utc(0, None), DAY * DAY_NS + SECOND_NS)
    assert (before, after) == (DAY * DAY_NS - SECOND_NS, DAY * DAY_NS)


def test_a_late_receiver_is_reported_with_its_median_latency() -> None:
    run = _Run()
    run.hear(100, 0.4)
    run.clock.finish()
    [warning] = run.warnings
    assert warning.startswith("GP: reception minus GNSS time is RMC 0.40 s: the receiver is late")


def test_a_wrong_clock_of_the_recorder_is_reported() -> None:
    run = _Run()
    run.hear(100, -3600.0)
    run.clock.finish()
    [warning] = run.warnings
    assert "RMC -3600.00 s: the recorder's clock is wrong by about as much" in warning


def test_a_prompt_receiver_is_not_reported() -> None:
    run = _Run()
    run.hear(100, 0.15)
    run.clock.finish()
    assert run.warnings == []


def test_times_derived_from_the_sentences_have_no_latency() -> None:
    run = _Run(received_is_known=False)
    run.hear(100, 5.0)
    run.clock.finish()
    assert run.warnings == []


def test_a_jump_of_the_recorders_clock_is_reported_when_it_happens() -> None:
    run = _Run()
    run.hear(60, 0.1)
    run.hear(60, 2.1, first=60)
    assert len(run.warnings) == 1
    assert "GPRMC: reception against GNSS time jumps by +2.00 s" in run.warnings[0]


def test_latency_quantiles_are_those_of_numpy() -> None:
    values = np.random.default_rng(3).normal(0.3, 0.1, 10_000)
    latency = Latency()
    for value in values.tolist():
        latency.add(value)
    expected = np.quantile(values, (0.5, 0.05, 0.95)).tolist()
    assert latency.quantiles() == pytest.approx(tuple(expected))
    assert latency.count == 10_000


class _Applied:
    """Receivers whose times are applied, and the times of measurement of what they send."""

    def __init__(self, *, in_bursts: bool = False) -> None:
        self.warnings: list[str] = []
        self.measured: dict[str, list[float]] = {}  # by kind, s since the first epoch
        self.clock = GnssClock(
            lambda text, _time_ns: self.warnings.append(text), is_applied=True, in_bursts=in_bursts
        )

    def hear(
        self, kind: str, received: float, stated: float | None = None, source: str = "GP"
    ) -> None:
        """Hear a message at a time, s, with or without a time."""
        received_ns = DAY * DAY_NS + round(received * SECOND_NS)
        stated_ns = None
        if stated is not None:
            utc = Utc(round(stated * SECOND_NS), DAY)
            stated_ns = self.clock.set_time(source, kind, utc, received_ns)
        times = self.measured.setdefault(kind, [])
        self.clock.write_measured(
            source,
            kind,
            (received_ns, stated_ns),
            lambda ns: times.append(round(ns / SECOND_NS - DAY * 86_400, 6)),
        )


def test_messages_of_a_burst_share_its_epoch_whether_before_or_after_the_timed_one() -> None:
    run = _Applied(in_bursts=True)
    for n in range(20):
        run.hear("GSV", n + 0.3)
        run.hear("RMC", n + 0.4, n)
        run.hear("VTG", n + 0.55)
    run.clock.finish()
    assert run.measured == {kind: list(range(20)) for kind in ("GSV", "RMC", "VTG")}


def test_what_comes_more_often_than_the_times_is_in_no_burst() -> None:
    run = _Applied(in_bursts=True)
    for n in range(200):
        if n % 10 == 0:
            run.hear("ZDA", n / 10 + 0.4, n / 10)
        run.hear("HDT", n / 10 + 0.45)
    run.clock.finish()
    np.testing.assert_allclose(run.measured["HDT"], np.arange(200) / 10 + 0.05, atol=0.051)
    assert min(np.diff(run.measured["HDT"])) > 0.04


def test_a_delayed_message_shifts_no_other_one() -> None:
    run = _Applied()
    for n in range(20):
        run.hear("fix", n + (1.1 if n == 10 else 0.3), n)
        run.hear("rapid", n + 0.35)
    run.clock.finish()
    assert run.measured["fix"] == list(range(20))
    np.testing.assert_allclose(run.measured["rapid"], np.arange(20) + 0.05)


def test_a_receiver_keeps_its_latency_when_its_times_end() -> None:
    run = _Applied()
    for n in range(10):
        run.hear("fix", n + 0.3, n)
    run.hear("rapid", 300.0)
    assert run.measured["rapid"] == [299.7]


def test_times_of_a_clock_give_way_to_those_of_fixes() -> None:
    run = _Applied()
    run.clock = GnssClock(
        lambda text, _: run.warnings.append(text), is_applied=True, clock_kinds=("clock",)
    )
    for n in range(10):
        run.hear("clock", n + 0.9, n)
        run.hear("fix", n + 0.95, n + 0.8)
        run.hear("rapid", n + 0.97)
    np.testing.assert_allclose(run.measured["rapid"], np.arange(10) + 0.82)


def test_other_talkers_keep_the_time_of_reception() -> None:
    run = _Applied(in_bursts=True)
    for n in range(40):
        run.hear("HDT", n / 10, source="HE")
    run.clock.finish()
    assert run.measured["HDT"] == [n / 10 for n in range(40)]
    assert run.warnings == []


def test_samples_wait_until_the_times_show_whether_they_can_be_used() -> None:
    run = _Applied()
    for n in range(8):
        assert run.measured.get("fix", []) == []
        run.hear("fix", n + 0.3, n)
    assert run.measured["fix"] == list(range(8))


@pytest.mark.parametrize(
    "stated",
    [
        [n // 4 * 4 for n in range(30)],  # the clock stands still for four seconds
        [n - 1 if n < 4 else n for n in range(30)],  # the last full second, out of step
    ],
)
def test_times_that_do_not_step_as_the_messages_come_are_not_applied(stated: list[int]) -> None:
    run = _Applied()
    for n, utc in enumerate(stated[1:], start=1):
        run.hear("fix", n + 0.02, utc)
    run.clock.finish()
    assert run.measured["fix"] == [n + 0.02 for n in range(1, 30)]
    [warning] = run.warnings
    assert "it is not the time of measurement, which is that of reception" in warning


def test_delays_of_the_recorder_are_no_steps_of_the_receiver() -> None:
    run = _Applied()
    rng = np.random.default_rng(4)
    for n in range(3000):
        run.hear("fix", n + 0.1 + rng.exponential(0.2), n)
    assert run.measured["fix"] == list(range(3000))
    assert run.warnings == []


def test_messages_that_waited_and_come_all_at_once_are_no_steps_of_the_receiver() -> None:
    run = _Applied()
    for n in range(60):
        run.hear("fix", max(n + 0.1, 50 + 0.01 * n) if n < 50 else n + 0.6, n)
    assert not [text for text in run.warnings if "steps by" in text]


def test_times_that_go_wrong_later_are_reported_with_the_remedy() -> None:
    run = _Applied()
    for n in range(30):
        run.hear("fix", n + 0.1, n if n < 20 else n - 1)
    assert run.measured["fix"][:20] == list(range(20))
    assert "record or decode it without --time gnss" in run.warnings[0]


@pytest.mark.parametrize("offset", [-3600.0, -0.5, 2.5])
def test_an_offset_of_the_recorders_clock_is_not_applied_to_some_of_the_sensors(
    offset: float,
) -> None:
    run = _Applied()
    for n in range(10, 30):
        run.hear("fix", 5000 + n + offset, 5000 + n)
    run.clock.finish()
    assert run.measured["fix"] == [5000 + n + offset for n in range(10, 30)]
    assert "its own differs by more than a latency" in run.warnings[0]
    assert "the recorder's clock is wrong by about as much" in run.warnings[1]


def test_a_receiver_without_a_time_keeps_the_time_of_reception_with_a_warning() -> None:
    run = _Applied()
    for n in range(50):
        run.hear("rapid", n / 10)
    run.hear("fix", 5.1, 5.0, source="late")
    run.clock.finish()
    assert run.measured["rapid"] == [n / 10 for n in range(50)]
    assert run.warnings == ["GP: its samples have the time of reception: it sends no time"]


def test_a_time_that_comes_late_changes_no_clock_in_the_middle_of_a_log() -> None:
    run = _Applied()
    for n in range(100):
        run.hear("rapid", n / 10)
        if n > 50 and n % 10 == 0:
            run.hear("fix", n / 10 + 0.01, n / 10 - 0.3)
    run.clock.finish()
    assert run.measured["rapid"] == [n / 10 for n in range(100)]
    assert "its first time came over 2 s after its first message" in run.warnings[0]


def test_what_waits_is_bounded() -> None:
    run = _Applied()
    for n in range(2000):
        run.hear("rapid", n / 2000)
    assert len(run.measured["rapid"]) == 2000


def test_the_number_of_receivers_is_bounded() -> None:
    run = _Run()
    times = [run.clock.set_time(f"T{n}", "ZDA", Utc(0, None), 0) for n in range(100)]
    assert times.count(None) == 36


def test_the_memory_of_latencies_is_bounded() -> None:
    latency = Latency()
    tracemalloc.start()
    for n in range(300_000):
        latency.add(n % 100 * 0.01)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 1_000_000
    assert latency.count == 300_000
    assert latency.quantiles() == pytest.approx((0.495, 0.05, 0.94), abs=0.02)

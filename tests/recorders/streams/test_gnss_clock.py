"""Tests of recorders.streams.gnss_clock."""

import tracemalloc

import numpy as np
import pytest

from recorders.streams.gnss_clock import ROLLOVER_NS, GnssClock, Latency, Utc, rollovers

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


def test_sentences_of_a_burst_share_its_time_whether_before_or_after_the_timed_one() -> None:
    run = _Run()
    run.hear(3, 0.4)
    epoch_ns = DAY * DAY_NS + 2 * SECOND_NS
    after_ns, before_ns = epoch_ns + 550_000_000, epoch_ns + 1_300_000_000
    assert run.clock.measured_ns("GP", after_ns) == epoch_ns
    assert run.clock.measured_ns("GP", before_ns) == epoch_ns + SECOND_NS


def test_other_talkers_and_silent_receivers_keep_the_time_of_reception() -> None:
    run = _Run()
    run.hear(3, 0.4)
    late_ns = DAY * DAY_NS + 60 * SECOND_NS
    assert run.clock.measured_ns("HE", late_ns) == late_ns
    assert run.clock.measured_ns("GP", late_ns) == late_ns


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

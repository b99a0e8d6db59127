import numpy as np
import pytest

from analysis.signals.hold import InputHold, held_throughout
from shiplog import Channel, Signals, TrialLog
from shiplog.checks.log_stats import compute_log_stats
from shiplog.resampling import Clock

START = 1_700_000_000 * 10**9


def log_of(rudder: list[float], rpm: list[float]) -> TrialLog:
    """Samples a second apart, the first two of them before the clock begins."""
    stamps = START + np.arange(-2, len(rudder) - 2) * 10**9
    return TrialLog(
        "x",
        tuple(
            Channel(name, "a", "1", stamps, stamps, np.array(values))
            for name, values in (("rudder", rudder), ("rpm", rpm))
        ),
    )


def test_what_is_missing_is_the_last_known_even_from_before_the_clock() -> None:
    nan = float("nan")
    log = log_of([0.1, 0.2, nan, nan, 0.3, nan], [80, nan, 81, nan, nan, 82])
    found = compute_log_stats(log)
    clock = Clock(START, 1.0, 4, {name: found[name] for name in ("rudder", "rpm")})
    signals = Signals(START, 1.0, {c.name: c.values[2:] for c in log})
    for cuts in ([], [1], [1, 2, 3]):
        holding = InputHold(clock)
        holding.add_raw(log.channels)
        chunks = [signals.part(a, b) for a, b in zip([0, *cuts], [*cuts, 4], strict=True)]
        rows = list(held_throughout(chunks, holding))
        rudder = np.concatenate([held["rudder"] for _, held, _ in rows])
        rpm = np.concatenate([held["rpm"] for _, held, _ in rows])
        assert rudder.tolist() == [0.2, 0.2, 0.3, 0.3]
        assert rpm.tolist() == [81, 81, 81, 82]
        assert [following["rudder"] for *_, following in rows] == [
            *(rudder[cut] for cut in cuts), 0.3
        ]  # fmt: skip
        assert holding.missing == {"rudder": 3, "rpm": 2}
        assert [s.split(":")[0] for s in holding.warnings()] == ["rudder", "rpm"]
        assert "3.0 s in all" in holding.warnings()[0]


def test_nothing_is_said_where_nothing_is_missing() -> None:
    log = log_of([0.1, 0.2, 0.3], [80, 80, 80])
    found = compute_log_stats(log)
    holding = InputHold(Clock(START, 1.0, 1, {n: found[n] for n in ("rudder", "rpm")}))
    signals = Signals(START, 1.0, {"rudder": np.array([0.3]), "rpm": np.array([80.0])})
    assert holding.step(signals)["rudder"] == pytest.approx([0.3])
    assert holding.warnings() == []

import numpy as np
import pytest

from analysis.signals.hold import InputHold, held_throughout
from shiplog import Channel, Signals, TrialLog
from shiplog.checks.log_stats import compute_log_stats
from shiplog.resampling import Clock

START = 1_700_000_000 * 10**9


def log_of(rudder: list[float], rpm: list[float]) -> TrialLog:
    """Return a log with samples one second apart, the first two before the clock starts."""
    stamps = START + np.arange(-2, len(rudder) - 2) * 10**9
    return TrialLog(
        "x",
        tuple(
            Channel(name, "a", "1", stamps, stamps, np.array(values))
            for name, values in (("rudder", rudder), ("rpm", rpm))
        ),
    )


def test_missing_inputs_hold_their_last_value_even_from_before_the_clock() -> None:
    nan = float("nan")
    log = log_of([0.1, 0.2, nan, nan, 0.3, nan], [80, nan, 81, nan, nan, 82])
    log_stats = compute_log_stats(log)
    clock = Clock(START, 1.0, 4, {name: log_stats[name] for name in ("rudder", "rpm")})
    signals = Signals(START, 1.0, {c.name: c.values[2:] for c in log})
    for cuts in ([], [1], [1, 2, 3]):
        hold = InputHold(clock)
        hold.add_raw(log.channels)
        chunks = [signals.part(a, b) for a, b in zip([0, *cuts], [*cuts, 4], strict=True)]
        rows = list(held_throughout(chunks, hold))
        rudder = np.concatenate([held["rudder"] for _, held, _ in rows])
        rpm = np.concatenate([held["rpm"] for _, held, _ in rows])
        assert rudder.tolist() == [0.2, 0.2, 0.3, 0.3]
        assert rpm.tolist() == [81, 81, 81, 82]
        assert [following["rudder"] for *_, following in rows] == [
            *(rudder[cut] for cut in cuts), 0.3
        ]  # fmt: skip
        assert hold.missing == {"rudder": 3, "rpm": 2}
        assert [text.split(":")[0] for text in hold.warnings()] == ["rudder", "rpm"]
        assert "3.0 s in all" in hold.warnings()[0]


def test_there_are_no_warnings_where_no_input_is_missing() -> None:
    log = log_of([0.1, 0.2, 0.3], [80, 80, 80])
    log_stats = compute_log_stats(log)
    hold = InputHold(Clock(START, 1.0, 1, {n: log_stats[n] for n in ("rudder", "rpm")}))
    signals = Signals(START, 1.0, {"rudder": np.array([0.3]), "rpm": np.array([80.0])})
    assert hold.step(signals)["rudder"] == pytest.approx([0.3])
    assert hold.warnings() == []

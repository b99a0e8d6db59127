"""Numbers of a report have the digits of their uncertainty, and no interval is without width."""

from math import radians

import pytest

from analysis.manoeuvres.trial_index import TrialIndex
from analysis.report.page.value_text import half_width_text, interval_text, value_text


def overshoot(value_deg: float, std_deg: float) -> TrialIndex:
    value, std = radians(value_deg), radians(std_deg)
    return TrialIndex(
        "overshoot 1", "", value, "rad", std, value - 1.96 * std, value + 1.96 * std
    )  # fmt: skip


@pytest.mark.parametrize(
    ("std_deg", "interval", "half_width"),
    [
        (0.1, "16.15 to 16.54°", "16.35 ± 0.20°"),
        (0.001, "16.34 to 16.35°", "16.35 ± 0.01°"),
        (0.00001, "16.34 to 16.35°", "16.35 ± 0.01°"),
    ],
)
def test_a_narrow_interval_is_rounded_outwards(
    std_deg: float, interval: str, half_width: str
) -> None:
    index = overshoot(16.3457, std_deg)
    assert interval_text(index) == interval
    assert half_width_text(index) == half_width


def test_a_speed_is_written_in_knots() -> None:
    speed = 10 * 1852 / 3600  # m/s
    index = TrialIndex("speed at 90°", "V90", speed, "m/s", 0.1, speed - 0.2, speed + 0.2)
    assert value_text(index) == "10.00 kn"
    assert interval_text(index) == "9.61 to 10.39 kn"
    assert half_width_text(index) == "10.00 ± 0.39 kn"
    assert index.value == pytest.approx(5.144, abs=1e-3)

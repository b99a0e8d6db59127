"""Numbers of a report have the digits of their uncertainty, and no interval is without width."""

from math import radians

import pytest

from analysis.manoeuvres.trial_index import TrialIndex
from analysis.report.page.value_text import half_width_text, interval_text


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

"""The reasons why a run has no indices."""

import re

import numpy as np
import pytest

from analysis.manoeuvres.indices import reason_without_indices

DEG = np.pi / 180
TIME = np.arange(600.0)


def held(*angles_deg: float) -> np.ndarray:
    """Return a rudder that is held at each angle in turn, the whole in 600 s."""
    return np.repeat(np.array(angles_deg), 600 // len(angles_deg)) * DEG


@pytest.mark.parametrize(
    ("rudder", "turned_deg", "reason"),
    [
        (held(0.0), 0.0, "no rudder order above 2°"),
        (held(1.5), 300.0, "no rudder order above 2°"),
        (held(0, 20, 0, -20, 0), 300.0, "held over .* times, but a zig-zag needs three"),
        (held(0, 0, 0, 20, 20, 20), 30.0, "the heading changes by 30° after the rudder order"),
    ],
)
def test_the_reason_names_what_the_run_lacks(
    rudder: np.ndarray, turned_deg: float, reason: str
) -> None:
    heading = turned_deg * DEG * np.clip((TIME - 300) / 200, 0, 1)
    text = reason_without_indices(rudder, heading, 1.0)
    assert "\n" not in text
    assert re.search(reason, text), text

"""Tables of an estimation."""

import numpy as np
from linear_logs import log_of

from analysis import estimate
from analysis.linear.system_file import parse_system
from analysis.report.estimate_tables import estimate_tables

SYSTEM = """
name = "speed"
[plant]
A = [[-0.1]]
states = { speed = "m/s" }
[outputs.speed]
std = 0.1
[noise]
process = { speed = 1e-4 }
[[disturbance]]
name = "head wind"
unit = "m/s2"
model = "constant"
on_state = { speed = 1.0 }
"""


def test_a_gain_that_does_not_become_constant_has_its_cause_in_place_of_poles() -> None:
    speed = np.random.default_rng(0).normal(5.0, 0.1, 200)
    table = estimate_tables(
        estimate(log_of(speed=speed), parse_system(SYSTEM, "speed.toml")).findings
    )[0]
    assert len(table.rows) == 1
    assert table.rows[0][:2] == ("kalman", "2")
    assert "a constant disturbance without an intensity" in table.remarks[-1]
    assert "the mode at 0 neither grows nor decays" in table.remarks[-1]

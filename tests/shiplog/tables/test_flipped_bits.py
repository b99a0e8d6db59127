"""No single wrong bit in a table of shiplog changes a log without a warning."""

from dataclasses import replace

import pytest
from small_logs import trial

from benchmarks.flipped_bits import FORMS, OUTCOMES, count_outcomes
from shiplog.types import Event

FLIPS = 300


@pytest.mark.parametrize("form", FORMS)
def test_no_wrong_bit_is_silent(form: str) -> None:
    counts = count_outcomes(replace(trial(), events=(Event(5, "mark"),)), form, FLIPS)
    assert counts["wrong without a warning"] == 0
    assert counts["refused"] > FLIPS / 10
    assert counts["warning"]
    assert counts.keys() <= set(OUTCOMES)

"""A trial in several files is replayed as one in a single file."""

from dataclasses import fields
from itertools import pairwise
from pathlib import Path

import numpy as np

from analysis import Analysis, analyse
from shiplog import TrialLog, read, write


def test_the_estimates_from_the_parts_of_a_trial_are_those_of_one_file(
    tmp_path: Path, zigzag_log: TrialLog, zigzag_analysis: Analysis
) -> None:
    whole = tmp_path / "whole.mcap"
    write(zigzag_log, whole)
    first, last = zigzag_log.span_ns
    bounds = np.linspace(first - 10**9, last + 10**9, 4).astype(int).tolist()
    for number, (start_ns, end_ns) in enumerate(pairwise(bounds)):
        part = read(whole, start_ns=start_ns, end_ns=end_ns)
        write(part, tmp_path / f"hour{number}.mcap")
    log = read(tmp_path / "hour*.mcap")
    assert log.warnings == ()
    divided = analyse(log)
    for of_parts, of_whole in (
        (divided.estimates, zigzag_analysis.estimates),
        (divided.disturbance, zigzag_analysis.disturbance),
    ):
        for field in fields(of_whole):
            one, other = getattr(of_parts, field.name), getattr(of_whole, field.name)
            if isinstance(other, np.ndarray):
                np.testing.assert_array_equal(one, other)

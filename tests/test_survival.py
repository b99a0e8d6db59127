"""Short versions of `python -m benchmarks.survival`: killed recorders, signals, full disks."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import PROJECT

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes cannot be forked here")

SHORT = """
import sys
from pathlib import Path
from benchmarks import survival

survival.LAST_KILL_SECS = 1.4
folder = Path(sys.argv[1])
verbs = ["record", "convert to csv"]
survival.warm_up(folder, verbs)
lost, failures = survival.kill_recordings(6, folder)
assert len(lost) == 6 and max(lost) < 1.0, (lost, failures)
for verb in verbs:
    outcomes, failures = survival.interrupt(verb, 6, folder)
    assert not failures, failures
    assert {outcome.partition(",")[0] for outcome in outcomes} == {"exit code 4"}, outcomes
    outcomes, failures = survival.fill_disk(verb, 3, folder)
    assert not failures, failures
    kept = "readable remainder" if verb == "record" else "nothing left"
    assert outcomes == {f"exit code 1, {kept}": 3}, outcomes
print("survived")
"""


def test_killed_interrupted_and_full_disks_leave_whole_files_or_readable_remainders(
    tmp_path: Path,
) -> None:
    """In a process of its own, which forks and changes its folder."""
    done = subprocess.run(
        [sys.executable, "-c", SHORT, os.fspath(tmp_path)],
        env=os.environ | {"PYTHONPATH": os.fspath(PROJECT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.endswith("survived\n"), done.stderr

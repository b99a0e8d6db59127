"""Short versions of `python -m benchmarks.survival`: killed recorders, signals, full disks."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import PROJECT

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes cannot be forked here")

SHORT = """
import signal
import sys
from pathlib import Path
from benchmarks import ended_recordings, survival

ended_recordings.MAX_SECS = 0.7
folder = Path(sys.argv[1])
verbs = ["record", "convert to csv"]
survival.make_inputs(folder)
survival.warm_up(folder, verbs)
for number in (signal.SIGKILL, signal.SIGTERM):
    lost, failures = ended_recordings.end_recordings(number, 6, folder)
    assert not failures and len(lost) == 6, (lost, failures)
assert not ended_recordings.start_together(2, folder)
for verb in verbs:
    outcomes, failures = survival.interrupt(verb, 4, folder)
    assert not failures, failures
    codes = {outcome.partition(",")[0] for outcome in outcomes}
    assert codes >= {"exit code 4", "exit code -9"}, outcomes
    outcomes, failures = survival.fill_disk(verb, 2, folder)
    assert not failures, failures
    kept = ["readable remainder"] if verb == "record" else ["nothing", "the older file"]
    assert outcomes == {f"exit code 1, {each}": 2 // len(kept) for each in kept}, outcomes
print("survived")
"""


@pytest.mark.slow
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

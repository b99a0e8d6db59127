"""Compilation beside the plan of a first replay."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import SAMPLE_DATA

from analysis.filters.factory import filter_kind, filter_names
from analysis.replay.precompile import compile_estimators, compiling_beside
from shiplog.vessel.settings import FilterSettings

AFTERWARDS = """
from shiplog.compiled import CACHE_FOLDER, is_compiled
from analysis.replay.precompile import compiling_beside
with compiling_beside("extended", smooth=False) as process:
    if process:
        assert process.wait() == 0
loops = {path.name.split(".")[0] for path in CACHE_FOLDER.rglob("*.nbi")}
print(is_compiled("analysis"), "three_state" in loops, "loop" in loops, "pseudo_input" in loops)
"""


A_REPLAY_AFTERWARDS = f"""
from analysis.disturbance.loop import observe_chunk
from analysis.filters.pseudo_input import _filter
from analysis.regression.changes import _add_to_blocks
from analysis.regression.newey_west import add_rows, window_variances
from analysis.regression.window_qr import _push_batch
from analysis.replay.precompile import compile_estimators, compile_tests, compile_windows
from analysis.replay.replay import analyse
from analysis.replay.residuals import _add_products
from shiplog.vessel.settings import FilterSettings

estimators, windows = (_filter, observe_chunk), (_push_batch,)
tests = (add_rows, window_variances, _add_to_blocks, _add_products)
compile_tests()
assert all(loop.signatures for loop in tests)
assert not any(loop.signatures for loop in (*estimators, *windows))
compile_estimators(FilterSettings())
compile_windows()
loops = (*estimators, *windows, *tests)
before = [list(loop.signatures) for loop in loops]
analyse({str(SAMPLE_DATA / "zigzag_20_20.mcap")!r})
print([list(loop.signatures) for loop in loops] == before)
"""


@pytest.mark.parametrize("name", filter_names())
def test_the_loops_of_every_filter_are_compiled_by_running_them(name: str) -> None:
    compile_estimators(FilterSettings(kind=name))
    if filter_kind(name).smoothable:
        compile_estimators(FilterSettings(kind=name, smooth=True))


def test_a_replay_compiles_no_loop_again_and_each_process_its_own() -> None:
    command = [sys.executable, "-c", A_REPLAY_AFTERWARDS]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout == "True\n", done.stderr


def test_a_second_process_compiles_the_estimators_on_a_first_run_only(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", AFTERWARDS],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["True", "True", "True", "False"]
    compile_estimators(FilterSettings())
    with compiling_beside(None, smooth=False) as process:
        assert process is None

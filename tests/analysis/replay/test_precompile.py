"""Compilation beside the plan of a first replay."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("name", filter_names())
def test_the_loops_of_every_filter_are_compiled_by_running_them(name: str) -> None:
    compile_estimators(FilterSettings(kind=name))
    if filter_kind(name).smoothable:
        compile_estimators(FilterSettings(kind=name, smooth=True))


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

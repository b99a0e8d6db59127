"""Compilation beside the plan of a first replay."""

import subprocess
import sys

import pytest
from places import SAMPLE_DATA

from analysis.filters.factory import filter_kind, filter_names
from analysis.replay import precompile
from analysis.replay.precompile import compile_estimators, compiling_beside
from shiplog.vessel.settings import FilterSettings

A_REPLAY_AFTERWARDS = f"""
from analysis.disturbance.loop import observe_chunk
from analysis.filters.filter_loop import run_filter
from analysis.regression.changes import _add_to_blocks
from analysis.regression.newey_west import add_rows, window_variances
from analysis.regression.window_qr import _push_batch
from analysis.replay.precompile import compile_estimators, compile_tests, compile_windows
from analysis.replay.replay import analyse
from analysis.replay.residuals import _add_products
from shiplog.vessel.settings import FilterSettings

estimators, windows = (run_filter, observe_chunk), (_push_batch,)
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
    if filter_kind(name).has_further_states:
        compile_estimators(FilterSettings(kind=name, sensor_bias=("auto",)))


def test_a_replay_compiles_no_loop_again_and_each_process_its_own() -> None:
    command = [sys.executable, "-c", A_REPLAY_AFTERWARDS]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout == "True\n", done.stderr


@pytest.mark.parametrize(("kind", "code"), [("extended", 0), ("no filter", 1)])
def test_on_a_first_run_a_second_process_compiles_the_loops_of_the_given_filter(
    monkeypatch: pytest.MonkeyPatch, kind: str, code: int
) -> None:
    monkeypatch.setattr(precompile, "is_compiled", lambda _: False)
    with compiling_beside(kind, smooth=False) as process:
        assert process is not None
        assert process.wait() == code


def test_a_second_process_is_ended_with_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(precompile, "is_compiled", lambda _: False)
    with compiling_beside("extended", smooth=False) as process:
        assert process is not None
    assert process.poll() is not None


def test_a_later_run_starts_no_second_process() -> None:
    compile_estimators(FilterSettings())
    with compiling_beside(None, smooth=False) as process:
        assert process is None

"""Compilation of the loops of filter, observer and windows in a second process, on a first run.

Numba compiles in one thread. On the first run on a computer the loops of the plan and of the tests
are compiled in the process of the replay, and those of the estimators and of the windows in a
second one, so that both take about as long. Both keep the machine code in the same cache.
"""

import gc
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from analysis.disturbance.observer import observe_disturbance
from analysis.filters.factory import filter_kind, filter_states
from analysis.filters.noise_model import FurtherModel, NoiseModel
from analysis.regression.changes import ChangeTest
from analysis.regression.newey_west import window_variances
from analysis.regression.sliding import fit_regression
from analysis.regression.weak_form import Equation, Rows
from analysis.regression.window_qr import empty_window, push_rows
from analysis.replay.residuals import whiteness
from shiplog.compiled import is_compiled
from shiplog.types import Signals
from shiplog.vessel.settings import FilterSettings
from shiplog.vessel.vessel_parser import load_vessel

RARE_COLLECTION = 20_000  # new objects before a search for garbage; compilation makes little
SAMPLES = 400
DT_SECS = 1.0


@contextmanager
def compiling_beside(
    kind: str | None, *, smooth: bool, sensors: bool = False
) -> Iterator[subprocess.Popen[bytes] | None]:
    """Start the compilation of the estimators' loops in a second process, on a first run.

    Parameters
    ----------
    kind
        The name of the filter; None for the default one.
    smooth
        Whether the smoother is compiled too.
    sensors
        Whether sensor errors are states of the filter.

    Yields
    ------
    process
        To be waited for before the loops are used; None where they are compiled already. It is
        ended with the context.
    """
    if is_compiled("analysis"):
        yield None
        return
    flags = ("smooth" if smooth else "", "auto" if sensors else "")
    command = [sys.executable, "-m", __name__, kind or "", *flags]
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)  # noqa: S603
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def compile_estimators(settings: FilterSettings) -> None:
    """Compile the loops of a filter and of the disturbance observer by running them once."""
    model = load_vessel("table1")[0].paper_coefficients
    time_secs = np.arange(SAMPLES) * DT_SECS
    values = {
        "yaw_rate": 1e-3 * np.sin(time_secs / 50),
        "speed": 7 + 0.1 * np.cos(time_secs / 90),
        "rudder": 0.1 * np.sin(time_secs / 50),
        "rpm": np.full(SAMPLES, 80.0),
    }
    signals = Signals(0, DT_SECS, values)
    noise = NoiseModel(np.array([1e-4, 0.1]), np.array([1e-5, 1e-5]))
    if filter_kind(settings.chosen).has_further_states and (settings.smooth or settings.sensors):
        noise = replace(noise, further=FurtherModel(sensors=("rudder",)))
    filter_states(signals, model, noise, settings)
    observe_disturbance(signals, model, noise)


def compile_windows() -> None:
    """Compile the loops of the sliding windows with fewer rows than a window, so none is solved.

    The plan compiles the solver.
    """
    rows = _example_rows()
    state = empty_window(SAMPLES, len(rows.equation.names))
    push_rows(state, rows.regressors, rows.target, rows.excitation)


def compile_tests() -> None:
    """Compile the loops of residual tests, change tests and standard errors by running them once.

    The process of the replay does so after its plan, while the second one is busy.
    """
    rows = _example_rows()
    fit_regression(rows)
    ChangeTest(rows.equation, len(rows.target)).add(rows)
    whiteness(rows.target)
    p = len(rows.equation.names)
    spans, wanted = np.zeros((1, 2), np.int64), np.zeros(1, np.bool_)
    window_variances(np.zeros((p + 1, 1)), spans, wanted, np.zeros((p, 1)), np.zeros((p, p, 1)), 1)


def _example_rows() -> Rows:
    equation = Equation(("a", "d"), 1.0, 20.0)
    time_secs = np.arange(50.0)
    X = np.column_stack((np.sin(time_secs / 25), np.cos(time_secs / 40)))
    return Rows(equation, time_secs, X[:, 0], X, X[:, 0], 0.1)


if __name__ == "__main__":
    gc.set_threshold(RARE_COLLECTION)
    kind, smooth, sensors = sys.argv[1:]
    compile_estimators(
        FilterSettings(
            kind=kind or None, smooth=bool(smooth), sensor_bias=(sensors,) if sensors else None
        )
    )
    compile_windows()

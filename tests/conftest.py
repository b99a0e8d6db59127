import gc
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from math import radians
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported: small matrices

import pytest
from places import RECORDINGS, SAMPLE_DATA
from trial_logs import as_log

from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from shiplog import TrialLog, Vessel, load_vessel, read
from shiplog.cli.main import RARE_COLLECTION
from shiplog.compiled import is_compiled

# nohup and scripts in the background ignore these, and so would all processes of the tests
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
# as in the processes of the verbs: collecting tests and compiling loops make little garbage
gc.set_threshold(RARE_COLLECTION)


IN_MEMORY = Path("/dev/shm")  # noqa: S108 - pytest makes a folder of the user's own there
MIN_FREE_BYTES = 4 << 30  # of which the tests use a tenth


def pytest_configure(config: pytest.Config) -> None:
    """Prepare a run: the files of the tests are in memory where the system has a folder for that.

    A file that is written over, as by tests of damaged files, waits on a disk each time for its
    last content to be written. Of a run of all tests the loops of a replay are compiled once,
    before the workers would each compile them.
    """
    if os.access(IN_MEMORY, os.W_OK) and shutil.disk_usage(IN_MEMORY).free > MIN_FREE_BYTES:
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", os.fspath(IN_MEMORY))
    is_worker, chosen = hasattr(config, "workerinput"), pytest.Config.ArgsSource.ARGS
    if is_worker or config.args_source is chosen or is_compiled("analysis"):
        return
    command = [sys.executable, "-m", "shiplog", "replay", SAMPLE_DATA / "zigzag_20_20.mcap"]
    quiet = subprocess.DEVNULL
    subprocess.run([*command, "-o", os.devnull], stdout=quiet, stderr=quiet, check=False)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files that take longest first, so that parallel workers end at about one time.

    These are the tests of whole programs, beside this file, and those of identification.
    """
    root = Path(__file__).parent
    items.sort(key=lambda item: (item.path.parent != root, "identification" not in item.path.parts))


def pytest_collection_finish() -> None:
    """Except the collected tests and the imported modules from all searches for garbage."""
    gc.freeze()


@pytest.fixture(scope="session")
def recordings() -> Path:
    """Return the folder of the real recordings; skip the test where it does not exist."""
    if not RECORDINGS.is_dir():
        pytest.skip(f"the real recordings are not here: {RECORDINGS}")
    return RECORDINGS


@pytest.fixture
def fit_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `identify` omit the histories by other methods, which take longer than the fit.

    For tests of the fit and of what follows from it.
    """
    monkeypatch.setattr("analysis.identification.identify._histories", lambda *_: ())


@pytest.fixture(scope="session")
def vessel() -> Vessel:
    """Return the paper's ship, Table 1 in degrees."""
    return load_vessel("table1")[0]


@pytest.fixture(scope="session")
def zigzag() -> SimulatedTrial:
    """Return a 20/20 zigzag of the paper's ship with the paper's noise."""
    vessel, text = load_vessel("table1")
    return simulate(
        vessel,
        "zigzag-20-20",
        duration_secs=500.0,
        seed=11,
        sensors=suite("paper"),
        vessel_toml=text,
    )


@pytest.fixture(scope="session")
def zigzag_log(zigzag: SimulatedTrial) -> TrialLog:
    """Return the zigzag as a log in memory."""
    return as_log(zigzag, "zigzag.mcap")


@pytest.fixture(scope="session")
def zigzag_analysis(zigzag_log: TrialLog) -> Analysis:
    """Return the replay of the zigzag, computed once."""
    return analyse(zigzag_log)


@pytest.fixture(scope="session")
def sensor_analysis() -> Analysis:
    """Return the smoothed replay of a turning circle, whose gyro has a bias of 0.02 deg/s."""
    log = read(SAMPLE_DATA / "turning_circle_35.mcap").between(0, 300)
    gyro = log["yaw_rate"]
    biased = replace(gyro, values=gyro.values + radians(0.02))
    channels = (biased, *(channel for channel in log if channel is not gyro))
    settings = {"filter.kind": "extended", "filter.smooth": True, "filter.sensor_bias": "auto"}
    return analyse(replace(log, channels=channels), settings=settings)

"""The trial that is measured: simulated, so that anyone can have it."""

from pathlib import Path

from recorders.sensors import suite
from recorders.simulate import simulate
from shiplog import TrialLog, load_vessel, write


def day_of_trial(hours: float) -> TrialLog:
    """Four channels at 10 Hz: a zig-zag that goes on for so long."""
    vessel, text = load_vessel("table1")
    sensors = {
        name: sensor
        for name, sensor in suite("paper").items()
        if name in ("yaw_rate", "speed", "rudder", "rpm")
    }
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=3600 * hours, seed=1, sensors=sensors,
        vessel_toml=text,
    )  # fmt: skip
    return TrialLog("day.mcap", trial.channels, trial.metadata, trial.vessel_toml)


def as_written(log: TrialLog, path: Path) -> Path:
    """The log in a file."""
    write(log, path)
    return path

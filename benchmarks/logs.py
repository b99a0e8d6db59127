"""The trial that is measured: simulated, so that anyone can have it, and as long as is asked."""

import shutil
from dataclasses import replace
from pathlib import Path

from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import Channel, LogWriter, TrialLog, load_vessel
from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS

from .measure import SkippedError

NAMES = (*PAPER_OUTPUTS, *PAPER_INPUTS)
RATE_HZ = 10.0
_BYTES_PER_HOUR = 4.4e6  # of such a log; a little more than it takes
_CHUNK_SECS = 3600.0  # of a log that is written piece by piece


def day_of_trial(hours: float) -> TrialLog:
    """Four channels at 10 Hz: a zig-zag that goes on for so long."""
    vessel, text = load_vessel("table1")
    sensors = {name: sensor for name, sensor in suite("paper").items() if name in NAMES}
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=3600 * hours, seed=1, sensors=sensors,
        vessel_toml=text,
    )  # fmt: skip
    return TrialLog("day.mcap", trial.channels, trial.metadata, trial.vessel_toml)


def write_repeated(day: TrialLog, hours: float, path: Path) -> Path:
    """A log of so many hours: the day again and again, its times shifted.

    Written in pieces, so that its length does not show in the memory taken.
    """
    length = len(day["yaw_rate"]) - 1  # the last sample of a day is the first of the next
    chunk, whole = int(_CHUNK_SECS * RATE_HZ), round(3600 * hours * RATE_HZ)
    period_ns = round(length / RATE_HZ * 1e9)
    with LogWriter(path, metadata=day.metadata, vessel_toml=day.vessel_toml) as writer:
        at = 0
        while at < whole:
            days, first = divmod(at, length)
            count = min(chunk, length - first, whole - at)
            writer.write(*(_part(channel, first, count, days * period_ns) for channel in day))
            at += count
    return path


def _part(channel: Channel, first: int, count: int, later_ns: int) -> Channel:
    part = channel.part(first, first + count)
    return replace(
        part, measured_ns=part.measured_ns + later_ns, received_ns=part.received_ns + later_ns
    )


def require_room(folder: Path, hours: float) -> None:
    """Skip a log for which the disk is too small."""
    needed, free = 1.5 * _BYTES_PER_HOUR * hours, shutil.disk_usage(folder).free
    if needed > free:
        raise SkippedError(f"{needed / 1e9:.1f} GB needed on disk, {free / 1e9:.1f} GB free")

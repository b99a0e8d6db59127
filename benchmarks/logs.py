"""The simulated trial that is measured, written to logs of any length."""

import shutil
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import Channel, LogWriter, TrialLog, load_vessel
from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS

from .measure import SkippedError

NAMES = (*PAPER_OUTPUTS, *PAPER_INPUTS)
RATE_HZ = 10.0
LOG_BYTES_PER_HOUR = 4.4e6  # a little more than such a log takes
WRITTEN_CHUNK_SECS = 3600.0


def day_of_trial(
    hours: float, manoeuvre: str = "zigzag-20-20", channels: Collection[str] = NAMES
) -> TrialLog:
    """Simulate a trial of the given length, by default a zig-zag with four channels at 10 Hz.

    Anyone can produce the same log: the ship is the preset `table1`, the seed is 1.
    """
    vessel, text = load_vessel("table1")
    sensors = {name: sensor for name, sensor in suite("paper").items() if name in channels}
    trial = simulate(
        vessel, manoeuvre, duration_secs=3600 * hours, seed=1, sensors=sensors, vessel_toml=text
    )
    return TrialLog("day.mcap", trial.channels, trial.metadata, trial.vessel_toml)


def write_repeated(day: TrialLog, hours: float, path: Path) -> Path:
    """Write a log of the given length: the day again and again, its times shifted.

    It is written in chunks, so that the memory taken does not depend on the length.
    """
    length = len(day["yaw_rate"]) - 1  # the last sample of a day is the first of the next
    chunk, whole = int(WRITTEN_CHUNK_SECS * RATE_HZ), round(3600 * hours * RATE_HZ)
    period_ns = round(length / RATE_HZ * 1e9)
    with LogWriter(path, metadata=day.metadata, vessel_toml=day.vessel_toml) as writer:
        at = 0
        while at < whole:
            days, first = divmod(at, length)
            count = min(chunk, length - first, whole - at)
            writer.write(*(_shifted(channel, first, count, days * period_ns) for channel in day))
            at += count
    return path


def _shifted(channel: Channel, first: int, count: int, later_ns: int) -> Channel:
    part = channel.part(first, first + count)
    return replace(
        part, measured_ns=part.measured_ns + later_ns, received_ns=part.received_ns + later_ns
    )


def require_disk_space(folder: Path, hours: float) -> None:
    """Raise `SkippedError` if the disk is too small for a log of the given length."""
    needed, free = 1.5 * LOG_BYTES_PER_HOUR * hours, shutil.disk_usage(folder).free
    if needed > free:
        raise SkippedError(f"{needed / 1e9:.1f} GB needed on disk, {free / 1e9:.1f} GB free")

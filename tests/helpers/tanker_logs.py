"""The model tests of the tanker KVLCC2 as logs, each read once by the tests of a process."""

from functools import cache
from pathlib import Path

from places import LAYOUTS

from shiplog import TrialLog
from shiplog.layouts.layout import load_layout
from shiplog.tables.foreign import read_table


@cache
def tanker_log(run: Path) -> TrialLog:
    """Return a run of `places.KVLCC2`, in the folder of its laboratory, at model scale."""
    return read_table(run, load_layout(LAYOUTS / f"simman_{run.parent.name}.toml"))

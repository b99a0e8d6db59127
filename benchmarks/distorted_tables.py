"""Distortions by a wrong layout: the trial as another program's table, read with one line wrong."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from shiplog import TrialLog
from shiplog.layouts.layout_parser import parse_layout
from shiplog.tables.foreign import read_table
from shiplog.types import FloatArray, TimeArray

from .distorted_values import DEG, KNOT
from .distortion import Distortion, geographic

STEP_NS = 200_000_000  # from row to row; the heading is known in two of five rows, a fix in one
LAYOUT = """
header = true
[time]
column = "time"
unit = "s"
zone = "UTC"
[yaw_rate]
column = "rot"
unit = "deg/min"
[speed]
column = "stw"
unit = "kn"
[rudder]
column = "rud"
unit = "deg"
[rpm]
column = "shaft"
unit = "rpm"
[heading]
column = "hdt"
unit = "deg"
[position]
latitude = "lat"
longitude = "lon"
unit = "deg"
"""


@dataclass(frozen=True)
class Print:
    """How a table is printed.

    Attributes
    ----------
    times
        A function that prints times, (n,) ns.
    degrees_minutes
        Whether positions are printed as ddmm.mmmm.
    """

    times: Callable[[TimeArray], list[str]]
    degrees_minutes: bool = False


def iso_times(shift_hours: float = 0.0, end: str = "") -> Callable[[TimeArray], list[str]]:
    """Return a function that prints times as ISO 8601: local ones, and the text of their offset."""
    shift_ns = np.int64(shift_hours * 3600e9)
    return lambda times: [
        f"{text}{end}"
        for text in np.datetime_as_string((times + shift_ns).astype("datetime64[ns]"), "ms")
    ]


def seconds(times: TimeArray) -> list[str]:
    """Print times as seconds since 1970."""
    return [f"{ns // 10**9}.{ns % 10**9 // 10**6:03d}" for ns in times.tolist()]


def table_distortions() -> list[Distortion]:
    """Return the layouts in which a unit, a sign, a column, a position or the time is wrong."""
    utc, local = Print(iso_times()), Print(iso_times(2.0))
    cases = (
        # name, words of the cause, print, lines of the layout and what stands in their place
        ("yaw rate in deg/min read as deg/s", "yaw_rate deg/min", utc,
         ('unit = "deg/min"', 'unit = "deg/s"')),
        ("speed in kn read as m/s", "speed kn", utc, ('unit = "kn"', 'unit = "m/s"')),
        ("rudder in deg read as rad", "rudder deg", utc,
         ('column = "rud"\nunit = "deg"', 'column = "rud"\nunit = "rad"')),
        ("heading in deg read as rad", "heading deg", utc,
         ('column = "hdt"\nunit = "deg"', 'column = "hdt"\nunit = "rad"')),
        ("rpm read as rev/s", "rpm unit", utc, ('unit = "rpm"', 'unit = "Hz"')),
        ("sign of the rudder", "rudder sign", utc,
         ('column = "rud"', 'column = "rud"\nsign = -1')),
        ("sign of the yaw rate", "yaw_rate sign", utc,
         ('column = "rot"', 'column = "rot"\nsign = -1')),
        ("sense of the heading", "heading sense", utc,
         ('column = "hdt"', 'column = "hdt"\nsign = -1')),
        ("local times without a zone", "no time zone", local, ('zone = "UTC"\n', "")),
        ("a zone that the times contradict", "zone", Print(iso_times(2.0, "+02:00")),
         ('zone = "UTC"', 'zone = "Asia/Tokyo"')),
        ("times in s read as ms", "time unit", Print(seconds), ('unit = "s"', 'unit = "ms"')),
        ("times in s read as min", "time unit", Print(seconds), ('unit = "s"', 'unit = "min"')),
        ("columns of rudder and yaw rate exchanged", "yaw_rate column", utc,
         ('"rot"', '"x"', '"rud"', '"rot"', '"x"', '"rud"')),
        ("column of the heading as that of the rudder", "rudder", utc, ('"rud"', '"hdt"')),
        ("column of the rpm as that of the speed", "speed", utc, ('"stw"', '"shaft"')),
        ("column of the speed as that of the rpm", "rpm", utc, ('"shaft"', '"stw"')),
        ("columns of latitude and longitude exchanged", "position", utc,
         ('"lat"', '"x"', '"lon"', '"lat"', '"x"', '"lon"')),
        ("ddmm.mmmm read as deg", "position", Print(iso_times(), degrees_minutes=True), ()),
    )  # fmt: skip
    return [
        Distortion("table", name, (cause,), _as_table(form, _replaced(*changes)))
        for name, cause, form, changes in cases
    ]


def _replaced(*texts: str) -> str:
    """Return the layout with texts replaced by others: each text and its replacement in turn."""
    layout = LAYOUT
    for old, new in zip(texts[::2], texts[1::2], strict=True):
        if old not in layout:
            raise ValueError(f"the layout has no line {old!r}")
        layout = layout.replace(old, new, 1)
    return layout


def _as_table(form: Print, layout: str) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that prints the log as a table and reads that by the layout."""

    def apply(log: TrialLog) -> TrialLog:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "trial.csv"
            path.write_text(_table(geographic()(log), form), encoding="utf-8")
            return read_table(path, parse_layout(layout, "layout.toml"))

    return apply


def _table(log: TrialLog, form: Print) -> str:
    """Print a log as a table of comma-separated values; cells are empty without a sample."""
    rate = log["yaw_rate"]
    first = rate.measured_ns[0]
    rows = (rate.measured_ns - first) // STEP_NS
    times = first + STEP_NS * rows
    columns = {
        "time": form.times(times),
        "rot": _cells(log, "yaw_rate", times, 3, 60 / DEG),
        "stw": _cells(log, "speed", times, 3, 1 / KNOT),
        "rud": _cells(log, "rudder", times, 2, 1 / DEG),
        "shaft": _cells(log, "rpm", times, 1),
        "hdt": _cells(log, "heading", times, 2, 1 / DEG),
    }
    for i, name in enumerate(("lat", "lon")):
        degrees = log["position"].values[:, i]
        if form.degrees_minutes:
            degrees = 100 * np.trunc(degrees) + 60 * (degrees - np.trunc(degrees))
        columns[name] = _cells(log, "position", times, 7, values=degrees)
    lines = (",".join(cells) for cells in zip(*columns.values(), strict=True))
    return "\n".join((",".join(columns), *lines)) + "\n"


def _cells(
    log: TrialLog,
    name: str,
    times: TimeArray,
    digits: int,
    factor: float = 1.0,
    values: FloatArray | None = None,
) -> list[str]:
    """Print the samples of a channel in the rows of their times."""
    channel = log[name]
    values = channel.values if values is None else values
    row = dict(zip(channel.measured_ns.tolist(), (values * factor).tolist(), strict=True))
    return [f"{row[ns]:.{digits}f}" if ns in row else "" for ns in times.tolist()]

"""CSV for spreadsheets and other programs: wide or long, with the unit in each header or row.

It has no header of shiplog, and no checksum; `csv_form` is what can be read back without loss.
"""

import csv
import os
from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan

from shiplog.files import atomic_write
from shiplog.types import Channel, TimeArray, TrialLog
from shiplog.units import GEOGRAPHIC, display_conversion

from .csv_form import cell_text
from .wide import wide_table

TIME_COLUMNS = ("time (UTC)", "elapsed [s]")
LONG_COLUMNS = (*TIME_COLUMNS, "channel", "source", "component", "value", "unit")
DIGITS = 10  # of a value in the units people use; others have all


@dataclass(frozen=True)
class CsvShape:
    """The shape of a plain CSV.

    Attributes
    ----------
    wide
        One row per instant of a uniform clock and one column per quantity, as
        `TrialLog.to_pandas`; otherwise one row per sample and component.
    display_units
        Whether values are in the units people use, such as deg and kn, instead of SI and radians.
    """

    wide: bool = False
    display_units: bool = False


def write_plain_csv(log: TrialLog, path: str | os.PathLike[str], shape: CsvShape) -> None:
    """Write a trial as CSV that any program reads: a row of headers, then values.

    Times are in UTC and in s since the first row; what was not measured is an empty cell. If
    writing fails, a file that was there before is kept.

    Parameters
    ----------
    log
        The trial.
    path
        File to write.
    shape
        Whether it is wide or long, and its units.

    Raises
    ------
    LogError
        The log cannot be resampled to the wide form.
    """
    rows = (_wide_rows if shape.wide else _long_rows)(log, display_units=shape.display_units)
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows(rows)


def _wide_rows(log: TrialLog, *, display_units: bool) -> Iterator[list[str]]:
    table = wide_table(log, display_units=display_units)
    names = [f"{_column_name(key)} [{table.units[key]}]" for key in table.columns]
    yield [*TIME_COLUMNS, *map(cell_text, names)]
    columns = [_texts(values.tolist(), display_units) for values in table.columns.values()]
    start_ns = int(table.timestamps_ns[0])
    for times, *values in zip(_times(table.timestamps_ns, start_ns), *columns, strict=True):
        yield [*times, *values]


def _column_name(key: str) -> str:
    """Return the name of a column; a latitude is called so, by which other programs find it."""
    plain = key.removeprefix("position_")
    return plain if plain.partition("/")[0] in GEOGRAPHIC else key


def _long_rows(log: TrialLog, *, display_units: bool) -> Iterator[list[str]]:
    yield list(LONG_COLUMNS)
    start_ns = log.span_ns[0]
    for channel in log:
        for number, component in enumerate(channel.fields or ("",)):
            unit, factor = _shown(channel, component, display_units)
            head = [cell_text(channel.name), cell_text(channel.source), component]
            values = channel.values.reshape(len(channel), -1)[:, number] * factor
            texts = _texts(values.tolist(), display_units)
            for times, text in zip(_times(channel.measured_ns, start_ns), texts, strict=True):
                yield [*times, *head, text, cell_text(unit)]


def _shown(channel: Channel, component: str, display_units: bool) -> tuple[str, float]:
    """Return the unit of a component of a channel, and the factor to it."""
    if channel.fields == GEOGRAPHIC and component == "altitude":
        return "m", 1.0
    return display_conversion(channel.name, channel.unit) if display_units else (channel.unit, 1.0)


def _times(times_ns: TimeArray, start_ns: int) -> Iterator[list[str]]:
    """Yield each time in UTC with microseconds, and the time since the start."""
    for stamp, since in zip(
        times_ns.astype("M8[ns]").astype("M8[us]"), (times_ns - start_ns) * 1e-9, strict=True
    ):
        yield [f"{stamp}Z", f"{since:.6f}"]


def _texts(values: list[float], display_units: bool) -> Iterator[str]:
    """Yield the texts of values, rounded in the units people use; NaN is empty."""
    for value in values:
        if isnan(value):
            yield ""
        else:
            yield f"{value:.{DIGITS}g}" if display_units else repr(value)

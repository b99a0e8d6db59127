"""Wide tables of a trial: one row per instant of a uniform clock, one column per quantity.

The long form of `shiplog.tables.long_form` keeps every sample and every time stamp, for storage.
The wide form is resampled, for analysis and plots in pandas and xarray.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from shiplog.checks.log_stats import compute_log_stats
from shiplog.errors import LogError, UsageError
from shiplog.resampling import MAX_INSTANTS, Clock, resample_chunks
from shiplog.types import Channel, FloatArray, TimeArray, TrialLog, concatenate_signals
from shiplog.units import GEOGRAPHIC, display_conversion

if TYPE_CHECKING:  # only what makes a frame or a dataset waits for these libraries
    import pandas as pd
    import xarray as xr


@dataclass(frozen=True, eq=False)
class WideTable:
    """Quantities of a trial on one uniform clock.

    Attributes
    ----------
    timestamps_ns
        (n,) nanoseconds since 1970-01-01 UTC.
    columns
        Values of each column, (n,); NaN where nothing was measured.
    units
        Unit of each column.
    """

    timestamps_ns: TimeArray
    columns: dict[str, FloatArray]
    units: dict[str, str]


def wide_table(
    log: TrialLog, dt_secs: float | None = None, *, display_units: bool = False
) -> WideTable:
    """Resample every quantity of a trial to one uniform clock.

    The clock runs from the first valid sample of any channel to the last one. Measured quantities
    (yaw rate, speed) are averaged over the samples nearest to each instant and are NaN where there
    is none; commanded ones (rudder, rpm) and the heading are interpolated, but not across a gap.
    The components of a position become columns of their own, such as `position_north`. A second
    source of a quantity has its source in the column's name, such as `yaw_rate/mems`. Channels
    with fewer than two valid samples are omitted.

    Parameters
    ----------
    log
        The trial.
    dt_secs
        Step of the clock in s; by default the sampling interval of the fastest channel.
    display_units
        Convert to the units people use (`deg/s`, `deg`, `kn`) instead of SI and radians.

    Raises
    ------
    LogError
        No channel can be resampled, or the recorded times span too many steps.
    UsageError
        `dt_secs` is not a positive number.

    Examples
    --------
    >>> import shiplog
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
    >>> table = wide_table(log, dt_secs=1.0, display_units=True)
    >>> len(table.timestamps_ns), table.units["speed"]
    (601, 'kn')
    """
    columns = dict(_scalar_columns(log))
    scalars = TrialLog(log.name, tuple(columns.values()))
    stats = compute_log_stats(scalars)
    usable = {
        key: channel
        for key, channel in zip(columns, stats, strict=True)
        if channel.hold or (channel.valid > 1 and channel.interval_secs > 0)
    }
    if not usable:
        raise LogError(f"no channel with two valid samples or more in {log.name}; check the log")
    sampled = [c for c in usable.values() if not c.hold] or list(usable.values())
    dt = min(c.interval_secs for c in sampled) if dt_secs is None else dt_secs
    if not 0 < dt < np.inf:
        raise UsageError(f"dt_secs must be a positive number of seconds, got {dt}")
    start_ns = min(channel.valid_span_ns[0] for channel in usable.values())
    end_ns = max(channel.valid_span_ns[1] for channel in usable.values())
    count = int((end_ns - start_ns) * 1e-9 / dt + 1e-6) + 1
    if count > MAX_INSTANTS:
        raise LogError(
            f"the times of {log.name} span {(end_ns - start_ns) / 8.64e13:.4g} days, "
            f"{count} steps of {dt:g} s; give a larger dt_secs or correct the clocks"
        )
    clock = Clock(start_ns, dt, count, usable)
    signals = concatenate_signals(resample_chunks(scalars.chunks(), clock))
    units = {key: columns[key].unit for key in usable}
    values = {key: np.array(signals[key]) for key in usable}
    if display_units:
        for key in usable:
            units[key], factor = display_conversion(columns[key].name, units[key])
            values[key] *= factor
    return WideTable(signals.timestamps_ns, values, units)


def to_wide_frame(
    log: TrialLog, dt_secs: float | None = None, *, display_units: bool = False
) -> "pd.DataFrame":
    """Make a data frame of a `wide_table`; `TrialLog.to_pandas` is the method for users.

    Parameters
    ----------
    log, dt_secs, display_units
        As those of `wide_table`.

    Returns
    -------
    pandas.DataFrame
        (n, k) with the time in UTC as index. With `display_units` the names of the columns have
        the unit, such as `speed [kn]`; `attrs["units"]` has the unit of each column.
    """
    import pandas as pd  # noqa: PLC0415 - slow to import

    table = wide_table(log, dt_secs, display_units=display_units)
    names = [f"{key} [{table.units[key]}]" if display_units else key for key in table.columns]
    index = pd.to_datetime(table.timestamps_ns, unit="ns", utc=True).rename("time")
    frame = pd.DataFrame(dict(zip(names, table.columns.values(), strict=True)), index=index)
    frame.attrs["units"] = dict(zip(names, table.units.values(), strict=True))
    return frame


def to_dataset(log: TrialLog, dt_secs: float | None = None) -> "xr.Dataset":
    """Make an xarray dataset of a `wide_table`; `TrialLog.to_xarray` is the method for users.

    Parameters
    ----------
    log, dt_secs
        As those of `wide_table`.

    Returns
    -------
    xarray.Dataset
        Variables of (n,) along the coordinate `time` in UTC, each with its unit in `attrs`.

    Raises
    ------
    UsageError
        The package xarray is not installed.
    """
    try:
        import xarray as xr  # noqa: PLC0415 - optional
    except ImportError as error:
        raise UsageError(
            "to_xarray needs xarray, which is not installed; pip install 'shiplog[xarray]'"
        ) from error
    table = wide_table(log, dt_secs)
    variables = {
        key: ("time", values, {"units": table.units[key]}) for key, values in table.columns.items()
    }
    return xr.Dataset(variables, {"time": table.timestamps_ns.astype("datetime64[ns]")})


def _scalar_columns(log: TrialLog) -> Iterator[tuple[str, Channel]]:
    """Channels of one value per sample, each with the name of its column."""
    taken: set[str] = set()
    for channel in log:
        for number, field in enumerate(channel.fields or ("",)):
            name = f"{channel.name}_{field}" if field else channel.name
            key = f"{name}/{channel.source}" if name in taken else name
            taken.add(key)
            if field:
                values = channel.values[:, number]
                unit = "m" if channel.fields == GEOGRAPHIC and field == "altitude" else channel.unit
                stamps = channel.measured_ns, channel.received_ns
                yield key, Channel(name, channel.source, unit, *stamps, values)
            else:
                yield key, channel

"""Foreign tables: any delimited text, read as its layout says."""

import csv
import os
from dataclasses import dataclass, field
from math import sqrt
from pathlib import Path

import numpy as np

from shiplog.errors import LayoutError
from shiplog.types import Channel, FloatArray, TimeArray, TrialLog
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor, did_you_mean

from .layout import DELIMITERS, ROLES, VELOCITIES, Layout

CORRECTION_SECS = 200.0  # a rebuilt heading follows the printed one no faster than this
LAST_NS = 2**63 - 1


@dataclass(frozen=True)
class _Table:
    """The cells of a text, and on which line each row stands."""

    path: Path
    lines: list[int]
    rows: list[list[str]]
    header: list[str] = field(default_factory=list)


def read_table(path: str | os.PathLike[str], layout: Layout) -> TrialLog:
    """Read a foreign table as its layout says, in SI units and full scale.

    A cell that is empty or says `nan` was not measured. Each channel has the table's times.

    Raises `LayoutError`, naming the line, where the text does not fit the layout: a cell that
    is no number, an infinite one, a row of another length, times that run backwards.
    """
    table = _split(Path(path), layout)
    values = {role: _numbers(table, layout, role) for role in layout.columns}
    measured_ns = _stamps(table, layout, values.pop("time"))
    notes: dict[str, dict[str, str]] = {}
    if "heading" in layout.rebuild:
        time_secs = (measured_ns - measured_ns[0]) * 1e-9
        values["heading"] = rebuilt_heading(time_secs, values["heading"], values["yaw_rate"])
        notes["heading"] = {"rebuilt": "integral of yaw_rate, slowly corrected to the printed one"}
    if "velocity_north" in values:
        _turn_velocities(values, notes)
    channels = []
    for name, kind in CATALOGUE.items():
        fields: tuple[str, ...] = ()
        unit = kind.unit
        if name == "position":
            fields, unit = _position_fields(values)
            values |= {name: np.column_stack([values[f] for f in fields])} if fields else {}
        if name in values:
            channels.append(
                Channel(
                    name, layout.source, unit, measured_ns, measured_ns, values[name], fields,
                    notes.get(name, {}),
                )
            )  # fmt: skip
    metadata = {"converted_from": table.path.name, "layout": layout.name}
    if layout.froude_scale != 1:
        metadata["froude_scale"] = repr(float(layout.froude_scale))
    return TrialLog(table.path.name, tuple(channels), metadata)


def _split(path: Path, layout: Layout) -> _Table:
    """The table's cells, blank lines left out, every row as long as the first."""
    lines = _text(path, layout).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    delimiter = DELIMITERS[layout.delimiter]
    body = lines[layout.skip_rows :]
    numbers: list[int] = []
    rows: list[list[str]] = []
    if delimiter is None:
        cells = [(number, line.split()) for number, line in enumerate(body, 1)]
    else:
        reader = csv.reader(body, delimiter=delimiter, skipinitialspace=True)
        try:
            cells = [(reader.line_num, row) for row in reader]
        except csv.Error as error:
            at = layout.skip_rows + reader.line_num
            raise LayoutError(f"line {at} cannot be split ({error}); mend it: {path}") from error
    for number, row in cells:
        if any(row) and any(map(str.strip, row)):
            numbers.append(number + layout.skip_rows)
            rows.append(row)
    header = [name.strip() for name in rows.pop(0)] if layout.header and rows else []
    first = numbers.pop(0) if header else None
    if not rows:
        raise LayoutError(f"no rows of numbers after line {layout.skip_rows}: {path}")
    width, of = (len(header), first) if header else (len(rows[0]), numbers[0])
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != width:
            raise LayoutError(
                f"line {number} has {len(row)} columns where line {of} has {width}; "
                f"mend the line, or the delimiter or skip_rows of {layout.where}: {path}"
            )
    return _Table(path, numbers, rows, header)


def _text(path: Path, layout: Layout) -> str:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise LayoutError(f"no such file: {path}") from None
    except OSError as error:
        raise LayoutError(
            f"cannot read: {(error.strerror or str(error)).lower()}: {path}"
        ) from error
    try:
        return data.decode(layout.encoding).removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise LayoutError(
            f"line {line} is not {layout.encoding}; give the encoding (cp1252 is common) in "
            f"{layout.where}: {path}"
        ) from error


def _numbers(table: _Table, layout: Layout, role: str) -> FloatArray:
    """A role's column, (n,), in SI units, signed, at full scale; NaN where a cell is empty."""
    column = layout.columns[role]
    at = _index(table, layout, role)
    texts = [row[at] for row in table.rows]
    try:
        values = np.array([_number(text, layout.decimal_comma) for text in texts])
    except ValueError as error:
        row = next(i for i, text in enumerate(texts) if text == str(error))
        raise LayoutError(
            f"line {table.lines[row]}, column {at + 1}: {texts[row]!r} is not a number; "
            f"mend the cell (empty or nan: not measured) or {layout.where}: {table.path}"
        ) from None
    si = _si_unit(role)
    scale = conversion_factor(column.unit, si) if role not in GEOGRAPHIC else 1.0
    bad = ~np.isfinite(values) if role == "time" else np.isinf(values)
    if np.any(bad):
        row = int(np.argmax(bad))
        what = "has no time" if np.isnan(values[row]) else f"has an infinite {role}"
        raise LayoutError(
            f"line {table.lines[row]} {what} (column {column.place}: {table.rows[row][at]!r}); "
            f"mend it or take the line out: {table.path}"
        )
    return values * (column.sign * scale * _froude(si, layout.froude_scale))


def _number(text: str, decimal_comma: bool) -> float:
    """The number of a cell, NaN of an empty one; `ValueError` with the text where it is none."""
    plain = text
    if decimal_comma:
        plain = text.replace(",", ".") if "." not in text else "both"
    try:
        if "_" in plain:  # which Python, but no logger, writes inside a number
            raise ValueError
        return float(plain) if plain else np.nan
    except ValueError:
        if not text.strip():
            return np.nan
        raise ValueError(text) from None


def _index(table: _Table, layout: Layout, role: str) -> int:
    """Where a role's column stands in a row, from 0."""
    place = layout.columns[role].place
    if isinstance(place, str):
        if table.header.count(place) == 1:
            return table.header.index(place)
        fault = "no column" if place not in table.header else "more than one column"
        raise LayoutError(
            f"{fault} is headed {place!r}{did_you_mean(place, table.header)}; "
            f"{layout.where} needs it for {role}: {table.path}"
        )
    width = len(table.rows[0])
    if place > width:
        raise LayoutError(
            f"line {table.lines[0]} has {width} columns, but {role} is to be column {place}; "
            f"mend the column or the delimiter of {layout.where}: {table.path}"
        )
    return place - 1


def _si_unit(role: str) -> str:
    return ROLES.get(role, "rad" if role in GEOGRAPHIC[:2] else "m")


def _froude(si: str, scale: float) -> float:
    """From model to ship at equal Froude number: lengths grow as `scale`, times as its root."""
    root = sqrt(scale)
    return {"m": scale, "s": root, "m/s": root, "rad/s": 1 / root, "rpm": 1 / root}.get(si, 1.0)


def _stamps(table: _Table, layout: Layout, printed: FloatArray) -> TimeArray:
    """Nanoseconds since 1970, (n,), of the printed times in seconds."""
    back = np.flatnonzero(np.diff(printed) < 0)
    if len(back):
        raise LayoutError(
            f"the time runs backwards at line {table.lines[back[0] + 1]}; "
            f"put the lines in the order of time, or cut the table there: {table.path}"
        )
    if "time" in layout.rebuild:
        printed, wrong = uniform_times(printed)
        if wrong is not None:
            raise LayoutError(
                f"the times are not uniform, which shows at line {table.lines[wrong]}; "
                f"take time.rebuild out of {layout.where}: {table.path}"
            )
    wide = np.round(printed * 1e9) + float(layout.start_ns)
    outside = (wide < 0) | (wide >= LAST_NS)
    if np.any(outside):
        raise LayoutError(
            f"line {table.lines[int(np.argmax(outside))]} is before 1970 or after 2262; "
            f"mend the time's unit or `start` in {layout.where}: {table.path}"
        )
    return np.round(printed * 1e9).astype(np.int64) + layout.start_ns


def uniform_times(printed: FloatArray) -> tuple[FloatArray, int | None]:
    """The uniform times (n,) that were printed rounded, and the first row that contradicts them.

    A straight line is fitted to the middles of the runs of equal print, which lie within half a
    step of the truth however coarse the print is; Huber's weights keep the few that do not, where
    the print changes its number of digits, from mattering.
    """
    rows = np.arange(len(printed), dtype=np.float64)
    starts = np.flatnonzero(np.diff(printed, prepend=-np.inf))
    ends = np.append(starts[1:], len(printed))
    middles, values = (starts + ends - 1) / 2, printed[starts]
    if len(starts) > 4:  # the first and the last run may have been cut
        middles, values = middles[1:-1], values[1:-1]
    if len(middles) < 2:
        return printed, 0 if len(printed) > 1 else None
    half = len(middles) // 2
    step = float(np.median((values[half:] - values[: len(values) - half])
                           / (middles[half:] - middles[: len(middles) - half])))  # fmt: skip
    zero = float(np.median(values - step * middles))
    for _ in range(20):
        off = np.abs(values - zero - step * middles)
        width = 1.345 * 1.4826 * float(np.median(off)) + 1e-9 * step
        weights = np.sqrt(np.minimum(1.0, width / np.maximum(off, width)))
        step, zero = np.polyfit(middles, values, 1, w=weights)
    times = zero + step * rows
    spacing = np.diff(printed[starts], prepend=printed[0], append=printed[-1])
    print_step = np.repeat(np.maximum(spacing[:-1], spacing[1:]), ends - starts)
    wrong = np.abs(times - printed) > 0.5 * print_step + step
    return times, int(np.argmax(wrong)) if np.any(wrong) else None


def rebuilt_heading(time_secs: FloatArray, printed: FloatArray, yaw_rate: FloatArray) -> FloatArray:
    """The heading in rad, (n,), from the yaw rate, in the long run as it was printed.

    Its fine course is the integral of the yaw rate; the printed heading corrects, by a least
    squares spline of a knot every `CORRECTION_SECS`, what a gyro's bias adds up to. The yaw rate
    itself stays as it was measured. NaN where either was not measured.
    """
    from scipy.interpolate import make_lsq_spline  # noqa: PLC0415 - slow to import

    known = np.isfinite(printed) & np.isfinite(yaw_rate)
    if np.count_nonzero(known) < 2:
        return printed
    rate = np.interp(time_secs, time_secs[known], yaw_rate[known])
    turned = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(time_secs)))
    at = time_secs[known]
    drift = np.unwrap(printed[known] - turned[known])
    pieces = min(int((at[-1] - at[0]) / CORRECTION_SECS), len(at) // 20)
    if pieces < 1:
        slow = np.polyval(np.polyfit(at - at[0], drift, 1), at - at[0])
    else:  # knots at the samples, so that none falls into a gap
        inner = at[np.linspace(0, len(at) - 1, pieces + 1).astype(int)[1:-1]]
        knots = np.concatenate([[at[0]] * 4, inner, [at[-1]] * 4])
        slow = make_lsq_spline(at, drift, knots, 3)(at)
    heading = np.full_like(printed, np.nan)
    heading[known] = turned[known] + slow
    return heading


def _turn_velocities(values: dict[str, FloatArray], notes: dict[str, dict[str, str]]) -> None:
    """Replace earth-fixed velocities by those along and across the ship."""
    north, east = (values.pop(name) for name in VELOCITIES)
    cos, sin = np.cos(values["heading"]), np.sin(values["heading"])
    values["speed"], values["sway"] = north * cos + east * sin, east * cos - north * sin
    note = {"computed_from": "velocity_north, velocity_east and heading: over the ground"}
    notes["speed"] = notes["sway"] = note


def _position_fields(values: dict[str, FloatArray]) -> tuple[tuple[str, ...], str]:
    """The components of the position among the columns, none where there is none, and its unit."""
    if "latitude" in values:
        values.setdefault("altitude", np.full_like(values["latitude"], np.nan))
        return GEOGRAPHIC, "deg"
    return (("north", "east") if "north" in values else ()), "m"

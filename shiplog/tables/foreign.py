"""Foreign tables: delimited text of other programs, read by a layout."""

import os
import re
from math import sqrt
from pathlib import Path

import numpy as np

from shiplog.errors import LayoutError
from shiplog.layouts.header_words import bracketed_unit, named_unit
from shiplog.layouts.layout import DEGREES_MINUTES, HEMISPHERES, ROLES, VELOCITIES, Layout
from shiplog.types import Channel, FloatArray, TimeArray, TrialLog
from shiplog.units import CATALOGUE, GEOGRAPHIC, UNITS, conversion_factor, did_you_mean

from .delimited import CellTable, read_cells
from .printed_positions import PositionTextError, looks_packed, parse_degrees
from .printed_times import TimeTextError, excel_ns, is_time_text, looks_hhmmss, parse_times
from .rebuild import rebuilt_heading, uniform_times

LAST_NS = 2**63 - 1  # 2262
NOT_MEASURED = frozenset(  # cells in lower case
    ("", "nan", "na", "n/a", "#n/a", "-", "--", "---", "null", "none", "nil", "-nan", "#nv")
)
SIDED = ("rudder", "rudder_order", "yaw_rate", "heel", "roll")  # positive to starboard
_SIDE = re.compile(  # a number with the letter of its side, such as 5.0P or STBD 5.0
    r"(?:(?P<before>P|S|PORT|STBD|STB)\s*(?P<number>[\d.,]+))"
    r"|(?:(?P<digits>[\d.,]+)\s*(?P<after>P|S|PORT|STBD|STB))",
    re.IGNORECASE,
)
NOT_CHANNELS = {"time", "date", "north", "east", *GEOGRAPHIC, *HEMISPHERES, *VELOCITIES}


def read_table(path: str | os.PathLike[str], layout: Layout) -> TrialLog:
    """Read a foreign table as a trial, in SI units, radians and full scale.

    A cell that is empty or one of `NOT_MEASURED` was not measured. Each channel has the times of
    the table, both as measured and as received.

    Parameters
    ----------
    path
        The table: delimited text.
    layout
        Its description.

    Raises
    ------
    LayoutError
        The text does not fit the layout: a cell that is not a number or is infinite, a row of
        another length, times that run backwards. The message names the line.
    """
    table = read_cells(Path(path), layout)
    texts = {role: _column_texts(table, layout, role) for role in layout.columns}
    measured_ns, warnings = _times_ns(table, layout, texts)
    values = {
        role: _column_values(table, layout, role, texts[role])
        for role in layout.columns
        if role.partition(".")[0] not in ("time", "date", *GEOGRAPHIC[:2], *HEMISPHERES)
    }
    for source in layout.receivers:
        _join_position(table, layout, f".{source}" if source else "", texts, values)
    notes: dict[str, dict[str, str]] = {}
    if layout.rebuild_heading:
        time_secs = (measured_ns - measured_ns[0]) * 1e-9
        values["heading"] = rebuilt_heading(time_secs, values["heading"], values["yaw_rate"])
        notes["heading"] = {
            "rebuilt": "integral of yaw_rate, corrected slowly towards the printed heading"
        }
    if "velocity_north" in values:
        _rotate_velocities(values, notes)
    warnings += _unit_warnings(table, layout)
    channels = _channels(layout, measured_ns, values, notes)
    metadata = {"converted_from": table.path.name, "layout": layout.name}
    if layout.froude_scale != 1:
        metadata["froude_scale"] = repr(float(layout.froude_scale))
    warnings = [f"{table.path.name}: {text} in {layout.where}" for text in warnings]
    return TrialLog(table.path.name, tuple(channels), metadata, warnings=tuple(warnings))


def _unit_warnings(table: CellTable, layout: Layout) -> list[str]:
    """Compare the units that the table states with those of the layout."""
    warnings = []
    for role, column in layout.columns.items():
        if not table.header or column.unit not in UNITS:
            continue
        at = _column_index(table, layout, role)
        stated = named_unit(table.units[at]) if table.units else ""
        stated = stated if stated in UNITS else bracketed_unit(table.header[at])
        if stated and UNITS[stated] != UNITS[column.unit]:
            warnings.append(
                f"the table states {stated} for the column {table.header[at]!r}, which is read in "
                f"{column.unit}; correct the unit of {role}"
            )
    return warnings


def _channels(
    layout: Layout,
    measured_ns: TimeArray,
    values: dict[str, FloatArray],
    notes: dict[str, dict[str, str]],
) -> list[Channel]:
    """Make the channels, in the order of the catalogue; further ones follow."""
    order = {name: number for number, name in enumerate(CATALOGUE)}
    roles = [role for role in values if role.partition(".")[0] not in NOT_CHANNELS]
    channels = []
    for role in sorted(roles, key=lambda role: order.get(role.partition(".")[0], len(order))):
        name, _, source = role.partition(".")
        column = layout.columns.get(role)
        metadata = dict(column.metadata) if column else {}
        geographic = f"latitude{role.removeprefix('position')}" in layout.columns
        fields, unit = (GEOGRAPHIC, "deg") if geographic else (("north", "east"), "m")
        channels.append(
            Channel(
                name,
                source or layout.source,
                unit if name == "position" else _si_unit(layout, role),
                measured_ns,
                measured_ns,
                values[role],
                fields if name == "position" else (),
                metadata | notes.get(role, {}),
            )
        )
    return channels


def _column_texts(table: CellTable, layout: Layout, role: str) -> list[str]:
    """Return the cells of a role; those of `NOT_MEASURED` as empty texts."""
    at = _column_index(table, layout, role)
    cells = [row[at] for row in table.rows]
    return ["" if cell.lower() in NOT_MEASURED else cell for cell in cells]


def _column_values(table: CellTable, layout: Layout, role: str, texts: list[str]) -> FloatArray:
    """Parse the column of a role: (n,) in SI units, signed, at full scale; NaN of an empty cell."""
    column = layout.columns[role]
    values = _numbers(table, layout, role, texts)
    si = _si_unit(layout, role)
    scale = conversion_factor(column.unit, si) if column.unit in UNITS else 1.0
    bad = ~np.isfinite(values) if role == "time" else np.isinf(values)
    if np.any(bad):
        row = int(np.argmax(bad))
        what = "has no time" if np.isnan(values[row]) else f"has an infinite {role}"
        raise LayoutError(
            f"line {table.lines[row]} {what} (column {column.place}: {texts[row]!r}); "
            f"correct it or remove the line: {table.path}"
        )
    return values * (column.sign * scale * _froude_factor(si, layout.froude_scale))


def _numbers(table: CellTable, layout: Layout, role: str, texts: list[str]) -> FloatArray:
    """Parse the numbers of a column, (n,), as they are printed; those to port are negative."""
    if role.partition(".")[0] in SIDED and any(map(_SIDE.fullmatch, texts)):
        if layout.columns[role].sign < 0:
            raise LayoutError(
                f"the cells of {role} state port and starboard, so that sign = -1 is wrong; "
                f"remove it from {layout.where}: {table.path}"
            )
        texts = [_signed(text) for text in texts]
    try:
        return np.array([_number(text, layout.decimal_comma) for text in texts])
    except ValueError as error:
        row = next(i for i, text in enumerate(texts) if text == str(error))
        remedy = f"correct the cell (empty or nan: not measured) or {layout.where}"
        if not layout.decimal_comma and re.fullmatch(r"[+-]?\d+,\d+", texts[row]):
            remedy = f"state decimal_comma = true in {layout.where}"
        elif is_time_text(texts[row]) and role != "time":
            remedy = f"it is a time, so correct the column of {role} in {layout.where}"
        at = _column_index(table, layout, role) + 1
        raise LayoutError(
            f"line {table.lines[row]}, column {at}: {texts[row]!r} is not a number; "
            f"{remedy}: {table.path}"
        ) from None


def _signed(text: str) -> str:
    """Replace the letter of a side by a sign: positive to starboard."""
    match = _SIDE.fullmatch(text)
    if match is None:
        return text
    side = (match["before"] or match["after"]).upper()
    return ("-" if side.startswith("P") else "") + (match["number"] or match["digits"])


def _join_position(
    table: CellTable,
    layout: Layout,
    suffix: str,
    texts: dict[str, list[str]],
    values: dict[str, FloatArray],
) -> None:
    """Replace the components of one receiver's position, with a suffix, by the position (n, k)."""
    if f"latitude{suffix}" in texts:
        values |= _geographic(table, layout, suffix, texts)
        unknown = np.full(len(table.rows), np.nan)
        values.setdefault(f"altitude{suffix}", unknown)
        fields: tuple[str, ...] = GEOGRAPHIC
    else:
        fields = ("north", "east")
    values[f"position{suffix}"] = np.column_stack([values[f"{name}{suffix}"] for name in fields])


def _geographic(
    table: CellTable, layout: Layout, suffix: str, texts: dict[str, list[str]]
) -> dict[str, FloatArray]:
    """Latitude and longitude, (n,) deg each, from numbers or from texts with hemispheres."""
    roles = [f"{name}{suffix}" for name in GEOGRAPHIC[:2]]
    unit = layout.columns[roles[0]].unit
    if layout.decimal_comma:
        texts = {role: [t.replace(",", ".") for t in cells] for role, cells in texts.items()}
    packed = unit == DEGREES_MINUTES or any(
        looks_packed(texts[role], name) for name, role in zip(GEOGRAPHIC, roles, strict=False)
    )
    values = {}
    for name, role, letters in zip(GEOGRAPHIC[:2], roles, HEMISPHERES, strict=True):
        if unit == "rad":
            values[role] = np.degrees(_numbers(table, layout, role, texts[role]))
            continue
        try:
            values[role] = parse_degrees(
                texts[role], name, texts.get(f"{letters}{suffix}"), packed=packed
            )
        except PositionTextError as error:
            line, at = table.lines[error.row], _column_index(table, layout, role) + 1
            raise LayoutError(f"line {line}, column {at}: {error.reason}: {table.path}") from None
    return values


def _number(text: str, decimal_comma: bool) -> float:
    """Parse the number of a cell; NaN if empty, `ValueError` with the text if not a number."""
    plain = text
    if decimal_comma:
        plain = text.replace(",", ".") if "." not in text else "both"
    try:
        if "_" in plain:  # allowed inside a number by Python, but written by no logger
            raise ValueError
        return float(plain) if plain else np.nan
    except ValueError:
        if not text.strip():
            return np.nan
        raise ValueError(text) from None


def _column_index(table: CellTable, layout: Layout, role: str) -> int:
    """Index of the column of a role in a row, from 0."""
    place = layout.columns[role].place
    if isinstance(place, str):
        if table.header.count(place) == 1:
            return table.header.index(place)
        how_many = "no column" if place not in table.header else "more than one column"
        raise LayoutError(
            f"{how_many} is headed {place!r}{did_you_mean(place, table.header)}; "
            f"{layout.where} needs it for {role}: {table.path}"
        )
    width = len(table.rows[0])
    if place > width:
        raise LayoutError(
            f"line {table.lines[0]} has {width} columns, but {role} should be column {place}; "
            f"correct the column or the delimiter in {layout.where}: {table.path}"
        )
    return place - 1


def _si_unit(layout: Layout, role: str) -> str:
    """SI unit of a role; of a quantity that is not in the catalogue, that of its own unit."""
    name = role.partition(".")[0]
    if name in ROLES:
        return ROLES[name]
    unit = layout.columns[role].unit
    return UNITS[unit][0] if unit in UNITS else unit


def _froude_factor(si: str, scale: float) -> float:
    """Factor from model to ship at equal Froude number; `scale` is that of the lengths.

    That of fresh to salt water, 1.026, is not included in forces, torques and powers.
    """
    exponents = {
        "m": 1, "s": 0.5, "m/s": 0.5, "rad/s": -0.5, "rpm": -0.5, "N": 3, "Nm": 4, "W": 3.5, "Pa": 1
    }  # fmt: skip
    power = exponents.get(si, 0.0)
    factor = sqrt(scale) if abs(power) == 0.5 else float(scale ** abs(power))
    return 1 / factor if power < 0 else factor


def _times_ns(
    table: CellTable, layout: Layout, texts: dict[str, list[str]]
) -> tuple[TimeArray, list[str]]:
    """Nanoseconds since 1970 of the printed times, (n,), and warnings about what was assumed."""
    column, form = layout.columns["time"], layout.time
    printed_texts = texts["time"]
    is_text = column.unit == "hhmmss" or any(map(is_time_text, printed_texts[:10]))
    warnings: list[str] = []
    try:
        if is_text or "date" in texts:
            times_ns, warnings = parse_times(printed_texts, texts.get("date"), form)
        elif column.unit == "excel":
            days = _column_values(table, layout, "time", printed_texts)
            _require_range(table, layout, days * 86_400e9 - 25569 * 86_400e9)
            times_ns = excel_ns(days, form.zone)
            if form.zone is None:
                warnings.append("the times have no time zone, read as UTC; state time.zone")
        elif not column.unit:
            raise TimeTextError(0, f"has the number {printed_texts[0]!r}; state time.unit")
        else:
            times_ns = _numeric_times_ns(table, layout, printed_texts)
            if column.unit == "s" and _wraps_like_clock(printed_texts):
                warnings.append(
                    "the times step by 41 s at each minute, as day times in six digits do; state "
                    "time.unit = 'hhmmss'"
                )
            return times_ns, warnings
    except TimeTextError as error:
        raise LayoutError(
            f"line {table.lines[error.row]} {error.reason} ({layout.where}): {table.path}"
        ) from None
    _require_ascending(table, times_ns)
    if form.uniform:
        secs, wrong = uniform_times((times_ns - times_ns[0]) * 1e-9)
        _require_uniform(table, layout, wrong)
        times_ns = times_ns[0] + np.round(secs * 1e9).astype(np.int64)
    _require_range(table, layout, times_ns)
    return times_ns, warnings


def _numeric_times_ns(table: CellTable, layout: Layout, texts: list[str]) -> TimeArray:
    """Nanoseconds since 1970 of times that are numbers, (n,)."""
    printed = _column_values(table, layout, "time", texts)
    start_ns = layout.time.start_ns or 0
    _require_ascending(table, printed)
    if layout.time.uniform:
        printed, wrong = uniform_times(printed)
        _require_uniform(table, layout, wrong)
        if start_ns == 0 and printed[0] < 0:  # the fitted first time, by less than its rounding
            printed = printed - printed[0]
    _require_range(table, layout, np.round(printed * 1e9) + float(start_ns))
    times_ns: TimeArray = np.round(printed * 1e9).astype(np.int64) + start_ns
    return times_ns


def _wraps_like_clock(texts: list[str]) -> bool:
    """Whether six-digit numbers are day times that pass a minute."""
    if not looks_hhmmss(texts):
        return False
    steps = np.diff([float(text) for text in texts if text])
    return len(steps) > 1 and bool(np.any(np.abs(steps - np.median(steps) - 40) < 0.5))


def _require_ascending(table: CellTable, times: FloatArray | TimeArray) -> None:
    back = np.flatnonzero(np.diff(times) < 0)
    if len(back):
        raise LayoutError(
            f"the time runs backwards at line {table.lines[back[0] + 1]}; "
            f"put the lines in the order of time, or cut the table there: {table.path}"
        )


def _require_uniform(table: CellTable, layout: Layout, wrong: int | None) -> None:
    if wrong is not None:
        raise LayoutError(
            f"the times are not uniform, first at line {table.lines[wrong]}; "
            f"remove time.rebuild from {layout.where}: {table.path}"
        )


def _require_range(table: CellTable, layout: Layout, times_ns: FloatArray | TimeArray) -> None:
    outside = ~((times_ns >= 0) & (times_ns < LAST_NS))
    if np.any(outside):
        raise LayoutError(
            f"line {table.lines[int(np.argmax(outside))]} is before 1970 or after 2262; "
            f"correct the unit of the time or `start` in {layout.where}: {table.path}"
        )


def _rotate_velocities(values: dict[str, FloatArray], notes: dict[str, dict[str, str]]) -> None:
    """Replace earth-fixed velocities by those along and across the ship."""
    north, east = (values.pop(name) for name in VELOCITIES)
    cos, sin = np.cos(values["heading"]), np.sin(values["heading"])
    values["speed"], values["sway"] = north * cos + east * sin, east * cos - north * sin
    note = {"computed_from": "velocity_north, velocity_east and heading: over the ground"}
    notes["speed"] = notes["sway"] = note

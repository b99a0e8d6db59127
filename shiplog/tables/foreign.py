"""Foreign tables: delimited text of other programs, read by a layout."""

import os
from math import sqrt
from pathlib import Path

import numpy as np

from shiplog.errors import LayoutError
from shiplog.types import Channel, FloatArray, TimeArray, TrialLog
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor, did_you_mean

from .delimited import CellTable, read_cells
from .layout import ROLES, VELOCITIES, Layout
from .rebuild import rebuilt_heading, uniform_times

LAST_NS = 2**63 - 1  # 2262


def read_table(path: str | os.PathLike[str], layout: Layout) -> TrialLog:
    """Read a foreign table as a trial, in SI units, radians and full scale.

    A cell that is empty or contains `nan` was not measured. Each channel has the times of the
    table, both as measured and as received.

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
    values = {role: _column_values(table, layout, role) for role in layout.columns}
    measured_ns = _times_ns(table, layout, values.pop("time"))
    notes: dict[str, dict[str, str]] = {}
    if "heading" in layout.rebuild:
        time_secs = (measured_ns - measured_ns[0]) * 1e-9
        values["heading"] = rebuilt_heading(time_secs, values["heading"], values["yaw_rate"])
        notes["heading"] = {
            "rebuilt": "integral of yaw_rate, corrected slowly towards the printed heading"
        }
    if "velocity_north" in values:
        _rotate_velocities(values, notes)
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


def _column_values(table: CellTable, layout: Layout, role: str) -> FloatArray:
    """Parse the column of a role: (n,) in SI units, signed, at full scale; NaN of an empty cell."""
    column = layout.columns[role]
    at = _column_index(table, layout, role)
    texts = [row[at] for row in table.rows]
    try:
        values = np.array([_number(text, layout.decimal_comma) for text in texts])
    except ValueError as error:
        row = next(i for i, text in enumerate(texts) if text == str(error))
        raise LayoutError(
            f"line {table.lines[row]}, column {at + 1}: {texts[row]!r} is not a number; "
            f"correct the cell (empty or nan: not measured) or {layout.where}: {table.path}"
        ) from None
    si = _si_unit(role)
    scale = conversion_factor(column.unit, si) if role not in GEOGRAPHIC else 1.0
    bad = ~np.isfinite(values) if role == "time" else np.isinf(values)
    if np.any(bad):
        row = int(np.argmax(bad))
        what = "has no time" if np.isnan(values[row]) else f"has an infinite {role}"
        raise LayoutError(
            f"line {table.lines[row]} {what} (column {column.place}: {table.rows[row][at]!r}); "
            f"correct it or remove the line: {table.path}"
        )
    return values * (column.sign * scale * _froude_factor(si, layout.froude_scale))


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


def _si_unit(role: str) -> str:
    """SI unit of a role; of a position that is not geographic, metres."""
    return ROLES.get(role, "rad" if role in GEOGRAPHIC[:2] else "m")


def _froude_factor(si: str, scale: float) -> float:
    """Factor from model to ship at equal Froude number; `scale` is that of the lengths."""
    root = sqrt(scale)
    return {"m": scale, "s": root, "m/s": root, "rad/s": 1 / root, "rpm": 1 / root}.get(si, 1.0)


def _times_ns(table: CellTable, layout: Layout, printed: FloatArray) -> TimeArray:
    """Nanoseconds since 1970, (n,), of printed times in seconds."""
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
                f"the times are not uniform, first at line {table.lines[wrong]}; "
                f"remove time.rebuild from {layout.where}: {table.path}"
            )
    wanted_ns = np.round(printed * 1e9) + float(layout.start_ns)
    outside = (wanted_ns < 0) | (wanted_ns >= LAST_NS)
    if np.any(outside):
        raise LayoutError(
            f"line {table.lines[int(np.argmax(outside))]} is before 1970 or after 2262; "
            f"correct the unit of the time or `start` in {layout.where}: {table.path}"
        )
    return np.round(printed * 1e9).astype(np.int64) + layout.start_ns


def _rotate_velocities(values: dict[str, FloatArray], notes: dict[str, dict[str, str]]) -> None:
    """Replace earth-fixed velocities by those along and across the ship."""
    north, east = (values.pop(name) for name in VELOCITIES)
    cos, sin = np.cos(values["heading"]), np.sin(values["heading"])
    values["speed"], values["sway"] = north * cos + east * sin, east * cos - north * sin
    note = {"computed_from": "velocity_north, velocity_east and heading: over the ground"}
    notes["speed"] = notes["sway"] = note


def _position_fields(values: dict[str, FloatArray]) -> tuple[tuple[str, ...], str]:
    """Components of the position among the columns, if any, and its unit."""
    if "latitude" in values:
        values.setdefault("altitude", np.full_like(values["latitude"], np.nan))
        return GEOGRAPHIC, "deg"
    return (("north", "east") if "north" in values else ()), "m"

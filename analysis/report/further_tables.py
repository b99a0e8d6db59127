"""Sensor errors, current and wind as tables, as far as the filter estimates them."""

from collections.abc import Iterator
from math import ceil, degrees, isnan

from analysis.replay.current import Current
from analysis.replay.replay_results import Findings
from analysis.replay.sensor_errors import WIND_DISPLAY_SPEED, SlowState, further_display
from shiplog.text_table import TextTable

from .display import NORMAL_95, decimals

COLUMNS = ("value", "std", "95 %\ninterval", "unit")


def further_tables(findings: Findings) -> Iterator[TextTable]:
    """Yield the tables of sensor errors, current and wind, as far as there are any."""
    if findings.sensor_errors:
        yield _sensor_error_table(findings)
    if findings.current is not None:
        yield _current_table(findings.current)
    if findings.wind:
        yield _wind_table(findings.wind)


def _sensor_error_table(findings: Findings) -> TextTable:
    columns = ("sensor error", *COLUMNS, "determined")
    rows = tuple(map(_row, findings.sensor_errors))
    return TextTable("Sensor errors", columns, rows, tuple(_sensor_remarks(findings)))


def _row(state: SlowState) -> tuple[str, ...]:
    cells = _cells(state.name, state.unit, state.value, state.std)
    return (state.label, *cells, "yes" if state.determined else "no")


def _sensor_remarks(findings: Findings) -> Iterator[str]:
    for error in findings.sensor_errors:
        if error.reason:
            yield _reason(error)
    if all(isnan(error.value) for error in findings.sensor_errors):
        return
    outputs = findings.plan.noise.further.outputs
    measured = {0: "", 1: "The heading is a measurement of the filter. "}.get(
        len(outputs), "Heading and position are measurements of the filter. "
    )
    yield (
        f"{measured}Values at the end of the trial. States and disturbances are corrected for "
        "these errors, coefficients are not."
    )
    slow = findings.plan.noise.further.heading_error
    if slow is not None:
        yield (
            f"The heading departs from the integral of the yaw rate by {degrees(slow.std):.2g} deg "
            f"over {slow.secs:.2g} s, more than white noise explains: a slow error of the heading."
        )


def _reason(error: SlowState) -> str:
    state = "estimated" if isnan(error.value) else "determined"
    return f"{error.label}: not {state}: {error.reason}."


def _current_table(current: Current) -> TextTable:
    rows = (
        ("to north", *_cells("current_north", "m/s", current.north, current.north_std)),
        ("to east", *_cells("current_east", "m/s", current.east, current.east_std)),
        (
            "drift length",
            *_cells("drift_length", "m", current.drift_length, current.drift_length_std),
        ),
    )
    return TextTable("Current", ("current", *COLUMNS), rows, tuple(_current_remarks(current)))


def _current_remarks(current: Current) -> Iterator[str]:
    unit, factor = further_display("current_north", "m/s")
    if current.reason:
        yield f"Not determined: {current.reason}."
    elif current.determined:
        set_deg = round(degrees(current.direction)) % 360
        set_half = NORMAL_95 * degrees(current.direction_std)
        half = NORMAL_95 * current.speed_std * factor
        digits = decimals(half)
        yield (
            f"Set {set_deg:03d}° ± {ceil(set_half)}°, drift "
            f"{current.speed * factor:.{digits}f} ± {half:.{digits}f} {unit} (95 %), at the end."
        )
    else:
        yield "No current: at the end it is less than two standard deviations."
    yield (
        "Drift length: the sway, positive to starboard, is minus this length times the yaw rate; "
        "a leeway by wind counts as current."
    )


def _wind_table(wind: tuple[SlowState, ...]) -> TextTable:
    columns = ("wind", *COLUMNS, "determined")
    remarks = [_reason(term) for term in wind if term.reason]
    remarks.append(
        f"What a relative wind of {WIND_DISPLAY_SPEED:g} m/s does from 45° on the starboard bow, "
        "from the starboard beam, and from ahead: a moment that turns the bow to starboard and a "
        "force ahead, beyond that of still air, are positive. Both grow with its square. "
        "Values at the end of the trial. Coefficients of the ship are not corrected for the wind."
    )
    return TextTable("Wind", columns, tuple(map(_row, wind)), tuple(remarks))


def _cells(name: str, unit: str, value: float, std: float) -> tuple[str, str, str, str]:
    """Return value, standard deviation, half of the interval and unit, as they are shown."""
    shown, factor = further_display(name, unit)
    value, std = value * factor, std * factor
    if isnan(value):
        return "not estimated", "", "", shown
    digits = decimals(std)
    value = round(value, digits) + 0.0  # no minus before a zero
    return f"{value:.{digits}f}", f"{std:.{digits}f}", f"± {NORMAL_95 * std:.{digits}f}", shown

"""Sentinel values: numbers that a device or a logger writes where it has no measurement."""

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray
from shiplog.units import UNITS

MIN_OTHER_SAMPLES = 20  # and as many different values, to compare a suspected sentinel with
MIN_RUNS = 3  # returns to a value that is on no list, before it is one
MAX_RUN_SAMPLES = 3  # of such a value at a time, and
MAX_SHARE = 0.5  # of all samples: more is a level
MIN_JUMP_STEPS = 10.0  # jump to such a value over the ordinary step between samples
MIN_CODE_STEPS = 10.0  # the distance of a value on the list from all others over the median step
MIN_CODE_GAP = 0.02  # its distance from them, as a share of their range
MIN_CONTINUOUS_SHARE = 0.95  # of the steps of an angle that counts full turns
MAX_WRAPPED = 4 * np.pi  # rad
MAX_SENTINELS = 4  # of one channel
CODE_TOLERANCE = 1e-5  # relative, of a code that was converted and printed

# Of loggers in general; heading of AIS (ITU-R M.1371) and NMEA 2000 (65535, 65534 and 32767 units
# of 0.0001 rad); rate of turn of AIS, as transmitted and decoded.
CODES: dict[str, tuple[float, ...]] = {
    "deg": (511.0, 3600.0),
    "rad": (6.5535, 6.5534, 3.2767),
    "deg/min": (127.0, -127.0, 128.0, -128.0, 720.0, -720.0, 731.4, -731.4, 708.0, -708.0),
    "kn": (102.3, 102.2, 99.9),
    "m/s": (655.35, 655.34, 327.67),
}
GENERAL_CODES = (
    *(sign * code for code in (999.0, 999.9, 9999.0, 9999.9, 99999.0) for sign in (1.0, -1.0)),
    32767.0, -32768.0, 65535.0, 655.35, 2147483647.0,
)  # fmt: skip


def sentinel_values(values: FloatArray, unit: str) -> tuple[float, ...]:
    """Find the values of a channel that stand for "not available".

    A sentinel is the largest value, the smallest, or zero. It is recognised by the jumps to it and
    back: a physical quantity does not leave its course for one exact value and return, again and
    again. A value that loggers are known to write, such as a heading of 511 deg, is recognised at
    its first occurrence, if it is beyond all other values.

    Parameters
    ----------
    values
        (n,) the channel's finite and possible values in the order of time.
    unit
        The unit of the values.

    Returns
    -------
    sentinels
        Exact values; empty where there are none.

    References
    ----------
    ITU-R M.1371-5, annex 8, table 48: heading 511, speed 102.3 kn, rate of turn -128.

    Examples
    --------
    >>> import numpy as np
    >>> heading = np.radians(np.linspace(10.0, 60.0, 100))
    >>> heading[50] = np.radians(511.0)
    >>> np.degrees(sentinel_values(heading, "rad")).round(6).tolist()
    [511.0]
    """
    codes = _codes(unit)
    found: list[float] = []
    while len(found) < MAX_SENTINELS and len(values):
        suspects = (float(values.max()), float(values.min()), 0.0)
        sentinel = next((v for v in suspects if _is_sentinel(values, v, codes, unit)), None)
        if sentinel is None:
            break
        found.append(sentinel)
        values = values[values != sentinel]
    return tuple(found)


def unwrapped_limit(values: FloatArray) -> float:
    """Return the largest angle of a channel of angles that can have been measured, rad.

    An angle that counts full turns reaches a value beyond two turns step by step; any other
    channel of angles does not have such values.

    Parameters
    ----------
    values
        (n,) the finite angles in the order of time, rad.

    Examples
    --------
    >>> import numpy as np
    >>> unwrapped_limit(np.linspace(0.0, 20.0, 100))
    inf
    """
    beyond = np.abs(values) > MAX_WRAPPED
    steps = np.abs(np.diff(values))[beyond[1:] & beyond[:-1]]
    jumps = np.count_nonzero(np.abs(np.diff(values))[beyond[1:] != beyond[:-1]] > np.pi / 2)
    rare = jumps <= max(2, (1 - MIN_CONTINUOUS_SHARE) * len(steps))  # such as after a gap
    is_continuous = len(steps) > 0 and float(np.mean(steps < np.pi / 2)) > MIN_CONTINUOUS_SHARE
    varies = len(steps) > 0 and float(steps.max()) > 0
    return float("inf") if is_continuous and rare and varies else MAX_WRAPPED


def _codes(unit: str) -> FloatArray:
    """Return the known codes of a quantity, in its unit."""
    base, to_base = UNITS.get(unit, (unit, 1.0))
    others = {name: factor for name, (other, factor) in UNITS.items() if other == base}
    codes = [
        code * factor / to_base
        for name, factor in others.items()
        for code in (*CODES.get(name, ()), *GENERAL_CODES)
    ]
    return np.array(codes or GENERAL_CODES)


def _is_sentinel(values: FloatArray, suspect: float, codes: FloatArray, unit: str) -> bool:
    """Whether one value of a channel is a sentinel."""
    at = values == suspect
    count = int(np.count_nonzero(at))
    if not count or len(values) - count < MIN_OTHER_SAMPLES:
        return False
    listed = bool(np.any(np.isclose(suspect, codes, rtol=CODE_TOLERANCE, atol=0.0)))
    if not listed and count < MIN_RUNS:
        return False
    rest = values[~at]
    low, high = float(rest.min()), float(rest.max())
    beyond = max(suspect - high, low - suspect)
    if beyond <= 0 and suspect != 0:
        return False
    if not listed and 0 < beyond < MIN_CODE_GAP * (high - low):
        return False
    median_step, ordinary_step = np.percentile(np.abs(np.diff(rest)), [50, 95])
    if listed and beyond > max(MIN_CODE_STEPS * median_step, MIN_CODE_GAP * (high - low)):
        return True
    return _jumps_and_returns(values, at, float(ordinary_step), unit)


def _jumps_and_returns(values: FloatArray, at: NDArray[np.bool_], step: float, unit: str) -> bool:
    """Whether the channel jumps to one value and back to its course, several times.

    Parameters
    ----------
    values
        (n,) the channel's values.
    at
        (n,) where they equal the suspected one.
    step
        The ordinary step between the other values.
    unit
        The unit of the values.
    """
    edges = np.flatnonzero(np.diff(at.astype(np.int8), prepend=0, append=0))
    starts, ends = edges[::2], edges[1::2]
    if np.median(ends - starts) > MAX_RUN_SAMPLES or at.mean() > MAX_SHARE:
        return False  # a level that is held, such as an order
    inner = (starts > 0) & (ends < len(values))
    before, after = values[starts[inner] - 1], values[ends[inner]]
    if len(before) < MIN_RUNS:
        return False
    suspect = values[starts[0]]
    jumps = np.minimum(np.abs(before - suspect), np.abs(after - suspect))
    jump = float(np.median(jumps))
    rejoins = float(np.median(np.abs(after - before))) < jump / 4
    if not rejoins or jump <= MIN_JUMP_STEPS * step:
        return False
    if unit == "rpm" and _interrupts_a_steady_value(values, at, starts, ends):
        return True
    return len(np.unique(values[~at])) >= MIN_OTHER_SAMPLES


def _interrupts_a_steady_value(
    values: FloatArray, at: NDArray[np.bool_], starts: NDArray[np.intp], ends: NDArray[np.intp]
) -> bool:
    """Whether single samples of one value interrupt revolutions that are repeated otherwise.

    A propeller does not stop for one sample and go on as before. Revolutions that are written only
    when they change do not repeat a value.
    """
    others = values[~at]
    repeated = np.mean(np.diff(others) == 0) if len(others) > 1 else 0.0
    lengths = np.diff(np.concatenate((ends[:-1], starts[1:])).reshape(2, -1), axis=0)
    single = float(np.median(ends - starts)) == 1
    return bool(single and repeated > 0.5 and lengths.size and np.median(lengths) >= 2)

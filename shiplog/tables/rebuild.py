"""Times and headings rebuilt from a print with too few digits."""

import numpy as np

from shiplog.types import FloatArray

CORRECTION_SECS = 200.0  # a rebuilt heading follows the printed one no faster than this


def uniform_times(printed: FloatArray) -> tuple[FloatArray, int | None]:
    """Recover uniform times that were printed with too few digits.

    A straight line is fitted to the middles of the runs of equal printed times. These lie within
    half a step of the true times, however few digits there are. Where the print changes its number
    of digits they do not; Huber's weights limit the influence of these few.

    Parameters
    ----------
    printed
        (n,) printed times, s, in ascending order.

    Returns
    -------
    times
        (n,) uniform times, s.
    contradiction
        Index of the first row whose printed time contradicts them; None if there is none.

    References
    ----------
    P. J. Huber, Robust estimation of a location parameter, Ann. Math. Statist. 35 (1964).

    Examples
    --------
    >>> import numpy as np
    >>> times, contradiction = uniform_times(np.floor(0.4 * np.arange(100)))
    >>> round(float(times[1] - times[0]), 2), contradiction
    (0.4, None)
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
        residual = np.abs(values - zero - step * middles)
        width = 1.345 * 1.4826 * float(np.median(residual)) + 1e-9 * step
        weights = np.sqrt(np.minimum(1.0, width / np.maximum(residual, width)))
        step, zero = np.polyfit(middles, values, 1, w=weights)
    times = zero + step * rows
    spacing = np.diff(printed[starts], prepend=printed[0], append=printed[-1])
    print_step = np.repeat(np.maximum(spacing[:-1], spacing[1:]), ends - starts)
    wrong = np.abs(times - printed) > 0.5 * print_step + step
    return times, int(np.argmax(wrong)) if np.any(wrong) else None


def rebuilt_heading(time_secs: FloatArray, printed: FloatArray, yaw_rate: FloatArray) -> FloatArray:
    """Recover a heading that was printed with too few digits from the yaw rate.

    The heading is the integral of the yaw rate plus a slow correction towards the printed heading,
    which removes the drift that a gyro bias causes: a least squares spline with a knot every
    `CORRECTION_SECS`. The yaw rate itself stays as it was measured.

    Parameters
    ----------
    time_secs
        (n,) times, s, in ascending order.
    printed
        (n,) printed heading, rad.
    yaw_rate
        (n,) yaw rate, rad/s.

    Returns
    -------
    numpy.ndarray
        (n,) heading, rad, without jumps by a full turn; NaN where either was not measured.
    """
    from scipy.interpolate import make_lsq_spline  # noqa: PLC0415 - slow to import

    valid = np.isfinite(printed) & np.isfinite(yaw_rate)
    if np.count_nonzero(valid) < 2:
        return printed
    rate = np.interp(time_secs, time_secs[valid], yaw_rate[valid])
    turned = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(time_secs)))
    at = time_secs[valid]
    drift = np.unwrap(printed[valid] - turned[valid])
    pieces = min(int((at[-1] - at[0]) / CORRECTION_SECS), len(at) // 20)
    if pieces < 1:
        slow = np.polyval(np.polyfit(at - at[0], drift, 1), at - at[0])
    else:  # knots at the samples, so that none falls into a gap
        inner = at[np.linspace(0, len(at) - 1, pieces + 1).astype(int)[1:-1]]
        knots = np.concatenate([[at[0]] * 4, inner, [at[-1]] * 4])
        slow = make_lsq_spline(at, drift, knots, 3)(at)
    heading = np.full_like(printed, np.nan)
    heading[valid] = turned[valid] + slow
    return heading

"""Mean velocities over ground between position fixes, as a fit takes them.

The fixes of a block of time are averaged, and the velocity is the difference of two neighbouring
means over the time between them. The same operation on the simulated track gives what a fit
compares it with, so that averaging biases nothing. Velocities, unlike positions, do not add up the
errors of a model over a run.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

GROUND_VELOCITY = ("velocity_north", "velocity_east")
FIT_OUTPUTS = (*MODEL_OUTPUTS, *GROUND_VELOCITY)  # what a fit can compare with measurements
YAW_RATE, AHEAD, SWAY, HEADING = range(4)
STRAIGHT_SHARE = 0.02  # of a segment, from its start: the ship is taken to sail straight


@dataclass(frozen=True, eq=False)
class FixBlocks:
    """Blocks of a segment's fixes, and the mean velocities from each block to the next.

    Attributes
    ----------
    fixed
        (k,) the numbers of the samples with a fix, in blocks one after the other.
    first
        (b,) where each block begins in `fixed`.
    count
        (b,) the fixes of each block.
    secs
        (b - 1,) the time between the means of neighbouring blocks, s.
    at
        (b - 1,) the sample at which a velocity is placed: the first of the later block.
    antenna
        The place of the fixes ahead and to starboard of the midship point, m.
    """

    fixed: NDArray[np.int64]
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    secs: FloatArray
    at: NDArray[np.int64]
    antenna: tuple[float, float] = (0.0, 0.0)

    @property
    def has_velocities(self) -> bool:
        """Whether two neighbouring blocks have fixes."""
        return bool(np.isfinite(self.secs).any())

    def velocities(self, tracks: FloatArray) -> FloatArray:
        """Compute the mean velocities of tracks.

        Parameters
        ----------
        tracks
            (n, 2, ...) positions north and east at the samples, m, or derivatives of them.

        Returns
        -------
        velocities
            (n, 2, ...) m/s, at the samples `at`; NaN elsewhere.
        """
        out = np.full(tracks.shape, np.nan)
        if len(self.at):
            total = np.add.reduceat(tracks[self.fixed], self.first, axis=0)
            ones = (1,) * (tracks.ndim - 1)
            means = total / self.count.reshape(-1, *ones)
            out[self.at] = np.diff(means, axis=0) / self.secs.reshape(-1, *ones)
        return out


def fix_blocks(
    fixes: FloatArray, dt: float, block_secs: float, antenna: tuple[float, float] = (0.0, 0.0)
) -> FixBlocks:
    """Divide the fixes of a segment into blocks.

    Parameters
    ----------
    fixes
        (n, 2) north and east, m; NaN where there is no fix.
    dt
        Sample interval, s.
    block_secs
        The length of a block, s.
    antenna
        The place of the fixes ahead and to starboard of the midship point, m.

    Examples
    --------
    >>> import numpy as np
    >>> track = np.column_stack((np.arange(8.0), np.zeros(8)))
    >>> blocks = fix_blocks(track, dt=1.0, block_secs=4.0)
    >>> blocks.velocities(track)[blocks.at].tolist()
    [[1.0, 0.0]]
    """
    fixed = np.flatnonzero(np.isfinite(fixes).all(axis=1))
    every = max(1, round(block_secs / dt))
    number = fixed // every
    first = np.flatnonzero(np.diff(number, prepend=-1))
    count = np.diff(np.append(first, len(fixed)))
    centres = np.add.reduceat(fixed.astype(float), first) / count if len(fixed) else np.zeros(0)
    near = np.diff(number[first]) == 1  # no velocity across a gap
    secs = np.where(near, np.diff(centres) * dt, np.nan)
    at = fixed[first[1:]] if len(first) else np.zeros(0, np.int64)
    return FixBlocks(fixed, first, count, secs, at, antenna)


def course_at_start(fixes: FloatArray) -> float:
    """Estimate the course over ground at the start of a segment, rad.

    Parameters
    ----------
    fixes
        (n, 2) north and east, m; NaN where there is no fix.

    Examples
    --------
    >>> import numpy as np
    >>> course_at_start(np.column_stack((np.zeros(100), np.arange(100.0)))).__round__(3)
    1.571
    """
    fixed = fixes[np.isfinite(fixes).all(axis=1)]
    if len(fixed) < 2:
        return 0.0
    last = min(max(1, round(STRAIGHT_SHARE * len(fixed))), len(fixed) - 1)
    north, east = fixed[last] - fixed[0]
    return float(np.arctan2(east, north))


def simulated_track(outputs: FloatArray, dt: float, antenna: tuple[float, float]) -> FloatArray:
    """Integrate the velocity of the antenna through the water, (n, 2) m north and east.

    Parameters
    ----------
    outputs
        (n, 4) in the order of `MODEL_OUTPUTS`, SI.
    dt
        Sample interval, s.
    antenna
        Its place ahead and to starboard of the midship point, m.
    """
    rates = _earth_velocity(outputs, antenna)
    return _integral(rates, dt)


def simulated_track_derivatives(
    outputs: FloatArray, by: FloatArray, dt: float, antenna: tuple[float, float]
) -> FloatArray:
    """Compute the derivatives of `simulated_track`, (n, 2, k), from those of the outputs.

    Parameters
    ----------
    outputs
        (n, 4) in the order of `MODEL_OUTPUTS`, SI.
    by
        (n, 4, k) their derivatives.
    dt, antenna
        As in `simulated_track`.
    """
    north, east = _earth_velocity(outputs, antenna).T
    cosine, sine = np.cos(outputs[:, HEADING, None]), np.sin(outputs[:, HEADING, None])
    ahead = by[:, AHEAD] - antenna[1] * by[:, YAW_RATE]
    sway = by[:, SWAY] + antenna[0] * by[:, YAW_RATE]
    turned = by[:, HEADING]
    rates = np.stack(
        (
            cosine * ahead - sine * sway - east[:, None] * turned,
            sine * ahead + cosine * sway + north[:, None] * turned,
        ),
        axis=1,
    )
    return _integral(rates, dt)


def _earth_velocity(outputs: FloatArray, antenna: tuple[float, float]) -> FloatArray:
    ahead = outputs[:, AHEAD] - antenna[1] * outputs[:, YAW_RATE]
    sway = outputs[:, SWAY] + antenna[0] * outputs[:, YAW_RATE]
    cosine, sine = np.cos(outputs[:, HEADING]), np.sin(outputs[:, HEADING])
    return np.column_stack((cosine * ahead - sine * sway, sine * ahead + cosine * sway))


def _integral(rates: FloatArray, dt: float) -> FloatArray:
    """Integrate over the first axis by the trapezoidal rule, from zero."""
    steps = (rates[1:] + rates[:-1]) * (dt / 2)
    return np.concatenate((np.zeros((1, *rates.shape[1:])), np.cumsum(steps, axis=0)))

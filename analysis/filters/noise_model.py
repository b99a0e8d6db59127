"""What a filter is told of noise."""

from dataclasses import dataclass

from shiplog.types import FloatArray

from .wave_fit import Wave


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """What the filter is told of noise.

    The process noise, as a share of the measurement's, is in the pseudo-input filter the paper's
    Q/R of all states; in the others that of yaw moment and surge force, and the fourth and the
    second power of a bandwidth in rad/s.
    """

    measurement_std: FloatArray  # (2,) of one sample of yaw rate, rad/s, and speed, m/s
    process_ratio: FloatArray  # (2,) intensities: 1/s^2 both, or 1/s^4 and 1/s^2
    measured: tuple[bool, bool] = (False, False)  # whether the former was taken from the log
    tuned: tuple[bool, bool] = (False, False)  # whether the latter was
    wave: Wave | None = None  # of the yaw rate, where it is asked for and there

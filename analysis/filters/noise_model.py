"""The noise that a filter assumes."""

from dataclasses import dataclass

from shiplog.types import FloatArray

from .wave_fit import Wave


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """The noise that a filter assumes: white noise of measurements and process, and a wave.

    Attributes
    ----------
    measurement_std
        (2,): standard deviation of the white noise of one sample of the yaw rate, rad/s, and of
        the speed, m/s.
    process_ratio
        (2,): intensity of the process noise over that of the measurement noise, in yaw and surge.
        In the pseudo-input filter the process noise drives all states: the paper's Q/R, 1/s². In
        the other filters it drives the yaw moment and the surge force: 1/s⁴ and 1/s², the fourth
        and the second power of a bandwidth in rad/s.
    measured
        Whether `measurement_std` of each output was estimated from the log.
    tuned
        Whether `process_ratio` of each output was estimated from the log.
    wave
        The wave in the yaw rate; None where none is modelled.
    """

    measurement_std: FloatArray
    process_ratio: FloatArray
    measured: tuple[bool, bool] = (False, False)
    tuned: tuple[bool, bool] = (False, False)
    wave: Wave | None = None

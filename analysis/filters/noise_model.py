"""The noise that a filter assumes: of its sensors, of the ship's motion, and of disturbances."""

from dataclasses import dataclass
from math import inf

from shiplog.types import FloatArray

MIN_CONTRAST = 1.5  # standard errors
FURTHER_OUTPUTS = ("compass", "north", "east")  # measurements beside yaw rate and speed


@dataclass(frozen=True)
class Wave:
    """The shaping filter of a wave in the yaw rate, and the evidence for it.

    Attributes
    ----------
    frequency
        Natural frequency, rad/s.
    damping
        Damping ratio.
    std
        Standard deviation of the wave, rad/s.
    evidence
        Twice the log likelihood ratio of the spectrum with the wave to that without it.
    needed
        The evidence that noise alone reaches in at most one log of a hundred.
    contrast
        Height of the spectrum above its neighbourhood, in standard errors.
    """

    frequency: float
    damping: float
    std: float
    evidence: float
    needed: float = 0.0
    contrast: float = inf

    @property
    def stands_out(self) -> bool:
        """Whether there is a wave: the spectrum is likelier with it and has a peak there.

        The likelihood alone also increases for the low-pass of a sensor or a steep red part, which
        the background model does not contain; neither is higher in its middle than on both sides.
        """
        return self.evidence > self.needed and self.contrast > MIN_CONTRAST


@dataclass(frozen=True)
class SlowError:
    """An error that lasts for some time: a Gauss-Markov process of first order.

    Attributes
    ----------
    std
        Standard deviation, in the unit of the measurement.
    secs
        Correlation time, s.
    """

    std: float
    secs: float


@dataclass(frozen=True)
class ForceNoise:
    """A yaw moment or a surge force of known kind and unknown size, as a state of the filter.

    Attributes
    ----------
    degree
        0 for a random walk, 1 for a ramp whose slope is one; None for no slow part.
    frequency
        How fast the slow part is followed, rad/s: the optimal filter of a random walk has
        Butterworth poles of this magnitude, as the disturbance observer has.
    wave
        Frequency of a wave, rad/s; None for no wave.
    reduction
        How much lower Akaike's criterion is without a slow part, where there is none for this
        reason; else zero.
    """

    degree: int | None
    frequency: float
    wave: float | None = None
    reduction: float = 0.0


@dataclass(frozen=True)
class FurtherModel:
    """The states of a filter beside the ship's: sensor errors, heading, position, disturbances.

    Attributes
    ----------
    outputs
        The further measurements, in the order of `FURTHER_OUTPUTS`: none, the compass, or all.
    output_stds
        The standard deviation of the white noise of one sample of each, rad and m.
    sensors
        The sensor errors, some of `shiplog.vessel.settings.SENSOR_ERRORS`.
    yaw, surge
        The yaw moment and the surge force; None where the filter has no such state.
    heading_error
        The slow error of the heading, rad; None where its noise is white.
    wind
        The terms of the wind, some of `analysis.filters.wind_terms.WIND_TERMS`.
    """

    outputs: tuple[str, ...] = ()
    output_stds: tuple[float, ...] = ()
    sensors: tuple[str, ...] = ()
    yaw: ForceNoise | None = None
    surge: ForceNoise | None = None
    heading_error: SlowError | None = None
    wind: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        """Whether there is any further state."""
        return bool(self.outputs or self.sensors or self.yaw or self.surge or self.wind)


NO_FURTHER = FurtherModel()


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
    further
        The further states of the filter; empty by default.
    """

    measurement_std: FloatArray
    process_ratio: FloatArray
    measured: tuple[bool, bool] = (False, False)
    tuned: tuple[bool, bool] = (False, False)
    wave: Wave | None = None
    further: FurtherModel = NO_FURTHER

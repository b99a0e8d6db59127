"""The motion of a ship in a manoeuvre, and one index of it."""

from dataclasses import dataclass

from shiplog.types import FloatArray


@dataclass(frozen=True, eq=False)
class ManoeuvreMotion:
    """A ship's motion at n evenly spaced samples.

    Attributes
    ----------
    heading
        (n,) rad, continuous: it does not wrap at a full turn.
    yaw_rate
        (n,) rad/s.
    speed
        (n,) through the water, m/s.
    positions
        (n, 2) north and east, m; NaN where unknown.
    """

    heading: FloatArray
    yaw_rate: FloatArray
    speed: FloatArray
    positions: FloatArray


@dataclass(frozen=True)
class ManoeuvreIndex:
    """An index of a manoeuvre, measured and simulated.

    Attributes
    ----------
    name
        Such as ``advance`` or ``overshoot 1``.
    unit
        The SI unit of both values.
    measured, simulated
        The values; NaN where the motion does not reach it.

    Examples
    --------
    >>> ManoeuvreIndex("advance", "m", measured=900.0, simulated=918.0).error
    18.0
    """

    name: str
    unit: str
    measured: float
    simulated: float

    @property
    def error(self) -> float:
        """Simulated minus measured."""
        return self.simulated - self.measured

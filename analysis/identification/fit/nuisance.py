"""What each run of a fit has of its own besides the ship: rudder zero, sensor errors, current."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import radians


@dataclass(frozen=True)
class Nuisance:
    """Prior standard deviations about zero of the unknowns besides parameters and initial states.

    The rudder zero stands for an error of the rudder's zero and for every constant yaw moment, as
    of a propeller or a trim. It has a part that all runs share, which predictions carry, and a
    part of each run. Speed scale and current are unknowns only where positions are fitted.

    Attributes
    ----------
    common_rudder_std
        Of the rudder zero that all runs share, rad; 0 to have none.
    rudder_std
        Of each segment's deviation from it, rad; 0 to have none.
    bias_stds
        Of the sensor bias of each output named, in its SI unit; the others have none.
    speed_scale_std
        Of the scale error of the measured speed through the water, relative.
    current_std
        Of each component of the current, m/s.
    """

    common_rudder_std: float = radians(0.5)
    rudder_std: float = radians(0.5)
    bias_stds: Mapping[str, float] = field(default_factory=lambda: {"yaw_rate": radians(0.005)})
    speed_scale_std: float = 0.02
    current_std: float = 1.0

    @classmethod
    def none(cls) -> "Nuisance":
        """Return no unknowns besides the initial state."""
        return cls(0.0, 0.0, {}, 0.0, 0.0)

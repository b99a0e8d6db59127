"""A manoeuvre as it is found in the signals of a trial, before its indices are computed."""

from dataclasses import dataclass, field

import numpy as np

from shiplog.types import FloatArray

from .sailed_manoeuvre import ManoeuvreKind


@dataclass(frozen=True, eq=False)
class FoundManoeuvre:
    """Where a manoeuvre is in the signals of a trial.

    Attributes
    ----------
    kind
        What it is.
    execute
        The sample at which the rudder, or the revolutions, begin to move.
    end
        The sample after the last one.
    level
        The rudder angle held first, signed, rad; NaN where the rudder plays no part.
    approach_level
        The rudder angle before the execute, rad.
    reversals
        Samples at which the rudder begins to move again: the further executes of a zig-zag.
    levels
        (k, 3) the first and the last sample and the level of each stretch of a spiral.
    """

    kind: ManoeuvreKind
    execute: int
    end: int
    level: float = np.nan
    approach_level: float = 0.0
    reversals: tuple[int, ...] = ()
    levels: FloatArray = field(default_factory=lambda: np.empty((0, 3)))

    @property
    def movement(self) -> float:
        """The sign of the rudder's first movement, which is back to midships in a pull-out."""
        return -self.side if self.kind is ManoeuvreKind.PULL_OUT else self.side

    @property
    def side(self) -> float:
        """1 to starboard, -1 to port."""
        return float(np.sign(self.level)) if self.level else 1.0

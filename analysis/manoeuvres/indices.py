"""Indices of a manoeuvre, measured and simulated, whichever manoeuvre it is."""

from collections.abc import Iterator
from math import degrees

import numpy as np

from shiplog.types import FloatArray

from .execute import MIN_RUDDER_ORDER, first_execute, remove_spikes
from .manoeuvre import ManoeuvreIndex, ManoeuvreMotion
from .turning_circle import MIN_CIRCLE_TURN, turning_circle_indices
from .zigzag import is_zigzag, rudder_holds, zigzag_indices


def manoeuvre_indices(
    rudder: FloatArray, measured: ManoeuvreMotion, simulated: ManoeuvreMotion, dt: float
) -> Iterator[ManoeuvreIndex]:
    """Compare the indices of a measured and of a simulated run under the same rudder.

    Times and distances count from the first rudder order (`first_execute`), changes of heading
    from the mean heading before it.

    Parameters
    ----------
    rudder
        (n,) rad.
    measured, simulated
        The motion at the same n samples, without NaN but for positions.
    dt
        Sample interval, s.

    Yields
    ------
    ManoeuvreIndex
        Those of a turning circle or of a zig-zag; none for any other run.
    """
    rudder = remove_spikes(rudder, dt)
    execute = first_execute(rudder, dt)
    if execute is None:
        return
    holds = rudder_holds(rudder, execute)
    if is_zigzag(rudder, execute, holds, dt):
        yield from zigzag_indices(execute, holds, measured, simulated, dt)
    else:
        yield from turning_circle_indices(rudder, execute, measured, simulated, dt)


def reason_without_indices(rudder: FloatArray, heading: FloatArray, dt: float) -> str:
    """Explain why a run has no indices.

    Parameters
    ----------
    rudder, heading
        (n,) rad, of a run for which `manoeuvre_indices` yields none.
    dt
        Sample interval, s.

    Examples
    --------
    >>> import numpy as np
    >>> reason_without_indices(np.zeros(60), np.zeros(60), 1.0)
    'no rudder order above 2°'
    """
    rudder = remove_spikes(rudder, dt)
    execute = first_execute(rudder, dt)
    if execute is None:
        return f"no rudder order above {degrees(MIN_RUDDER_ORDER):.0f}°"
    holds = rudder_holds(rudder, execute)
    if is_zigzag(rudder, execute, holds, dt):
        return "a zig-zag whose rudder is not always reversed at the same change of heading"
    if len(holds) > 1:
        return (
            f"the rudder is held over {len(holds)} times, but a zig-zag needs three times or more "
            "at equal angles to alternate sides, reversed without interruption"
        )
    turned = float(np.max(np.abs(heading[execute:] - heading[execute])))
    if turned < MIN_CIRCLE_TURN:
        return (
            f"the heading changes by {degrees(turned):.0f}° after the rudder order; a turning "
            f"circle needs {degrees(MIN_CIRCLE_TURN):.0f}°"
        )
    return "the rudder is not held at one angle for a quarter of a turning circle"

"""Indices of a manoeuvre, measured and simulated, whichever manoeuvre it is."""

from collections.abc import Iterator

from shiplog.types import FloatArray

from .execute import first_execute, remove_spikes
from .manoeuvre import ManoeuvreIndex, ManoeuvreMotion
from .turning_circle import turning_circle_indices
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

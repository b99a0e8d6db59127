"""Current in a long turn: a drifting and settling circle fitted to its positions.

IMO MSC/Circ.1053, explanatory notes, takes the mean displacement between positions 360° apart after
the first 180°, which presumes a steady turn. A large ship settles more slowly: its path through the
water does not close, and the mean has a bias of some centimetres per second. Here the velocity
through the water is ``(a + b exp(-t/τ)) exp(i ψ)`` with complex a and b, the drift angle included;
heading and positions suffice.
"""

from math import pi, radians

import numpy as np

from shiplog.types import FloatArray

from .found_manoeuvre import FoundManoeuvre
from .trial_signals import TrialSignals

FIRST_ANGLE = pi  # of heading, from which the circle is fitted
MIN_FITTED_TURN = 2 * pi + radians(20.0)
BLOCK = radians(
    30.0
)  # of heading, whose mean positions are fitted: their residuals are independent
SETTLING_TURNS = (0.1, 0.15, 0.25, 0.4, 0.6)  # τ in the time of a full circle, of which one fits
POSITION_DRIFT = 0.5  # m, slow error of positions over a stretch


def current_in_turn(
    signals: TrialSignals, found: FoundManoeuvre
) -> tuple[FloatArray, float] | None:
    """Estimate the current from the positions of a turn of more than 560°.

    Parameters
    ----------
    signals
        Without NaN where measured.
    found
        A turning circle.

    Returns
    -------
    current
        (2,) north and east, m/s.
    std
        Standard uncertainty of each component, m/s: from the residuals, and from the slow error of
        the positions over a full circle. None where the turn is too short.
    """
    part = slice(found.execute, found.end)
    heading = signals.heading[part]
    turned = np.maximum.accumulate(found.side * (heading - heading[0]))
    if turned[-1] < FIRST_ANGLE + MIN_FITTED_TURN:
        return None
    first = int(np.searchsorted(turned, FIRST_ANGLE))
    turned, ahead = turned[first:] - turned[first], np.exp(1j * heading[first:])
    positions = signals.positions[part][first:] @ [1, 1j]
    time = np.arange(len(turned)) * signals.dt_secs
    circle_secs = float(np.interp(2 * pi, turned, time))
    starts = np.searchsorted(turned, np.arange(0.0, turned[-1], BLOCK))
    sizes = np.diff([*starts, len(turned)])

    def fitted(settling: float) -> tuple[float, complex, float]:
        decay = np.exp(-time / (settling * circle_secs))
        columns = np.column_stack(
            (np.ones(len(time)), time, np.cumsum(ahead), np.cumsum(ahead * decay))
        )
        matrix = np.add.reduceat(columns, starts) / sizes[:, None]
        places = np.add.reduceat(positions, starts) / sizes
        solution = np.linalg.lstsq(matrix, places)[0]
        squares = float(np.sum(np.abs(places - matrix @ solution) ** 2))
        variance = squares / (2 * (len(places) - matrix.shape[1]))  # of each component
        share = float(np.linalg.inv(matrix.conj().T @ matrix)[1, 1].real)
        return squares, complex(solution[1]), float(np.sqrt(variance * share))

    _, current, std = min(map(fitted, SETTLING_TURNS))
    drift = np.sqrt(2.0) * POSITION_DRIFT / circle_secs
    return np.array([current.real, current.imag]), float(np.hypot(std, drift))

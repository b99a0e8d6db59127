"""First model of a ship without a vessel file, fitted to the log itself."""

from analysis.signals.signal_stats import SignalStats
from shiplog.errors import LogError
from shiplog.ships.paper import SURGE_COEFFICIENTS, Coefficients
from shiplog.vessel.vessel import Vessel

from .coefficients import WholeTrialRegression

# Without a model, nothing is known of the slipstream: the rudder's effectiveness is taken as
# proportional to the speed, and d and e contain its factor.
SPEED_PROPORTIONAL_RUDDER = Coefficients(
    a=0.0, b1=0.0, b2=0.0, b3=0.0, d=0.0, e=0.0, f=0.0, g=0.0, h=0.0,
    alpha1=1.0, alpha2=0.0, alpha3=0.0,
)  # fmt: skip

YAW_FORMS = (("a", "b1", "b2", "d", "e"), ("a", "b1", "d", "e"), ("a", "d", "e"))
SURGE_FORMS = (SURGE_COEFFICIENTS, ("f", "h"))


def fit_first_model(
    yaw: WholeTrialRegression, surge: WholeTrialRegression, stats: SignalStats, name: str
) -> Vessel:
    """Fit a vessel's coefficients to the whole log, by least squares in weak form.

    b3 is always zero, since on a real ship it cannot be distinguished from b2; b2 and b1 are zero
    where the log does not determine them. A constant compensates the rudder's zero offset.

    Parameters
    ----------
    yaw, surge
        The regressions of both equations, after the rows of `SPEED_PROPORTIONAL_RUDDER` have been
        added; that of yaw with a constant.
    stats
        The statistics of the log's signals; the median revolutions are the approach revolutions.
    name
        The log's name, for the vessel's name and for messages.

    Returns
    -------
    vessel
        A vessel with these coefficients.

    Raises
    ------
    LogError
        The log is too short or moves too little to determine even the simplest form.
    """
    estimates = _fit_largest_form(yaw, YAW_FORMS) | _fit_largest_form(surge, SURGE_FORMS)
    missing = [part for part, key in (("yaw", "a"), ("surge", "f")) if key not in estimates]
    if missing:
        raise LogError(
            f"the log contains no model, and too little motion to fit {' and '.join(missing)}; "
            f"give a vessel file with --vessel: {name}"
        )
    return Vessel(
        f"fitted to {name}",
        SPEED_PROPORTIONAL_RUDDER._replace(**estimates),
        approach_rpm=stats.median_rpm,
    )


def _fit_largest_form(
    rows: WholeTrialRegression, forms: tuple[tuple[str, ...], ...]
) -> dict[str, float]:
    """Return the coefficients of the first form that the rows determine; empty if none."""
    for names in forms:
        solution = rows.solution(names)
        if solution.determined[: len(names)].all():
            return dict(zip(names, solution.values.tolist(), strict=False))
    return {}

"""A first model, from the log itself, for a ship of which nothing is known."""

from analysis.signals.signal_stats import SignalStats
from shiplog.errors import LogError
from shiplog.ships.paper import SURGE_COEFFICIENTS, Coefficients
from shiplog.vessel.vessel import Vessel

from .coefficients import WholeTrialRegression

# The rudder works in proportion to the speed: without a model nothing is known of the
# slipstream, and d and e take the factor up.
SPEED_PROPORTIONAL_RUDDER = Coefficients(
    a=0.0, b1=0.0, b2=0.0, b3=0.0, d=0.0, e=0.0, f=0.0, g=0.0, h=0.0,
    alpha1=1.0, alpha2=0.0, alpha3=0.0,
)  # fmt: skip

YAW_FORMS = (("a", "b1", "b2", "d", "e"), ("a", "b1", "d", "e"), ("a", "d", "e"))
SURGE_FORMS = (SURGE_COEFFICIENTS, ("f", "h"))


def fit_first_model(
    yaw: WholeTrialRegression, surge: WholeTrialRegression, stats: SignalStats, name: str
) -> Vessel:
    """A vessel whose coefficients are those of the whole log, by least squares in weak form.

    b3 is left out, for on a real ship it cannot be told from b2; and b2 and b1 where the log
    cannot tell them either. A constant takes up the rudder's zero. `yaw` and `surge` were given
    the rows of `BARE`. Raises `LogError` where the log is too short or
    too quiet to tell even so much.
    """
    found = _richest(yaw, YAW_FORMS) | _richest(surge, SURGE_FORMS)
    unknown = [part for part, key in (("yaw", "a"), ("surge", "f")) if key not in found]
    if unknown:
        raise LogError(
            f"the log carries no model, and too little moves in it to fit one of "
            f"{' and '.join(unknown)}; give the ship's with --vessel: {name}"
        )
    return Vessel(
        f"fitted to {name}",
        SPEED_PROPORTIONAL_RUDDER._replace(**found),
        approach_rpm=stats.median_rpm,
    )


def _richest(rows: WholeTrialRegression, forms: tuple[tuple[str, ...], ...]) -> dict[str, float]:
    """The coefficients of the first of the forms that the rows can tell; none if they cannot."""
    for names in forms:
        solution = rows.solution(names)
        if solution.determined[: len(names)].all():
            return dict(zip(names, solution.values.tolist(), strict=False))
    return {}

"""The section of docs/methods.md on the wind as a disturbance with a name."""

from math import degrees, radians

from papers.markdown_page import number, paragraph, table

from analysis import Analysis, analyse
from analysis.filters.wind_terms import WIND_RESISTANCE, WIND_RUDDER
from analysis.replay.sensor_errors import further_display
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.wind import APPARENT_WIND, REFERENCE_WIND, Wind
from shiplog import TrialLog, load_vessel

WIND = Wind(12.0, radians(45))
SMOOTHED = {"filter.kind": "extended", "filter.smooth": True}
MANOEUVRES = {"turning circle 35": "turning-circle-35", "zig-zag 20/20": "zigzag-20-20"}
TRUE_TERMS = ("wind_oblique", "wind_beam", "wind_head")
EQUATIONS = """\
## Wind as a disturbance

With `--smooth --disturbance constant,wind` the moment and the force of the wind measured on board
are estimated by name:

    w'' = … + c_oblique V² sin 2γ + c_beam V² sin γ
    v'  = … + c_head (v |v| − V² cos γ)

V and γ are speed and angle of the wind relative to the ship, from ahead to starboard: measured
(`apparent_wind_speed`, `apparent_wind_angle`), or from the true wind (`wind_speed` with
`true_wind_angle`, or with `wind_direction` and the heading) by the speed of the ship. The force is
the one beyond that of still air, as in ITTC 7.5-04-01-01.1, which belongs to the resistance. The
coefficients are states of unknown sign, and begin at zero with these standard deviations, about
twice the largest that Isherwood (1973) and Blendermann (1994) give for merchant ships. In an hour
they change by a fiftieth of them."""
CAUTION = """\
A steady wind on a straight course acts as a constant moment and a constant force: a term whose
regressor, averaged over 20 s, differs by less than 5 % from what the other disturbances can be
counts as not determined, with the reason, and where no other term remains the wind is refused. The
others count as determined by the same rule as sensor errors, and where the model was not fitted to
the same log. Where the anemometer is silent, the last wind is held, with a warning. The noise of
the anemometer makes the coefficients slightly too small; a wind that is disturbed by the
superstructure makes them those of this anemometer. The side force of the wind has no state of its
own in these models: the turning that it causes counts in the terms of yaw, the leeway in the
current."""


def wind_states() -> None:
    """Print the section."""
    paragraph(EQUATIONS)
    rudder, share = number(degrees(WIND_RUDDER)), number(100 * WIND_RESISTANCE)
    rows = [
        ("oblique wind, yaw", f"that of {rudder}° of rudder, at 45° on the bow"),
        ("beam wind, yaw", f"that of {rudder}° of rudder, abeam"),
        ("head wind, surge", f"{share} % of the resistance"),
    ]
    table("", ("term", "σ at the start, in a wind as fast as the ship"), rows)
    paragraph(CAUTION)
    in_a_wind()


def in_a_wind() -> None:
    """Print what is estimated of a simulated wind, and what is unexplained with and without it."""
    rows = []
    for label, manoeuvre in MANOEUVRES.items():
        trial = windy_trial(manoeuvre)
        truth = true_terms(trial)
        for models in (["constant"], ["constant", "wind"]):
            result = replayed(trial, models)
            rms = {name: each.rms for name, each in result.findings.disturbances.items()}
            cells = number(degrees(rms["rudder"]), 2), number(1e3 * rms["surge"], 2)
            rows.append((f"{label}: {', '.join(models)}", *cells, *stated(result)))
        shown = (number(value * further_display(n, "")[1], 3) for n, value in truth.items())
        rows.append((f"{label}: in truth", "0", "0", *shown))
    paragraph(
        f"Two simulated manoeuvres in a wind of {number(WIND.speed)} m/s from 45°, with white noise"
        " of gyro, log and anemometer (0.3 m/s and 2° of a sample each second): the rms of the"
        " disturbances that remain, and the coefficients as what a relative wind of 10 m/s does,"
        " with their 95 % intervals:"
    )
    header = (
        "manoeuvre and disturbances", "yaw moment (°)", "surge force (mm/s²)",
        "oblique (10⁻⁶ °/s³)", "beam (10⁻⁶ °/s³)", "head (mm/s²)",
    )  # fmt: skip
    table("", header, rows)


def windy_trial(manoeuvre: str) -> SimulatedTrial:
    """Simulate a manoeuvre in the wind."""
    vessel, text = load_vessel("table1")
    sensors = suite("white", {"yaw_rate.rate_hz": 2.0, "speed.rate_hz": 2.0}, also=APPARENT_WIND)
    return simulate(
        vessel, manoeuvre, duration_secs=500.0, seed=1, sensors=sensors, wind=WIND,
        vessel_toml=text,
    )  # fmt: skip


def true_terms(trial: SimulatedTrial) -> dict[str, float]:
    """Return the true coefficients of the wind, in SI."""
    trajectory = trial.trajectory
    per_rudder = trajectory.ship.moment_per_rudder(trajectory.constants)[0] / REFERENCE_WIND**2
    values = per_rudder * WIND.oblique, per_rudder * WIND.beam, WIND.drag
    return dict(zip(TRUE_TERMS, values, strict=True))


def replayed(trial: SimulatedTrial, models: list[str]) -> Analysis:
    """Replay a trial with some models of disturbances, smoothed."""
    log = TrialLog("trial.mcap", trial.channels, trial.metadata, trial.vessel_toml)
    return analyse(log, settings=SMOOTHED | {"disturbance.models": models})


def stated(result: Analysis) -> list[str]:
    """Return each coefficient with its 95 % interval; dashes where none is estimated."""
    found = {term.name: term for term in result.findings.wind if term.determined}
    cells = []
    for name in TRUE_TERMS:
        if name not in found:
            cells.append("–")
            continue
        factor, term = further_display(name, "")[1], found[name]
        cells.append(f"{number(term.value * factor, 3)} ± {number(1.96 * term.std * factor, 2)}")
    return cells

"""How often the 95 % intervals of the manoeuvring indices contain the true index.

Three ships by their published equations (`examples/ships`) sail turning circles and zig-zags from
both sides, with helm of 0 to 1.5° in the approach, in a current, with sensors of good and of poor
quality whose compass and log have errors of the sizes that the analysis assumes. Prints a page::

    python examples/trial_intervals.py --trials 200 > docs/trial_intervals.md
"""

import argparse
from collections import defaultdict
from dataclasses import dataclass, field, replace
from math import radians, sqrt

import numpy as np
from ships.sea_trial import GOOD, POOR, SHIPS, STEP, SailedTrial, Steering, as_log, sail
from ships.true_indices import circle_indices, zigzag_indices

from analysis import analyse_trial
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.replay.reading_options import ReadingOptions

KINDS = {
    "turning circle 35°": (35.0, None),
    "zig-zag 10°/10°": (10.0, 10.0),
    "zig-zag 20°/20°": (20.0, 20.0),
}
SECONDS = {
    "mariner": (1100.0, 500.0), "kvlcc2": (1400.0, 900.0), "seiun-maru": (450.0, 400.0),
}  # fmt: skip
SAILED = [ship for ship in SHIPS if ship.name in SECONDS]
COURSE, HELM_DEG, HELM_PERIOD = 3.0, (0.0, 1.5), (30.0, 60.0)
CURRENT_STD, COMPASS_STD, LOG_STD = 0.4, radians(0.5), 0.02
DEFLECTION_STD = radians(0.25)
SEED = 1
HEAD = """# The intervals of manoeuvring indices, tried on independent ships

Printed by `python examples/trial_intervals.py --trials {trials} > docs/trial_intervals.md`.

{trials} trials of each kind: the Mariner (Chislett and Strøm-Tejsen 1965), the tanker KVLCC2
(Yasukawa and Yoshimura 2015) and the Seiun Maru (Yoshimura and Masumoto 2012), by their published
equations and not by a model of shiplog. Half of them turn to port first; helm in the approach has
an amplitude of 0 to 1.5°; the current has a standard deviation of {current} m/s in each component.
Good sensors: 2 Hz, heading and rudder 0.1°, log 0.05 m/s, position 1 m. Poor ones: 1 Hz, 0.3°,
0.15 m/s, 3 m. Compass and log have constant errors of 0.5° and 2 % (standard deviations), and the
compass deflects by 0.25° (standard deviation) within 10 s of the order, as the analysis assumes.
The true index is that of the noise-free motion through the water, from the instant of the order and
the course steered.

In {trials} trials a true share of 95 % shows as 95 % ± {scatter:.1f} % (two standard deviations);
errors of one trial's indices are not independent.
"""


@dataclass
class Score:
    """Errors of an index in all trials, and whether its interval contains the true value."""

    inside: list[bool] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)  # in standard uncertainties


def true_values(trial: SailedTrial, steering: Steering) -> dict[str, float]:
    """Compute the indices of the true motion."""
    turn = trial.turn(steering)
    if steering.switch is None:
        values = circle_indices(turn)
        return {name: value for name, value in values.items() if "steady" not in name}
    first = round(steering.execute / STEP)
    executes = [round(time / STEP) - first for time in steering.executes]
    return zigzag_indices(turn, steering.switch, executes)


def try_intervals(kind: str, trials: int) -> tuple[dict[str, Score], int]:
    """Sail and analyse trials of a kind; return scores by index, and how many were found alone."""
    rng = np.random.default_rng(SEED)
    scores: dict[str, Score] = defaultdict(Score)
    found = 0
    rudder, switch = KINDS[kind]
    for number in range(trials):
        ship = SAILED[number % len(SAILED)]
        side = 1 if number // 3 % 2 else -1
        steering = Steering(
            ship, 120.0 + round(rng.uniform(0, 30)), side * radians(rudder),
            None if switch is None else radians(switch), course=rng.uniform(-COURSE, COURSE),
            helm=radians(rng.uniform(*HELM_DEG)), helm_period=rng.uniform(*HELM_PERIOD),
            phase=rng.uniform(0, 6),
        )  # fmt: skip
        secs = SECONDS[ship.name][switch is not None]
        trial = sail(ship, steering, secs, course=steering.course)
        sensors = replace(
            GOOD if number // 6 % 2 else POOR,
            compass_bias=rng.normal(0, COMPASS_STD),
            speed_scale=rng.normal(0, LOG_STD),
            compass_deflection=rng.normal(0, DEFLECTION_STD),
            deflected_at=steering.execute,
        )
        current = (rng.normal(0, CURRENT_STD), rng.normal(0, CURRENT_STD))
        log = as_log(trial, sensors, rng, current)
        analysis = analyse_trial(log, ReadingOptions(length=ship.length))
        wanted = ManoeuvreKind.TURNING_CIRCLE if switch is None else ManoeuvreKind.ZIGZAG
        if [each.kind for each in analysis.manoeuvres] != [wanted]:
            continue
        found += 1
        true = true_values(trial, steering)
        for index in analysis.manoeuvres[0].indices:
            value = true.get(index.name, np.nan)
            if np.isfinite(value):
                scores[index.name].inside.append(index.low <= value <= index.high)
                scores[index.name].errors.append((index.value - value) / index.std)
    return scores, found


def main() -> None:
    """Print the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=200, help="of each kind")
    trials = parser.parse_args().trials
    scatter = 200 * sqrt(0.95 * 0.05 / trials)
    print(HEAD.format(trials=trials, current=CURRENT_STD, scatter=scatter))
    for kind in KINDS:
        scores, found = try_intervals(kind, trials)
        print(f"## {kind}\n\nFound, and nothing else, in {found} of {trials} trials.\n")
        print("| index | trials | in the 95 % interval | error over its uncertainty: mean, rms |")
        print("| --- | ---: | ---: | ---: |")
        for name, score in scores.items():
            errors = np.array(score.errors)
            share = f"{100 * np.mean(score.inside):.1f} %"
            rms = float(np.sqrt(np.mean(errors**2)))
            print(f"| {name} | {len(errors)} | {share} | {np.mean(errors):+.2f}, {rms:.2f} |")
        print()


if __name__ == "__main__":
    main()

"""How often a change of a coefficient is seen where there is none, and where there is one.

    python -m benchmarks.changes > docs/changes.md

The paper's ship in both readings, her model stated and guessed, under the paper's noise and under
white noise. What is printed is the page.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from analysis.regression.changes import Change, ShipChangeTest
from analysis.regression.first_model import SPEED_PROPORTIONAL_RUDDER
from analysis.regression.weak_form import CHANNELS, WeakForm
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, load_vessel, resample

from .changed_ship import changed_trial

VESSELS = ("table1", "table1-rad")
MANOEUVRES = ("zigzag-20-20", "zigzag-10-10", "pseudo-random", "turning-circle")
DURATIONS = (600.0, 1200.0, 3600.0)
NOISES = ("paper", "white")
SEEDS, FIRST_SEED = 20, 100
CHANGED_SECS, HALFWAY_SECS = 1200.0, 600.0
WINDOW_SECS = 200.0  # a change that is told so near is told at the right time
FACTORS = (0.8, 1.2)
CHANGED = ("d", "f", "b2")
INTRODUCTION = """\
# Changes within a trial

This page is made by

    python -m benchmarks.changes > docs/changes.md

`shiplog replay` tells whether a coefficient changed during the trial: which one, when, and by how
much. Each equation in integral form is fitted with one more column, the coefficient's own, zero
before an instant; the instant is the one that leaves the least squares, and Wald's test weighs the
difference. Its errors are Newey and West's over the rows that share data, judged by Student's
distribution with as many degrees of freedom as the rows leave; as every instant and every
coefficient was tried, the largest is judged by Andrews' distribution and by how many coefficients
there are, at 2 % an equation. Either side of a change must hold 15 % of what the trial tells of the
coefficient, and something must move on it. Rows within 45 s of the instant belong to neither side.
What else changed at the same instant is added one by one; then each side is searched for itself.

A coefficient that might have changed in place of the one that is named is named too: b1, b2 and b3
do much the same, and so do f and h where the yaw rate is always as large. A steady yaw moment may
come and go, and is left to the disturbance observer; a gust in the last minutes of a trial may
still pass for a change of d. Changes below 1 % are not told. Where the model was fitted to the log
nothing is known of the propeller's race: whatever the revolutions may do to the rudder is allowed
for, and of yaw no changes below 10 % are told. Of a real ship a change says no more than that the
model does not hold for both sides with the same coefficients."""

POWER = """
## Where something did

A coefficient that becomes {factors[0]:g} or {factors[1]:g} times what it was at {at:.0f} of
{of:.0f} s; seeds: {seeds}. *Found*: it is named, alone or as one that may have changed, within
{window:.0f} s of it. *Named*: by itself or first. Of these the median error of time and of size (in
per cent of the coefficient before), the median half of the interval, and how many of the 95 %
intervals hold the truth. *Others*: changes told that were none.

Table 1 in radians turns so slowly that its f tells nothing and its b2 little: the noise is larger
than what they do. Under the paper's noise, which holds a slow wave, f is found in a zig-zag, but
seldom among the revolutions of a pseudo-random run. There the intervals of a d whose model was
guessed are too short, for what the race does is only nearly allowed for.
"""


@dataclass(frozen=True)
class Case:
    """What is sailed, and how it is looked at."""

    vessel: str
    guessed: bool
    manoeuvre: str
    noise: str


def told(log: TrialLog, case: Case) -> tuple[Change, ...]:
    """The changes that a replay tells of a log."""
    signals = resample(log, channels=CHANNELS)
    model = (
        SPEED_PROPORTIONAL_RUDDER
        if case.guessed
        else load_vessel(case.vessel)[0].paper_coefficients
    )
    equations = WeakForm(model, len(signals), signals.dt_secs, (1, 1, 1, 1))
    watch = ShipChangeTest(equations, model_is_fitted=case.guessed)
    watch.add(*equations.step(signals, float(np.max(np.abs(signals["speed"])))))
    return watch.result()


def unchanged(case: Case, duration_secs: float, seed: int) -> TrialLog:
    """A trial of a ship that stays as she is."""
    vessel = load_vessel(case.vessel)[0]
    sensors = suite(case.noise, angle_unit=vessel.angle_unit)
    sailed = simulate(
        vessel, case.manoeuvre, duration_secs=duration_secs, seed=seed, sensors=sensors
    )
    return TrialLog("unchanged", sailed.channels)


def halfway(case: Case, name: str, factor: float, seed: int) -> TrialLog:
    """A trial of a ship of which one coefficient changes halfway."""
    vessel = load_vessel(case.vessel)[0]
    return changed_trial(
        vessel,
        case.manoeuvre,
        {name: factor},
        at_secs=HALFWAY_SECS,
        duration_secs=CHANGED_SECS,
        seed=seed,
        sensors=suite(case.noise, angle_unit=vessel.angle_unit),
    )


def cases(manoeuvres: tuple[str, ...]) -> Iterator[Case]:
    """All of them, the model stated first."""
    for vessel, guessed, manoeuvre, noise in product(VESSELS, (False, True), manoeuvres, NOISES):
        yield Case(vessel, guessed, manoeuvre, noise)


def false_alarms(seeds: int) -> None:
    """How many logs without a change are said to have one."""
    print("\n## Where nothing changed\n")
    print(
        f"Logs said to have a change, of {seeds} seeds and lengths of 600, 1200 and 3600 s each.\n"
    )
    print("| ship | model | manoeuvre | noise | false alarms |\n|---|---|---|---|---|")
    every = {False: [0, 0], True: [0, 0]}
    for case in cases(MANOEUVRES):
        runs = product(DURATIONS, range(FIRST_SEED, FIRST_SEED + seeds))
        alarms = sum(bool(told(unchanged(case, secs, seed), case)) for secs, seed in runs)
        every[case.guessed][0] += alarms
        every[case.guessed][1] += seeds * len(DURATIONS)
        print(f"| {_said(case)} | {alarms} of {seeds * len(DURATIONS)} |")
    for guessed, (alarms, count) in every.items():
        said = "guessed" if guessed else "stated"
        print(f"\nModel {said}: {alarms} of {count}, {100 * alarms / count:.1f} %.")


def power(seeds: int) -> None:
    """How many changes are found, when, and whether their intervals hold."""
    print(
        POWER.format(
            factors=FACTORS, at=HALFWAY_SECS, of=CHANGED_SECS, seeds=seeds, window=WINDOW_SECS
        )
    )
    print("| ship | model | manoeuvre | noise | changed | found | named | s | size % | ± % | hold |"
          " others |\n" + "|---" * 12 + "|")  # fmt: skip
    held = []
    for case, name in product(cases(MANOEUVRES[:3]), CHANGED):
        line, inside = _power_line(case, name, seeds)
        held += inside
        print(line)
    print(f"\nOf all {len(held)} intervals {100 * np.mean(held):.1f} % hold the truth.")


def _power_line(case: Case, name: str, seeds: int) -> tuple[str, list[bool]]:
    found, others, named = 0, 0, []
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        factor = FACTORS[seed % 2]
        changes = told(halfway(case, name, factor, seed), case)
        near = [c for c in changes if abs(c.at_secs - HALFWAY_SECS) < WINDOW_SECS]
        right = [c for c in near if name in (c.name, *c.alternatives)]
        found, others = found + bool(right), others + len(changes) - len(right)
        named += [
            (abs(c.at_secs - HALFWAY_SECS), abs(c.relative_change - factor + 1),
             c.relative_change_half_width)
            for c in right if c.name == name
        ]  # fmt: skip
    of = np.array(named).reshape(-1, 3)
    of = of[np.isfinite(of[:, 1])]
    inside = (of[:, 1] < of[:, 2]).tolist()
    numbers = ["", "", "", ""]
    if len(of):
        secs, size, half = np.median(of, axis=0)
        numbers = [f"{secs:.0f}", f"{100 * size:.2g}", f"{100 * half:.2g}",
                   f"{sum(inside)} of {len(of)}"]  # fmt: skip
    line = f"| {_said(case)} | {name} | {found} of {seeds} | {len(named)} | {' | '.join(numbers)}"
    return f"{line} | {others or ''} |", inside


def _said(case: Case) -> str:
    return " | ".join(
        (case.vessel, "guessed" if case.guessed else "stated", case.manoeuvre, case.noise)
    )


def main() -> None:
    """The whole page."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.changes", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"of each (default: {SEEDS})")
    arguments = parser.parse_args()
    print(INTRODUCTION)
    false_alarms(arguments.seeds)
    power(arguments.seeds)


if __name__ == "__main__":
    main()

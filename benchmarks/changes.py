"""How often a change of a coefficient is reported, with and without a change.

    python -m benchmarks.changes > docs/changes.md

The paper's ship in both readings of its table, with its model stated and guessed, under the paper's
noise and under white noise. The output is the page.
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
WINDOW_SECS = 200.0  # a change reported within it counts as found
FACTORS = (0.8, 1.2)
CHANGED = ("d", "f", "b2")
INTRODUCTION = """\
# Changes within a trial

This page is made by

    python -m benchmarks.changes > docs/changes.md

`shiplog replay` tests whether a coefficient changed during the trial, and estimates which one,
when and by how much. Each equation in integral form is fitted with one more column: the
coefficient's own, set to zero before an instant. The instant with the smallest sum of squared
residuals is chosen, and Wald's test is applied to the difference. Its standard errors are Newey
and West's over the rows that share data; its distribution is Student's with the degrees of
freedom of the rows. As every instant and every coefficient is tried, the largest statistic is
judged by Andrews' distribution and the number of coefficients, at a level of 2 % per equation.
Either side of a change must contain 15 % of the trial's information on the coefficient, and the
ship must move on it. Rows within 45 s of the instant belong to neither side. Further coefficients
that changed at the same instant are added one by one; then each side is searched separately.

Coefficients that may have changed instead of the one reported are listed as alternatives: b1, b2
and b3 have similar effects, and so have f and h where the yaw rate is constant in magnitude. A
steady yaw moment that starts or ends is not reported as a change, but estimated by the
disturbance observer; a gust in the last minutes of a trial may still be mistaken for a change of
d. Changes below 1 % are not reported. Where the model was fitted to the log, the effect of the
propeller's slipstream on the rudder is unknown: any effect of the revolutions is allowed for, and
changes of yaw coefficients below 10 % are not reported. For a real ship, a change means only that
the model does not hold for both sides with the same coefficients."""

POWER = """
## With a change

A coefficient becomes {factors[0]:g} or {factors[1]:g} times what it was at {at:.0f} of {of:.0f}
s; seeds: {seeds}. *Found*: it is reported, by itself or as an alternative, within {window:.0f} s
of it. *Named*: it is reported by itself or first. For these: the median error of time and of size
(in per cent of the coefficient before), the median half-width of the interval, and the number of
95 % intervals that contain the true size. *Others*: reported changes that did not happen.

The ship of Table 1 in radians turns so slowly that f cannot be determined and b2 hardly: the
noise is larger than their effects. Under the paper's noise, which contains a slow wave, a change
of f is found in a zig-zag, but seldom in a pseudo-random run with its varying revolutions. There
the intervals of d for a guessed model are too short, because the effect of the slipstream is
allowed for only approximately.
"""


@dataclass(frozen=True)
class Case:
    """A simulated trial, and whether the ship's model is guessed from it (else it is stated)."""

    vessel: str
    guessed: bool
    manoeuvre: str
    noise: str


def reported_changes(log: TrialLog, case: Case) -> tuple[Change, ...]:
    """Return the changes that a replay reports for a log."""
    signals = resample(log, channels=CHANNELS)
    model = (
        SPEED_PROPORTIONAL_RUDDER
        if case.guessed
        else load_vessel(case.vessel)[0].paper_coefficients
    )
    equations = WeakForm(model, len(signals), signals.dt_secs, (1, 1, 1, 1))
    test = ShipChangeTest(equations, model_is_fitted=case.guessed)
    test.add(*equations.step(signals, float(np.max(np.abs(signals["speed"])))))
    return test.result()


def unchanged(case: Case, duration_secs: float, seed: int) -> TrialLog:
    """Simulate a trial of a ship that does not change."""
    vessel = load_vessel(case.vessel)[0]
    sensors = suite(case.noise, angle_unit=vessel.angle_unit)
    sailed = simulate(
        vessel, case.manoeuvre, duration_secs=duration_secs, seed=seed, sensors=sensors
    )
    return TrialLog("unchanged", sailed.channels)


def halfway(case: Case, name: str, factor: float, seed: int) -> TrialLog:
    """Simulate a trial in which one coefficient changes halfway."""
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
    """Yield all cases of the manoeuvres, those with a stated model first."""
    for vessel, guessed, manoeuvre, noise in product(VESSELS, (False, True), manoeuvres, NOISES):
        yield Case(vessel, guessed, manoeuvre, noise)


def false_alarms(seeds: int) -> None:
    """Print how many logs without a change are reported to have one."""
    print("\n## Without a change\n")
    print(
        f"Logs with a reported change; {seeds} seeds at each of the lengths 600, 1200 and 3600 s.\n"
    )
    print("| ship | model | manoeuvre | noise | false alarms |\n|---|---|---|---|---|")
    every = {False: [0, 0], True: [0, 0]}
    for case in cases(MANOEUVRES):
        runs = product(DURATIONS, range(FIRST_SEED, FIRST_SEED + seeds))
        alarms = sum(
            bool(reported_changes(unchanged(case, secs, seed), case)) for secs, seed in runs
        )
        every[case.guessed][0] += alarms
        every[case.guessed][1] += seeds * len(DURATIONS)
        print(f"| {_case_cells(case)} | {alarms} of {seeds * len(DURATIONS)} |")
    for guessed, (alarms, count) in every.items():
        origin = "guessed" if guessed else "stated"
        print(f"\nModel {origin}: {alarms} of {count}, {100 * alarms / count:.1f} %.")


def power(seeds: int) -> None:
    """Print how many changes are found, when, and how many intervals contain the true size."""
    print(
        POWER.format(
            factors=FACTORS, at=HALFWAY_SECS, of=CHANGED_SECS, seeds=seeds, window=WINDOW_SECS
        )
    )
    print("| ship | model | manoeuvre | noise | changed | found | named | s | size % | ± % |"
          " contained | others |\n" + "|---" * 12 + "|")  # fmt: skip
    held = []
    for case, name in product(cases(MANOEUVRES[:3]), CHANGED):
        line, inside = _power_line(case, name, seeds)
        held += inside
        print(line)
    print(f"\nOf all {len(held)} intervals {100 * np.mean(held):.1f} % contain the true size.")


def _power_line(case: Case, name: str, seeds: int) -> tuple[str, list[bool]]:
    """Return a row of the table, and for each named change whether its interval is right."""
    found, others, named = 0, 0, []
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        factor = FACTORS[seed % 2]
        changes = reported_changes(halfway(case, name, factor, seed), case)
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
    cells = f"{name} | {found} of {seeds} | {len(named)} | {' | '.join(numbers)}"
    line = f"| {_case_cells(case)} | {cells}"
    return f"{line} | {others or ''} |", inside


def _case_cells(case: Case) -> str:
    """Return the first four cells of a row."""
    return " | ".join(
        (case.vessel, "guessed" if case.guessed else "stated", case.manoeuvre, case.noise)
    )


def main() -> None:
    """Print the page."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.changes", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument(
        "--seeds", type=int, default=SEEDS, help=f"seeds of each case (default: {SEEDS})"
    )
    arguments = parser.parse_args()
    print(INTRODUCTION)
    false_alarms(arguments.seeds)
    power(arguments.seeds)


if __name__ == "__main__":
    main()

"""How well output error identifies a ship that is known: python -m benchmarks.identification.

The paper's ship under the paper's noise, 500 s at 10 Hz, fifty seeds each. Of each coefficient, in
per cent of the truth: the median error, the root mean square of the error, that over the
Cramér-Rao bound of its own run, and how often the 95 % interval holds the truth.
"""

import sys
from collections.abc import Mapping
from time import process_time

import numpy as np

from analysis.identify.output_error import output_error
from analysis.identify.trial import trials_of
from analysis.identify.uncertainty import uncertainty
from recorders.sensors import suite
from recorders.simulate import simulate
from shiplog import TrialLog, load_vessel, resample
from shiplog.ships import Model, ship_model
from shiplog.types import FloatArray

MANOEUVRES = ("zigzag-20-20", "zigzag-10-10", "pseudo-random", "turning-circle-35")
CHANNELS = ("yaw_rate", "speed", "rudder", "rpm")
SECONDS, SEEDS, FIRST_SEED = 500.0, 50, 1000
OFF = 0.5  # of the truth: where the searches begin that begin somewhere


def truth() -> dict[str, float]:
    """The coefficients of the paper's ship, and T3 = e / d."""
    c = load_vessel("table1")[0].coefficients
    return {**c._asdict(), "T3": c.e / c.d}


def one(
    manoeuvre: str, seed: int, model: Model, known: Mapping[str, float], *, off: float
) -> FloatArray:
    """Of a seed: relative error, bound and half interval of each coefficient, (3, p), and secs."""
    vessel, true = load_vessel("table1")[0], truth()
    trial = simulate(vessel, manoeuvre, duration_secs=SECONDS, seed=seed, sensors=suite("paper"))
    log = TrialLog("trial", trial.channels, trial.metadata, trial.vessel_toml)
    trials = trials_of(resample(log, channels=CHANNELS), "trial")
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(model.names))
    sought = [p.name for p in model.parameters if not p.known and p.name not in known]
    begin = {n: true[n] * (1 + off * s) for n, s in zip(model.names, signs, strict=True)}
    started = process_time()
    start = {name: begin[name] for name in sought} if off else None
    fit = output_error(trials, model, known=known, start=start)
    spent = process_time() - started
    found = uncertainty(fit)
    exact = np.array([true[name] for name in found.names])
    rows = (found.values - exact, found.bound, 1.96 * found.std)
    return np.vstack((np.array(rows) / np.abs(exact), np.full(len(exact), spent)))


def study(
    title: str, manoeuvre: str, model: Model, known: Mapping[str, float], seeds: int, *, off: float
) -> None:
    """Print the table of one manoeuvre."""
    runs = range(FIRST_SEED, FIRST_SEED + seeds)
    every = np.array([one(manoeuvre, seed, model, known, off=off) for seed in runs])
    error, bound, half, spent = np.moveaxis(every, 1, 0)
    names = [p.name for p in model.parameters if not p.known and p.name not in known]
    inside = np.abs(error) < half
    rows = {
        "median error, %": 100 * np.median(np.abs(error), axis=0),
        "rms error, %": 100 * np.sqrt(np.mean(error**2, axis=0)),
        "rms error over bound": np.sqrt(np.mean((error / bound) ** 2, axis=0)),
        "intervals that hold the truth, %": 100 * np.mean(inside, axis=0),
    }
    print(f"\n{title}: {seeds} seeds, {np.median(spent):.2f} s a fit, intervals hold the truth in")
    print(f"{100 * np.mean(inside):.1f} % of all cases\n")
    print(f"| {manoeuvre} | {' | '.join(names)} |")
    print("|---" * (len(names) + 1) + "|")
    for name, values in rows.items():
        print(f"| {name} | {' | '.join(f'{value:.3g}' for value in values)} |")


def main() -> None:
    """All tables; with a number, of so many seeds."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    free, tied, known = ship_model("burylin"), ship_model("burylin-tied"), {"T3": truth()["T3"]}
    for manoeuvre in MANOEUVRES:
        study("the paper's model, free, no start", manoeuvre, free, {}, seeds, off=0.0)
    for title, off in (("no start", 0.0), ("starts off by 50 %", OFF)):
        study(f"b1 = -d, e = T3 d, {title}", MANOEUVRES[0], tied, known, seeds, off=off)


if __name__ == "__main__":
    main()

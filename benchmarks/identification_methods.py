"""The identifier's methods side by side, on the same segments of a ship that is known."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from analysis.identification.comparison.paper_scheme import (
    IDENTIFIED_NAMES,
    paper_states,
    regression_rows,
    solve_window,
)
from analysis.identification.comparison.parameter_ekf import parameter_ekf
from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.segment import Segment
from analysis.regression.coefficients import Coefficient, fit_coefficients
from analysis.regression.weak_form import weak_form
from shiplog.ships import ship_model
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

SEEDS = range(1000, 1008)
OFF = 0.3  # of the truth: the priors of those methods that have one
BOUND = "Cramér and Rao's bound, free"
MANOEUVRES = ("zigzag-20-20", "turning-circle-35")
TEXT = """
## The methods side by side

The same ship and noise, {seeds} seeds, the α's known: the median of the errors, in per cent; last
the rms by which the found model, sailed under the run's rudder, is off the true one; a dash where
in a seed nothing is told, or the model found runs away. The paper's
scheme takes ẅ and v̇ from a filter that holds a model of the ship, so that it must be given one
before it can find one: with the truth in it, it finds roughly the truth, and with a prior
{off:.0f} % off it finds neither. The extended Kalman filter with the parameters among its states
starts from the same priors and forgets them in one pass; the equations in integral form and output
error have none."""

Found = Mapping[str, float]


def methods(
    sail: Callable[[str, int], Segment], bound: Callable[[str], FloatArray], truth: Coefficients
) -> None:
    """Print the section.

    `sail` gives the trial of a manoeuvre and a seed, `bound` that of a manoeuvre's, (9,) stds.
    """
    print(TEXT.format(seeds=len(SEEDS), off=100 * OFF))
    for manoeuvre in MANOEUVRES:
        least = 100 * bound(manoeuvre) / np.abs(truth[:9])
        every: dict[str, list[Found]] = {
            BOUND: [dict(zip(IDENTIFIED_NAMES, least.tolist(), strict=True))]
        }
        for seed in SEEDS:
            trial = sail(manoeuvre, seed)
            for name, found in _by_each(trial, truth, seed):
                every.setdefault(name, []).append(found)
        print(f"\n**{manoeuvre}**\n")
        print(f"| % | {' | '.join(IDENTIFIED_NAMES)} | rms w (°/s) | rms v (m/s) |")
        print("|---" * (len(IDENTIFIED_NAMES) + 3) + "|")
        for name, founds in every.items():
            print(f"| {name} | {' | '.join(_row(founds))} |")


def _row(founds: list[Found]) -> Iterator[str]:
    for key in (*IDENTIFIED_NAMES, "rms w", "rms v"):
        median = np.median([abs(found.get(key, np.nan)) for found in founds])
        yield f"{median:.2g}" if np.isfinite(median) else "–"


def _by_each(trial: Segment, truth: Coefficients, seed: int) -> Iterator[tuple[str, Found]]:
    """Each method's name, and its errors of this trial in per cent of the truth."""
    model = ship_model("burylin")
    free, true = output_error([trial], model), np.array(truth[:9])
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(true))
    wrong = true * (1 + OFF * signs)
    yield "the paper's scheme, the truth for a prior", _errors(trial, truth, _paper(trial, truth))
    misled = truth._replace(**dict(zip(IDENTIFIED_NAMES, wrong.tolist(), strict=True)))
    yield "the paper's scheme, a prior off", _errors(trial, truth, _paper(trial, misled))
    priors = np.array([wrong, true * (1 - OFF * signs)])
    yield (
        "extended Kalman filter, a prior off",
        _errors(trial, truth, parameter_ekf(free, priors).values[0, -1]),
    )
    yield "integral form, no prior", _errors(trial, truth, _integral(trial, truth))
    yield "output error, no prior", _errors(trial, truth, _nine(free))
    tied = output_error([trial], ship_model("burylin-tied"), fixed={"T3": truth.e / truth.d})
    yield "output error, tied, T3 known", _errors(trial, truth, _nine(tied))


def _paper(trial: Segment, prior: Coefficients) -> FloatArray:
    states = paper_states(trial.signals, prior)
    return np.concatenate(
        [solve_window(rows) for rows in regression_rows(trial.signals, prior, states)]
    )


def _integral(trial: Segment, truth: Coefficients) -> FloatArray:
    found: dict[str, Coefficient] = {}
    for rows in weak_form(trial.signals, truth):  # of the truth the alphas alone are used
        found |= fit_coefficients(rows)[0].coefficients
    return np.array([found[name].value for name in IDENTIFIED_NAMES])


def _nine(fit: OutputError) -> FloatArray:
    return np.array(fit.problem.model.coefficients(fit.parameters)[:9])


def _errors(trial: Segment, truth: Coefficients, found: FloatArray) -> Found:
    """In per cent of the truth, and how far the found model's run is off the true one's."""
    true, model = np.array(truth[:9]), ship_model("burylin")
    speed = float(np.sqrt(-truth.h * trial.signals["rpm"][0] / truth.g))
    initial = np.array([0.0, 0.0, speed, 0.0])
    runs = [
        model.simulate(np.append(nine, truth[9:]), initial, trial.path, len(trial))
        for nine in (found, true)
    ]
    off = np.sqrt(np.mean((runs[0] - runs[1]) ** 2, axis=0))
    errors = dict(zip(IDENTIFIED_NAMES, 100 * (found / true - 1), strict=True))
    return errors | {"rms w": float(np.degrees(off[0])), "rms v": float(off[1])}

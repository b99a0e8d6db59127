"""The methods of identification compared on the same trials of a simulated ship."""

from collections.abc import Callable, Iterator, Mapping, Sequence

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

PRIOR_ERROR = 0.3  # relative, of the priors of those methods that need one
BOUND = "Cramér-Rao bound, free"
MANOEUVRES = ("zigzag-20-20", "turning-circle-35")
TEXT = """
## The methods compared

The same ship, noise and inputs, {seeds} seeds, the α's given: the median error of each
coefficient, in per cent of the true value; in the last two columns the rms difference between the
trajectories of the estimated and of the true model under the rudder of the trial. A dash marks a
method that in some seed does not determine the coefficient, or whose model diverges.

The paper's scheme takes ẅ and v̇ from a filter that contains a model of the ship, and so needs a
prior: given the true values it returns roughly the true values, given a prior wrong by
{error:.0f} % it returns neither. The extended Kalman filter with the parameters among its states
starts from the same wrong priors and corrects them in one pass. The equations in integral form and
output error need no prior."""

Errors = Mapping[str, float]  # per cent of each coefficient, and the rms of the trajectory


def compare_methods(
    simulate: Callable[[str, int], Segment],
    bound: Callable[[str], FloatArray],
    truth: Coefficients,
    seeds: Sequence[int],
) -> None:
    """Print the section of the page.

    Parameters
    ----------
    simulate
        Returns the trial of a manoeuvre and a seed.
    bound
        Returns the Cramér-Rao bound of a manoeuvre, (9,) standard deviations.
    truth
        The coefficients of the simulated ship.
    seeds
        Those of the trials.
    """
    print(TEXT.format(seeds=len(seeds), error=100 * PRIOR_ERROR))
    for manoeuvre in MANOEUVRES:
        relative = 100 * bound(manoeuvre) / np.abs(truth[:9])
        errors: dict[str, list[Errors]] = {
            BOUND: [dict(zip(IDENTIFIED_NAMES, relative.tolist(), strict=True))]
        }
        for seed in seeds:
            trial = simulate(manoeuvre, seed)
            for name, of_method in _method_errors(trial, truth, seed):
                errors.setdefault(name, []).append(of_method)
        print(f"\n**{manoeuvre}**\n")
        print(f"| % | {' | '.join(IDENTIFIED_NAMES)} | rms w (°/s) | rms v (m/s) |")
        print("|---" * (len(IDENTIFIED_NAMES) + 3) + "|")
        for name, of_seeds in errors.items():
            print(f"| {name} | {' | '.join(_row(of_seeds))} |")


def _row(of_seeds: list[Errors]) -> Iterator[str]:
    for key in (*IDENTIFIED_NAMES, "rms w", "rms v"):
        median = np.median([abs(errors.get(key, np.nan)) for errors in of_seeds])
        yield f"{median:.2g}" if np.isfinite(median) else "–"


def _method_errors(trial: Segment, truth: Coefficients, seed: int) -> Iterator[tuple[str, Errors]]:
    """Yield the name of each method, and its errors in this trial."""
    model = ship_model("burylin")
    free, true = output_error([trial], model), np.array(truth[:9])
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(true))
    wrong = true * (1 + PRIOR_ERROR * signs)
    yield "paper's scheme, true prior", _errors(trial, truth, _paper_scheme(trial, truth))
    wrong_prior = truth._replace(**dict(zip(IDENTIFIED_NAMES, wrong.tolist(), strict=True)))
    yield "paper's scheme, wrong prior", _errors(trial, truth, _paper_scheme(trial, wrong_prior))
    priors = np.array([wrong, true * (1 - PRIOR_ERROR * signs)])
    yield (
        "extended Kalman filter, wrong prior",
        _errors(trial, truth, parameter_ekf(free, priors).values[0, -1]),
    )
    yield "integral form, no prior", _errors(trial, truth, _integral_form(trial, truth))
    yield "output error, no prior", _errors(trial, truth, _nine_coefficients(free))
    tied = output_error([trial], ship_model("burylin-tied"), fixed={"T3": truth.e / truth.d})
    yield "output error, tied, T3 fixed", _errors(trial, truth, _nine_coefficients(tied))


def _paper_scheme(trial: Segment, prior: Coefficients) -> FloatArray:
    states = paper_states(trial.signals, prior)
    return np.concatenate(
        [solve_window(rows) for rows in regression_rows(trial.signals, prior, states)]
    )


def _integral_form(trial: Segment, truth: Coefficients) -> FloatArray:
    fitted: dict[str, Coefficient] = {}
    for rows in weak_form(trial.signals, truth):  # only the alphas of `truth` are used
        fitted |= fit_coefficients(rows)[0].coefficients
    return np.array([fitted[name].value for name in IDENTIFIED_NAMES])


def _nine_coefficients(fit: OutputError) -> FloatArray:
    return np.array(fit.problem.model.coefficients(fit.parameters)[:9])


def _errors(trial: Segment, truth: Coefficients, estimates: FloatArray) -> Errors:
    """Return the errors in per cent, and the rms differences of the simulated trajectories."""
    true, model = np.array(truth[:9]), ship_model("burylin")
    speed = float(np.sqrt(-truth.h * trial.signals["rpm"][0] / truth.g))
    initial = np.array([0.0, 0.0, speed, 0.0])
    runs = [
        model.simulate(np.append(nine, truth[9:]), initial, trial.path, len(trial))
        for nine in (estimates, true)
    ]
    rms = np.sqrt(np.mean((runs[0] - runs[1]) ** 2, axis=0))
    errors = dict(zip(IDENTIFIED_NAMES, 100 * (estimates / true - 1), strict=True))
    return errors | {"rms w": float(np.degrees(rms[0])), "rms v": float(rms[1])}

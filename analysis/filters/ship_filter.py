"""A filter of the ship's motion, of any core and any further states, chunk by chunk."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS
from shiplog.types import FloatArray, Signals

from .base import Estimates, FurtherStates, Trace
from .filter_loop import FilterInput, ShipInputs, output_rows, run_filter
from .further_states import Arrangement
from .further_steps import COMPASS, Further, NoFurther
from .noise_model import FURTHER_OUTPUTS


class ShipFilter:
    """A filter at the start of a trial.

    Parameters
    ----------
    core
        The core: a NamedTuple whose functions are registered (`core`).
    arrangement
        The constants and the state of the filter; the arrays of the state are updated.
    wave
        (k,): the row that gives the wave in the yaw rate from its states, which follow the core's;
        None for no wave.
    """

    def __init__(self, core: NamedTuple, arrangement: Arrangement, wave: FloatArray | None) -> None:
        self._core, self._further_states = core, arrangement.further
        self._system, self._state = arrangement.system, arrangement.state
        self._shown, self._wind = arrangement.shown, arrangement.wind
        self._wave = wave
        self._has_heading = False

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Estimates:
        """Filter the next chunk.

        Parameters
        ----------
        chunk
            Signals with `PAPER_OUTPUTS` and `PAPER_INPUTS`, the further outputs that the filter
            uses, and the regressors of the wind, m²/s², by the names of its terms; an output that
            is NaN is not used.
        following
            The inputs at the instant after the chunk, by name.
        """
        return self._run(chunk, following, keep=False)[0]

    def trace(self, chunk: Signals, following: Mapping[str, float]) -> tuple[Estimates, Trace]:
        """Filter the next chunk as `step` does, and return what the smoother needs as well."""
        return self._run(chunk, following, keep=True)

    def to_estimates(
        self,
        chunk: Signals,
        following: Mapping[str, float],
        states: FloatArray,
        covariances: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray | None, FurtherStates | None]:
        """Return w, w', w'', v, v' (n, 5), their standard deviations, the wave, and the others."""
        rows, further_rows = output_rows(
            self._core, self._in_wind(chunk), states, covariances,
            _ship_inputs(chunk, following), len(self._shown),
        )  # fmt: skip
        further = self._further(further_rows)
        return rows[:, :5], np.sqrt(rows[:, 5:]), self._wave_rate(states), further

    def _run(
        self, chunk: Signals, following: Mapping[str, float], *, keep: bool
    ) -> tuple[Estimates, Trace]:
        given = FilterInput(self._measured(chunk), _ship_inputs(chunk, following))
        states, rows, further_rows, innovations, rejected, trace = run_filter(
            self._core, self._in_wind(chunk), self._system, self._state, given, keep
        )
        outputs = rejected.shape[1]
        estimates = Estimates(
            rows[:, :5], np.sqrt(rows[:, 5:]), innovations[:, :outputs],
            np.sqrt(innovations[:, outputs:]), rejected, self._wave_rate(states),
            self._further(further_rows),
        )  # fmt: skip
        return estimates, Trace(states, *trace)

    def _in_wind(self, chunk: Signals) -> Further | NoFurther:
        """Return the further states with the regressors of the wind in a chunk."""
        if not self._wind or isinstance(self._further_states, NoFurther):
            return self._further_states
        regressors = np.ascontiguousarray(np.column_stack([chunk[name] for name in self._wind]))
        return self._further_states._replace(regressors=regressors)

    def _measured(self, chunk: Signals) -> FloatArray:
        """Return the outputs (n, m); a position is not used before the first heading is known."""
        outputs = len(self._system.r)
        names = (*PAPER_OUTPUTS, *FURTHER_OUTPUTS)[:outputs]
        measured = np.column_stack([chunk[name] for name in names])
        if outputs > COMPASS and not self._has_heading:
            known = np.flatnonzero(np.isfinite(measured[:, COMPASS]))
            self._has_heading = len(known) > 0
            measured[: known[0] if len(known) else None, COMPASS:] = np.nan
        return measured

    def _further(self, rows: FloatArray) -> FurtherStates | None:
        """Return the further estimates, of rows of these and their variances, (n, 2 k)."""
        count = len(self._shown)
        if not count:
            return None
        return FurtherStates(
            names=tuple(shown.name for shown in self._shown),
            units=tuple(shown.unit for shown in self._shown),
            prior_stds=tuple(shown.prior_std for shown in self._shown),
            values=rows[:, :count],
            stds=np.sqrt(rows[:, count:]),
        )

    def _wave_rate(self, states: FloatArray) -> FloatArray | None:
        """Return the wave's part of the yaw rate (n,), of states (n, s)."""
        if self._wave is None:
            return None
        first = len(self._system.B)
        wave: FloatArray = states[:, first : first + len(self._wave)] @ self._wave
        return wave


def _ship_inputs(chunk: Signals, following: Mapping[str, float]) -> ShipInputs:
    """Return the inputs of a chunk, of which those at the instant after it are given by name."""
    delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
    return ShipInputs(delta, n, chunk.dt_secs)

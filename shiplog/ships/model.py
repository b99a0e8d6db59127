"""What a ship model is: parameters with limits and priors, a state, equations, and a scale."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from importlib import import_module
from math import inf
from pickle import PicklingError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import UsageError
from shiplog.types import FloatArray
from shiplog.units import did_you_mean

from .motion import MODEL_OUTPUTS, ComplexArray, InputPath

STEP = 1e-30  # along the imaginary axis: nothing is lost to rounding, however small


@dataclass(frozen=True)
class Parameter:
    """One parameter of a model, in its own unit.

    Attributes
    ----------
    name, unit
        Such as ``T3`` and ``s``.
    start
        Where a fit starts without other information, and the mean of the prior.
    lowest, highest
        The limits of its estimate.
    prior_std
        The standard deviation of the prior about `start`; infinite for none.
    fixed
        Whether it keeps the value `start` unless it is freed explicitly.
    typical
        Its magnitude for ships in general, where `start` is zero.
    """

    name: str
    unit: str
    start: float
    lowest: float = -inf
    highest: float = inf
    prior_std: float = inf
    fixed: bool = False
    typical: float = 0.0

    @property
    def size(self) -> float:
        """The parameter's magnitude for ships in general, to scale it with."""
        return self.typical or abs(self.start) or self.prior_std


@dataclass(frozen=True)
class StateValue:
    """One value of a model's state, and what is known of it at the start of a run.

    Attributes
    ----------
    name
        Its symbol in the equations.
    channel
        The one of `MODEL_OUTPUTS` that measures it; None where nothing does.
    prior_std
        The standard deviation about zero of its initial value where nothing measures it.
    """

    name: str
    channel: str | None = None
    prior_std: float = inf


@dataclass(frozen=True)
class Scale:
    """The units of a model's equations: one of time, of speed and of revolutions each.

    Attributes
    ----------
    secs
        The unit of time, s.
    speed
        The unit of speed, m/s.
    rpm
        The unit of the propeller's revolutions, rpm.
    """

    secs: float = 1.0
    speed: float = 1.0
    rpm: float = 1.0

    @property
    def outputs(self) -> FloatArray:
        """(4,) the factors from the units of the equations to SI, in the order of `MODEL_OUTPUTS`.

        Examples
        --------
        >>> Scale(secs=20.0, speed=8.0, rpm=90.0).outputs.tolist()
        [0.05, 8.0, 8.0, 1.0]
        """
        return np.array([1 / self.secs, self.speed, self.speed, 1.0])

    def of_channel(self, channel: str | None) -> float:
        """Return the factor to SI of one channel; 1 for None."""
        return (
            float(self.outputs[MODEL_OUTPUTS.index(channel)]) if channel in MODEL_OUTPUTS else 1.0
        )

    def scaled(self, path: InputPath) -> InputPath:
        """Return the inputs of a run in these units."""
        return path._replace(
            secs=path.secs / self.secs,
            delta_dot=path.delta_dot * self.secs,
            rpm=path.rpm / self.rpm,
        )


SI = Scale()


def _unchanged(values: ComplexArray) -> Sequence[complex]:
    return tuple(values)


@dataclass(frozen=True, eq=False)
class Propagation:
    """A simulated run of `count` samples and its derivatives along k directions.

    Attributes
    ----------
    outputs
        (count, 4) the outputs in SI, in the order of `MODEL_OUTPUTS`.
    end
        (s,) the state at the last sample, in the units of the equations.
    outputs_by, end_by
        (k, count, 4) and (k, s) their derivatives along each direction.
    """

    outputs: FloatArray
    end: FloatArray
    outputs_by: FloatArray
    end_by: FloatArray


@dataclass(frozen=True)
class Model:
    """A ship model, for simulation and for estimation.

    A model can be pickled and copied, as long as its functions stand in a module by their names.

    Attributes
    ----------
    name
        The name by which `ship_model` finds it.
    title
        A few words for tables.
    kind
        The NamedTuple of the equations' coefficients. Compiled code chooses the equations by it.
    parameters
        The parameters, in the order in which arrays hold them.
    state
        The state, in the order of the equations. One value each is measured by ``yaw_rate`` and
        ``speed``.
    compiled
        `shiplog.ships.motion.integrate` compiled for this kind, in the model's own module. It
        simulates k runs in a call, so that the cost of a call does not multiply with k.
    outputs
        Those of `MODEL_OUTPUTS` that the model predicts.
    dimensionless
        Whether the equations are dimensionless, in ship lengths and approach speeds; else in SI.
    expand
        Makes the coefficients, in the order of `kind`, of the parameters. Where coefficients are
        tied to each other there are fewer parameters than coefficients.
    """

    name: str
    title: str
    kind: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    state: tuple[StateValue, ...]
    compiled: Callable[..., ComplexArray]
    outputs: tuple[str, ...] = ("yaw_rate", "speed", "heading")
    dimensionless: bool = True
    expand: Callable[[ComplexArray], Sequence[complex]] = field(default=_unchanged)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the parameters."""
        return tuple(p.name for p in self.parameters)

    def parameter(self, name: str) -> Parameter:
        """Return the parameter of a name; raises `UsageError` where there is none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise UsageError(
            f"the model {self.name} has no parameter {name!r}{did_you_mean(name, self.names)}; "
            f"it has {', '.join(self.names)}"
        )

    def start_values(self) -> FloatArray:
        """(p,) where a fit starts without other information."""
        return np.array([p.start for p in self.parameters])

    def scale(self, length: float, speed: float, rpm: float) -> Scale:
        """Return the units of the equations for one ship.

        Parameters
        ----------
        length
            The length between perpendiculars, m.
        speed, rpm
            Those of the straight approach, m/s and rpm.
        """
        return Scale(length / speed, speed, rpm) if self.dimensionless else SI

    def coefficients(self, parameters: Sequence[float] | FloatArray) -> Any:  # noqa: ANN401 - a `kind`
        """Return the equations' coefficients as a `kind` of real numbers.

        Examples
        --------
        >>> from shiplog.ships import ship_model
        >>> ship_model("nomoto").coefficients([-0.6, 0.5, -0.5, -0.05, 0.05])
        Norrbin(a=-0.6, a3=0.0, k=0.5, f=-0.5, g=-0.05, h=0.05)
        """
        values = self.expand(np.array(parameters, np.complex128))
        return self.kind(*(float(np.real(value)) for value in values))

    def simulate(
        self, parameters: FloatArray, initial: FloatArray, path: InputPath, count: int,
        *, offset: float = 0.0, scale: Scale = SI,
    ) -> FloatArray:  # fmt: skip
        """Simulate a run under given inputs.

        Parameters
        ----------
        parameters
            (p,) the model's parameters.
        initial
            (s,) the state at the first sample, in the units of the equations.
        path
            The rudder and the revolutions, from `shiplog.ships.path.input_path`.
        count
            The number of samples.
        offset
            Rudder added to that of the path, rad.
        scale
            The units of the equations.

        Returns
        -------
        (count, 4) array
            The outputs in SI, in the order of `MODEL_OUTPUTS`; NaN from where the run diverges.
        """
        out, _ = self._integrate(
            parameters[None], initial[None], np.array([offset]), scale.scaled(path), count
        )
        return np.asarray(out[0].real * scale.outputs)

    def simulate_many(
        self, parameters: FloatArray, initial: FloatArray, path: InputPath, count: int,
        *, offsets: FloatArray, scale: Scale = SI,
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """Simulate k ships under the same inputs, (k, p) parameters and (k, s) initial states.

        `offsets`, (k,) rad, are added to the rudder. The other arguments are those of `simulate`.

        Returns
        -------
        outputs
            (k, count, 4) in SI; NaN from where a run diverges.
        end
            (k, s) the states at the end of the path, in the units of the equations.
        """
        out, ends = self._integrate(parameters, initial, offsets, scale.scaled(path), count)
        return np.asarray(out.real * scale.outputs), ends.real.copy()

    def sensitivities(
        self, parameters: FloatArray, initial: FloatArray, path: InputPath, count: int,
        directions: FloatArray, *, offset: float = 0.0, scale: Scale = SI,
    ) -> FloatArray:  # fmt: skip
        """Compute the derivatives of the outputs along given directions, (k, count, 4).

        A direction is a row of `directions`, (k, p + s + 1): of the parameters, the initial state
        and the offset of the rudder, in this order. The other arguments are those of `simulate`.
        """
        return self.propagate(
            parameters, initial, path, count, directions, offset=offset, scale=scale
        ).outputs_by

    def propagate(
        self, parameters: FloatArray, initial: FloatArray, path: InputPath, count: int,
        directions: FloatArray, *, offset: float = 0.0, scale: Scale = SI,
    ) -> Propagation:  # fmt: skip
        """Simulate a run with its last state and the derivatives of both along k >= 1 directions.

        The arguments are those of `sensitivities`. Each derivative is exact to rounding: the run is
        simulated once with the direction as a small imaginary part (see `shiplog.ships.motion`).
        """
        p, along = len(parameters), directions * (1j * STEP)
        out, ends = self._integrate(
            parameters + along[:, :p],
            initial + along[:, p:-1],
            offset + along[:, -1],
            scale.scaled(path),
            count,
        )
        return Propagation(
            out[-1].real * scale.outputs,
            ends[-1].real.copy(),
            out.imag / STEP * scale.outputs,
            ends.imag / STEP,
        )

    def _integrate(
        self, parameters: NDArray[Any], initial: NDArray[Any],
        offset: NDArray[Any], path: InputPath, count: int,
    ) -> tuple[ComplexArray, ComplexArray]:  # fmt: skip
        """Compute the outputs, (k, count, 4), and the last states, (k, s), of k runs.

        All are NaN where an equation divides by zero, such as by the speed of a stopped ship.
        """
        rows = [self.expand(row) for row in parameters.astype(np.complex128)]
        coefficients = self.kind(*np.array(rows, np.complex128).T.copy())
        states = initial.astype(np.complex128)
        try:
            out = self.compiled(coefficients, states, offset.astype(np.complex128), path, count)
        except ZeroDivisionError:  # numba's, of complex numbers
            states[:] = np.nan
            out = np.full((len(states), count, len(MODEL_OUTPUTS)), np.nan + 0j)
        return out, states

    def __getstate__(self) -> Mapping[str, Any]:
        """Refer to the compiled function by its module and name, not by its machine code."""
        module, name = self.compiled.__module__, self.compiled.__name__
        if getattr(sys.modules.get(module), name, None) is not self.compiled:
            raise PicklingError(
                f"the model {self.name} cannot be pickled: its compiled function is not {name} of "
                f"the module {module}"
            )
        state = {each.name: getattr(self, each.name) for each in fields(self)}
        return state | {"compiled": (module, name)}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        module, name = state["compiled"]
        vars(self).update(state, compiled=getattr(import_module(module), name))

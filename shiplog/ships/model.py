"""What a model of a ship is: parameters with their limits, a state, equations, and its scale."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from typing import Any

import numpy as np

from shiplog.errors import UsageError
from shiplog.types import FloatArray
from shiplog.units import did_you_mean

from .motion import MODEL_OUTPUTS, ComplexArray, InputPath

STEP = 1e-30  # along the imaginary axis: nothing is lost to rounding, however small


@dataclass(frozen=True)
class Parameter:
    """One number of a model, in its own unit."""

    name: str
    unit: str
    start: float  # where a search begins that knows nothing,
    lowest: float = -inf  # and between which it stays
    highest: float = inf
    prior_std: float = inf  # how far from `start` it is believed to be, before any data
    fixed: bool = False  # kept at `start` unless it is asked for
    typical: float = 0.0  # its size of ships in general, where `start` is none

    @property
    def size(self) -> float:
        """What its size is of ships in general."""
        return self.typical or abs(self.start) or self.prior_std


@dataclass(frozen=True)
class StateValue:
    """One number of a model's state, and what is known of it as a run begins."""

    name: str
    channel: str | None = None  # that measures it
    prior_std: float = inf  # of what it is when nothing measures it, from zero


@dataclass(frozen=True)
class Scale:
    """The units in which a model's equations are written: one each of time, speed, revolutions."""

    secs: float = 1.0
    speed: float = 1.0  # m/s
    rpm: float = 1.0

    @property
    def outputs(self) -> FloatArray:
        """(4,) what one of each of `MODEL_OUTPUTS` is in SI."""
        return np.array([1 / self.secs, self.speed, self.speed, 1.0])

    def of_channel(self, channel: str | None) -> float:
        """What one of a channel's is in SI; 1 for what no channel measures."""
        return (
            float(self.outputs[MODEL_OUTPUTS.index(channel)]) if channel in MODEL_OUTPUTS else 1.0
        )

    def scaled(self, path: InputPath) -> InputPath:
        """A path in these units."""
        return path._replace(
            secs=path.secs / self.secs,
            delta_dot=path.delta_dot * self.secs,
            rpm=path.rpm / self.rpm,
        )


SI = Scale()


def _as_they_are(values: ComplexArray) -> Sequence[complex]:
    return tuple(values)


@dataclass(frozen=True, eq=False)
class Propagation:
    """A run of `count` samples, and how it changes along k directions."""

    outputs: FloatArray  # (count, 4) SI, in the order of MODEL_OUTPUTS
    end: FloatArray  # (s,) the state at the last sample, in the units of the equations
    outputs_by: FloatArray  # (k, count, 4)
    end_by: FloatArray  # (k, s)


@dataclass(frozen=True)
class Model:
    """A ship's equations, for simulation and for estimation.

    `expand` makes of the parameters the equations' coefficients, which are a `kind`: where some
    are tied to others there are fewer parameters than coefficients.
    """

    name: str
    title: str
    kind: Callable[..., Any]  # a NamedTuple, whose type the compiled equations are chosen by
    parameters: tuple[Parameter, ...]
    state: tuple[StateValue, ...]
    compiled: Callable[..., ComplexArray]  # `sail` for this kind, kept in the model's own file
    outputs: tuple[str, ...] = (
        "yaw_rate",
        "speed",
        "heading",
    )  # of MODEL_OUTPUTS: what it predicts
    dimensionless: bool = True  # else its equations are in SI
    expand: Callable[[ComplexArray], Sequence[complex]] = field(default=_as_they_are)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(p.name for p in self.parameters)

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name; `UsageError` where there is none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise UsageError(
            f"the model {self.name} has no parameter {name!r}{did_you_mean(name, self.names)}; "
            f"it has {', '.join(self.names)}"
        )

    def start_values(self) -> FloatArray:
        """(p,) where a search begins that knows nothing."""
        return np.array([p.start for p in self.parameters])

    def scale(self, length: float, speed: float, rpm: float) -> Scale:
        """The units of its equations for a ship of that length, in m, at that speed and rpm."""
        return Scale(length / speed, speed, rpm) if self.dimensionless else SI

    def coefficients(self, parameters: Sequence[float] | FloatArray) -> Any:  # noqa: ANN401 - a `kind`
        """The equations' coefficients, real, of the parameters."""
        values = self.expand(np.array(parameters, np.complex128))
        return self.kind(*(float(np.real(value)) for value in values))

    def simulate(
        self, parameters: FloatArray, initial: FloatArray, path: InputPath, count: int,
        *, offset: float = 0.0, scale: Scale = SI,
    ) -> FloatArray:  # fmt: skip
        """What would be measured, (count, 4), SI, in the order of `MODEL_OUTPUTS`.

        `parameters` are (p,), `initial` is the state at the first sample in the units of the
        equations, `offset` a rudder added to that of the path, in rad. NaN from where the
        ship runs away.
        """
        out = self._sail(
            parameters.astype(np.complex128),
            initial.astype(np.complex128),
            complex(offset),
            scale.scaled(path),
            count,
        )
        return np.asarray(out.real * scale.outputs)

    def sensitivities(
        self, parameters: FloatArray, initial: FloatArray, path: InputPath, count: int,
        directions: FloatArray, *, offset: float = 0.0, scale: Scale = SI,
    ) -> FloatArray:  # fmt: skip
        """How the outputs change along each direction, (k, count, 4).

        A direction is a row of `directions`: of the parameters, the initial state and the offset
        of the rudder, in this order, (k, p + s + 1). All else as `simulate`.
        """
        return self.propagate(
            parameters, initial, path, count, directions, offset=offset, scale=scale
        ).outputs_by

    def propagate(
        self, parameters: FloatArray, initial: FloatArray, path: InputPath, count: int,
        directions: FloatArray, *, offset: float = 0.0, scale: Scale = SI,
    ) -> "Propagation":  # fmt: skip
        """A run, where it ends, and how both change along one or more `directions`.

        All as `sensitivities`.
        """
        scaled, p = scale.scaled(path), len(parameters)
        outputs_by = np.empty((len(directions), count, len(MODEL_OUTPUTS)))
        ends = np.empty((len(directions), len(initial)), np.complex128)
        out = np.empty((count, len(MODEL_OUTPUTS)), np.complex128)
        for i, along in enumerate(directions * (1j * STEP)):
            ends[i] = initial + along[p:-1]
            out = self._sail(parameters + along[:p], ends[i], offset + along[-1], scaled, count)
            outputs_by[i] = out.imag / STEP * scale.outputs
        return Propagation(
            out.real * scale.outputs, ends[-1].real.copy(), outputs_by, ends.imag / STEP
        )

    def _sail(
        self, parameters: ComplexArray, initial: ComplexArray, offset: complex, path: InputPath,
        count: int,
    ) -> ComplexArray:  # fmt: skip
        """The outputs, (count, 4); `initial` is left where the run ends.

        Where an equation divides by nothing, as by the speed of a ship that stands, there are none.
        """
        coefficients = self.kind(*(complex(value) for value in self.expand(parameters)))
        try:
            return self.compiled(coefficients, initial, complex(offset), path, count)
        except ZeroDivisionError:  # numba's, of complex numbers
            initial[:] = np.nan
            return np.full((count, len(MODEL_OUTPUTS)), np.nan + 0j)

"""The unknowns of a fit: a model's free parameters, and each segment's own unknowns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, pi, radians

import numpy as np
from numpy.typing import NDArray

from shiplog.ships import Model, Scale, StateValue
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .segment import Segment

INITIAL_STATE_SECS = 3.0  # at the start of a segment, whose median is the guess of its first state
WAVE_FREQUENCY_CYCLES = 0.25  # over a segment: prior standard deviation of a wave's frequency
WAVE_AMPLITUDE_STD = 1.0  # of its prior, rad/s, m/s or rad: far above any real wave


@dataclass(frozen=True)
class Nuisance:
    """Prior standard deviations about zero of each segment's unknowns besides its initial state.

    Attributes
    ----------
    rudder_std
        Of the rudder offset, rad, which stands for the rudder's zero error and for every constant
        yaw moment; 0 to have none.
    bias_stds
        Of the sensor bias of each output named, in its SI unit; the others have none.
    """

    rudder_std: float = radians(0.5)
    bias_stds: Mapping[str, float] = field(default_factory=lambda: {"yaw_rate": radians(0.005)})

    @classmethod
    def none(cls) -> "Nuisance":
        """Return no unknowns besides the initial state."""
        return cls(0.0, {})


@dataclass(frozen=True, eq=False)
class Problem:
    """A model, the segments to fit it to, and the layout of the vector of unknowns.

    The m unknowns are the free parameters, then for each segment: its initial state in the units
    of the equations, the rudder offset (rad), the sensor biases (SI), and its waves, each with a
    frequency (rad/s), a cosine and a sine amplitude for every output (SI).

    Attributes
    ----------
    model
        The ship model, with p parameters and s states.
    segments
        The segments; those of the same name belong to one run.
    scale
        The units of the model's equations.
    outputs
        The c outputs that are fitted.
    values
        (p,) of all parameters: the start of the free ones, the value of the fixed ones.
    free
        The numbers of the free parameters.
    nuisance
        The priors of the segments' own unknowns.
    waves
        For each segment the initial frequencies of its waves, rad/s; empty for none at all.
    """

    model: Model
    segments: tuple[Segment, ...]
    scale: Scale
    outputs: tuple[str, ...]
    values: FloatArray
    free: tuple[int, ...]
    nuisance: Nuisance
    waves: tuple[tuple[float, ...], ...] = ()

    @cached_property
    def columns(self) -> list[int]:
        """The columns of `Segment.measured` that are fitted."""
        return [MODEL_OUTPUTS.index(output) for output in self.outputs]

    @cached_property
    def free_names(self) -> tuple[str, ...]:
        """The names of the free parameters."""
        return tuple(self.model.names[i] for i in self.free)

    @cached_property
    def biases(self) -> tuple[tuple[int, float], ...]:
        """For each bias: the number of its output among `outputs`, and its prior std."""
        stds = self.nuisance.bias_stds
        return tuple((i, stds[o]) for i, o in enumerate(self.outputs) if stds.get(o, 0) > 0)

    @property
    def _offsets(self) -> int:
        return int(self.nuisance.rudder_std > 0)

    @cached_property
    def _edges(self) -> list[int]:
        """Where each segment's own unknowns start, and where the last ones end."""
        calm = len(self.model.state) + self._offsets + len(self.biases)
        sizes = [calm + len(self._waves(i)) * self._per_wave for i in range(len(self.segments))]
        return [int(edge) for edge in np.cumsum([len(self.free), *sizes])]

    @property
    def _per_wave(self) -> int:
        return 1 + 2 * len(self.outputs)

    def _waves(self, i: int) -> tuple[float, ...]:
        return self.waves[i] if self.waves else ()

    @cached_property
    def runs(self) -> tuple[tuple[int, ...], ...]:
        """The numbers of each run's segments."""
        names = [segment.name for segment in self.segments]
        return tuple(
            tuple(i for i, each in enumerate(names) if each == name)
            for name in dict.fromkeys(names)
        )

    def select_segments(self, kept: Sequence[int], z: FloatArray) -> tuple["Problem", FloatArray]:
        """Select some of the segments.

        Parameters
        ----------
        kept
            Their numbers.
        z
            (m,) unknowns.

        Returns
        -------
        problem, z
            The problem of these segments, and those of the unknowns that it has.
        """
        waves = tuple(self.waves[i] for i in kept) if self.waves else ()
        rest = replace(self, segments=tuple(self.segments[i] for i in kept), waves=waves)
        return rest, np.concatenate([z[: len(self.free)], *(z[self.own_slice(i)] for i in kept)])

    @property
    def size(self) -> int:
        """The number of unknowns, m."""
        return self._edges[-1]

    def own_slice(self, i: int) -> slice:
        """Return where segment i's own unknowns are among all."""
        return slice(self._edges[i], self._edges[i + 1])

    def start(self) -> FloatArray:
        """Return the initial guess of the unknowns, (m,): all but states and frequencies zero."""
        parts = [self.values[list(self.free)]]
        for i, segment in enumerate(self.segments):
            parts += [self._first_state(segment), np.zeros(self._offsets + len(self.biases))]
            parts += [np.append(wave, np.zeros(self._per_wave - 1)) for wave in self._waves(i)]
        return np.concatenate(parts)

    def _first_state(self, segment: Segment) -> FloatArray:
        first = max(2, round(INITIAL_STATE_SECS / segment.dt_secs))
        state = np.zeros(len(self.model.state))
        for i, value in enumerate(self.model.state):
            if value.channel is not None and segment.has(value.channel):
                measured = segment.measured[:, MODEL_OUTPUTS.index(value.channel)]
                measured = measured[np.isfinite(measured)][:first]
                state[i] = np.median(measured) / self.scale.of_channel(value.channel)
            elif np.isinf(value.prior_std):
                state[i] = self._typical_state(value)[0]
        return state

    def _typical_state(self, value: StateValue) -> tuple[float, float]:
        """Return mean and std over all segments of a state that was not measured in one.

        In the units of the equations.
        """
        if value.channel not in MODEL_OUTPUTS:
            return 0.0, 1.0
        column = MODEL_OUTPUTS.index(value.channel)
        measured = np.concatenate([segment.measured[:, column] for segment in self.segments])
        measured = measured[np.isfinite(measured)] / self.scale.of_channel(value.channel)
        if not len(measured):
            return (1.0 if value.channel == "speed" else 0.0), 1.0
        return float(np.mean(measured)), float(np.std(measured))

    @cached_property
    def prior(self) -> tuple[FloatArray, FloatArray]:
        """Mean and precision (1 / std^2) of the prior of each unknown, (m,) each.

        The precision is 0 where there is no prior: for an initial state that is measured.
        """
        parameters = [self.model.parameters[i] for i in self.free]
        centres, stds = [p.start for p in parameters], [p.prior_std for p in parameters]
        for i, segment in enumerate(self.segments):
            for value in self.model.state:
                measured = value.channel in self.outputs and segment.has(value.channel or "")
                std = (
                    value.prior_std
                    if np.isfinite(value.prior_std)
                    else self._typical_state(value)[1]
                )
                stds.append(inf if measured else std)
            stds += [self.nuisance.rudder_std] * self._offsets + [std for _, std in self.biases]
            for _ in self._waves(i):
                stds += [WAVE_FREQUENCY_CYCLES * 2 * pi / (len(segment) * segment.dt_secs)]
                stds += [WAVE_AMPLITUDE_STD] * (self._per_wave - 1)
        centre = self.start()
        for number in range(len(self.segments)):
            own = self.own_slice(number)
            waves = own.stop - self._per_wave * len(self._waves(number))
            centre[own.start : waves] = 0.0
        centre[: len(centres)] = centres
        heading = [i for i, value in enumerate(self.model.state) if value.channel == "heading"]
        precision = np.array(stds) ** -2.0
        for number, segment in enumerate(self.segments):
            if "heading" not in self.outputs or not segment.has("heading"):
                at = self.own_slice(number).start + heading[0]
                # no output depends on it: any prior keeps it from drifting
                centre[at], precision[at] = self._first_state(segment)[heading[0]], 1.0
        return centre, precision

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """The lower and the upper limit of each unknown, (m,) each."""
        lowest, highest = np.full(self.size, -inf), np.full(self.size, inf)
        for at, i in enumerate(self.free):
            lowest[at], highest[at] = (
                self.model.parameters[i].lowest,
                self.model.parameters[i].highest,
            )
        return lowest, highest

    def parameters(self, z: FloatArray) -> FloatArray:
        """Return all the model's parameters, (p,), free and fixed."""
        values = self.values.copy()
        values[list(self.free)] = z[: len(self.free)]
        return values

    def simulated(self, z: FloatArray, i: int) -> FloatArray:
        """Simulate segment i without biases of the sensors and waves.

        Parameters
        ----------
        z
            (m,) unknowns.
        i
            The segment's number.

        Returns
        -------
        outputs
            (n, 4) in the order of `MODEL_OUTPUTS`, SI; NaN where the simulation diverges.
        """
        state, offset, _, _ = self._own(z, i)
        segment = self.segments[i]
        return self.model.simulate(
            self.parameters(z), state, segment.path, len(segment), offset=offset, scale=self.scale
        )

    def predicted(self, z: FloatArray, i: int) -> FloatArray:
        """Simulate segment i.

        Parameters
        ----------
        z
            (m,) unknowns.
        i
            The segment's number.

        Returns
        -------
        outputs
            (n, c) the fitted outputs with biases and waves, SI; NaN where the simulation diverges.
        """
        _, _, biases, waves = self._own(z, i)
        segment = self.segments[i]
        out = self.simulated(z, i)[:, self.columns]
        for (column, _), bias in zip(self.biases, biases, strict=True):
            out[:, column] += bias
        for omega, *amplitudes in waves:
            phase = omega * segment.signals.time_secs
            cosine, sine = np.array(amplitudes).reshape(2, -1)
            out += np.outer(np.cos(phase), cosine) + np.outer(np.sin(phase), sine)
        return out

    def jacobian(self, z: FloatArray, i: int) -> FloatArray:
        """Compute the derivatives of segment i's outputs.

        Parameters
        ----------
        z
            (m,) unknowns.
        i
            The segment's number.

        Returns
        -------
        jacobian
            (n, c, k) with respect to the free parameters and the segment's own unknowns, k in all,
            in the order of `unknown_indices`.
        """
        state, offset, _, waves = self._own(z, i)
        segment, p, s = self.segments[i], len(self.values), len(self.model.state)
        simulated = [*self.free, *range(p, p + s + self._offsets)]
        directions = np.eye(p + s + 1)[simulated]
        sensitivities = self.model.sensitivities(
            self.parameters(z), state, segment.path, len(segment), directions,
            offset=offset, scale=self.scale,
        )[:, :, self.columns]  # fmt: skip
        calm = len(simulated) + len(self.biases)
        jacobian = np.zeros((*sensitivities.shape[1:], calm + waves.size))
        jacobian[:, :, : len(simulated)] = np.moveaxis(sensitivities, 0, 2)
        for at, (column, _) in enumerate(self.biases):
            jacobian[:, column, len(simulated) + at] = 1.0
        for number, (omega, *sizes) in enumerate(waves):
            at = calm + number * self._per_wave
            _fill_wave_derivatives(
                jacobian[:, :, at : at + self._per_wave], omega, np.array(sizes), segment
            )
        return jacobian

    def measured(self, i: int) -> FloatArray:
        """Return the measured values of segment i's outputs, (n, c); NaN where not measured."""
        return self.segments[i].measured[:, self.columns]

    def measured_mask(self, i: int) -> NDArray[np.bool_]:
        """Return where segment i's outputs were measured, (n, c)."""
        return np.isfinite(self.measured(i))

    def unknown_indices(self, i: int) -> list[int]:
        """Return where the k unknowns of `jacobian` are among all m."""
        own = self.own_slice(i)
        return [*range(len(self.free)), *range(own.start, own.stop)]

    def _own(self, z: FloatArray, i: int) -> tuple[FloatArray, float, FloatArray, FloatArray]:
        """Return segment i's initial state, rudder offset, biases, and waves as rows."""
        own, s = z[self.own_slice(i)], len(self.model.state)
        biases = s + self._offsets
        waves = biases + len(self.biases)
        offset = float(own[s]) if self._offsets else 0.0
        return own[:s], offset, own[biases:waves], own[waves:].reshape(-1, self._per_wave)


def _fill_wave_derivatives(
    jacobian: FloatArray, omega: float, sizes: FloatArray, segment: Segment
) -> None:
    """Fill in the derivatives, (n, c, 1 + 2c), by a wave's frequency and amplitudes."""
    time, outputs = segment.signals.time_secs, jacobian.shape[1]
    cosine, sine = np.cos(omega * time), np.sin(omega * time)
    for c in range(outputs):
        jacobian[:, c, 0] = time * (sizes[outputs + c] * cosine - sizes[c] * sine)
        jacobian[:, c, 1 + c] = cosine
        jacobian[:, c, 1 + outputs + c] = sine


def residuals(problem: Problem, z: FloatArray) -> Sequence[FloatArray]:
    """Return measured minus predicted outputs, (n, c) for each segment; NaN where not measured."""
    return [problem.measured(i) - problem.predicted(z, i) for i in range(len(problem.segments))]

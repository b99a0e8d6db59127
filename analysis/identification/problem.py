"""What is sought: a model's parameters, and of each segment what it has of its own."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, pi, radians
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from shiplog.ships import Model, Scale, StateValue
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .segment import Segment

FIRST_SECS = 3.0  # of a segment, whose median is a first guess at how it began
WAVE_CYCLES = 0.25  # over a segment: how sure of its frequency one is who has seen it
LARGEST_WAVE = 1.0  # in rad/s, m/s or rad: none is
NO_BIAS: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Nuisance:
    """What each segment has of its own beside the state it began in: how far it may be from zero.

    A rudder that is always off stands for the rudder's own zero and for every constant yaw moment;
    0 where there is to be none.
    """

    rudder_std: float = radians(0.5)
    bias_stds: Mapping[str, float] = field(default_factory=lambda: {"yaw_rate": radians(0.005)})

    @classmethod
    def none(cls) -> "Nuisance":
        """Nothing but the state each began in."""
        return cls(0.0, NO_BIAS)


@dataclass(frozen=True, eq=False)
class Problem:
    """Trials and the model to be fitted to them: the layout of the vector of unknowns.

    The unknowns are the free parameters, then of each segment its initial state in the units of the
    equations, the rudder's offset, the sensors' biases and its waves, as far as they are sought: of
    a wave its frequency, in rad/s, and of each output a cosine and a sine.
    """

    model: Model
    segments: tuple[Segment, ...]
    scale: Scale
    outputs: tuple[str, ...]
    values: FloatArray  # (p,) of all parameters: where the search begins, or what is known
    free: tuple[int, ...]  # which of them are sought
    nuisance: Nuisance
    waves: tuple[tuple[float, ...], ...] = ()  # of each segment: where their frequencies begin

    @cached_property
    def columns(self) -> list[int]:
        """Which columns of what was measured are fitted."""
        return [MODEL_OUTPUTS.index(output) for output in self.outputs]

    @cached_property
    def free_names(self) -> tuple[str, ...]:
        """The names of the parameters sought."""
        return tuple(self.model.names[i] for i in self.free)

    @cached_property
    def biases(self) -> tuple[tuple[int, float], ...]:
        """Of each bias sought: which of the outputs fitted it is on, and its prior."""
        stds = self.nuisance.bias_stds
        return tuple((i, stds[o]) for i, o in enumerate(self.outputs) if stds.get(o, 0) > 0)

    @property
    def _offsets(self) -> int:
        return int(self.nuisance.rudder_std > 0)

    @cached_property
    def _edges(self) -> list[int]:
        """Where each segment's own unknowns begin, and where the last ones end."""
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
        """Which segments are pieces of one log, log by log."""
        names = [segment.name for segment in self.segments]
        return tuple(
            tuple(i for i, each in enumerate(names) if each == name)
            for name in dict.fromkeys(names)
        )

    def select_segments(self, kept: Sequence[int], z: FloatArray) -> tuple["Problem", FloatArray]:
        """The same of some of the segments, and the unknowns `z` as far as they are its own."""
        waves = tuple(self.waves[i] for i in kept) if self.waves else ()
        rest = replace(self, segments=tuple(self.segments[i] for i in kept), waves=waves)
        return rest, np.concatenate([z[: len(self.free)], *(z[self.own_slice(i)] for i in kept)])

    @property
    def size(self) -> int:
        """How many unknowns there are."""
        return self._edges[-1]

    def own_slice(self, i: int) -> slice:
        """Where those of segment i stand."""
        return slice(self._edges[i], self._edges[i + 1])

    def start(self) -> FloatArray:
        """(size,) where the search begins."""
        parts = [self.values[list(self.free)]]
        for i, segment in enumerate(self.segments):
            parts += [self._first_state(segment), np.zeros(self._offsets + len(self.biases))]
            parts += [np.append(wave, np.zeros(self._per_wave - 1)) for wave in self._waves(i)]
        return np.concatenate(parts)

    def _first_state(self, segment: Segment) -> FloatArray:
        first = max(2, round(FIRST_SECS / segment.dt_secs))
        state = np.zeros(len(self.model.state))
        for i, value in enumerate(self.model.state):
            if value.channel is not None and segment.has(value.channel):
                known = segment.measured[:, MODEL_OUTPUTS.index(value.channel)]
                known = known[np.isfinite(known)][:first]
                state[i] = np.median(known) / self.scale.of_channel(value.channel)
            elif np.isinf(value.prior_std):
                state[i] = self._elsewhere(value)[0]
        return state

    def _elsewhere(self, value: StateValue) -> tuple[float, float]:
        """Mean and standard deviation over the other segments of a state not measured in one.

        In the units of the equations.
        """
        if value.channel not in MODEL_OUTPUTS:
            return 0.0, 1.0
        column = MODEL_OUTPUTS.index(value.channel)
        known = np.concatenate([segment.measured[:, column] for segment in self.segments])
        known = known[np.isfinite(known)] / self.scale.of_channel(value.channel)
        if not len(known):
            return (1.0 if value.channel == "speed" else 0.0), 1.0
        return float(np.mean(known)), float(np.std(known))

    @cached_property
    def prior(self) -> tuple[FloatArray, FloatArray]:
        """(size,) what the unknowns are believed to be before any data, and how surely: 1/std^2."""
        parameters = [self.model.parameters[i] for i in self.free]
        centres, stds = [p.start for p in parameters], [p.prior_std for p in parameters]
        for i, segment in enumerate(self.segments):
            for value in self.model.state:
                measured = value.channel in self.outputs and segment.has(value.channel or "")
                alone = (
                    value.prior_std if np.isfinite(value.prior_std) else self._elsewhere(value)[1]
                )
                stds.append(inf if measured else alone)
            stds += [self.nuisance.rudder_std] * self._offsets + [std for _, std in self.biases]
            for _ in self._waves(i):
                stds += [WAVE_CYCLES * 2 * pi / (len(segment) * segment.dt_secs)]
                stds += [LARGEST_WAVE] * (self._per_wave - 1)
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
                # nothing depends on it: any belief keeps it in its place
                centre[at], precision[at] = self._first_state(segment)[heading[0]], 1.0
        return centre, precision

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(size,) the least and the greatest each unknown may be."""
        lowest, highest = np.full(self.size, -inf), np.full(self.size, inf)
        for at, i in enumerate(self.free):
            lowest[at], highest[at] = (
                self.model.parameters[i].lowest,
                self.model.parameters[i].highest,
            )
        return lowest, highest

    def parameters(self, z: FloatArray) -> FloatArray:
        """(p,) all the model's parameters, of the unknowns."""
        values = self.values.copy()
        values[list(self.free)] = z[: len(self.free)]
        return values

    def predicted(self, z: FloatArray, i: int) -> FloatArray:
        """(n, c) the outputs fitted, of segment i."""
        state, offset, biases, waves = self._own(z, i)
        segment = self.segments[i]
        out = self.model.simulate(
            self.parameters(z), state, segment.path, len(segment), offset=offset, scale=self.scale
        )[:, self.columns]
        for (column, _), bias in zip(self.biases, biases, strict=True):
            out[:, column] += bias
        for omega, *sizes in waves:
            phase = omega * segment.signals.time_secs
            amplitudes = np.array(sizes).reshape(2, -1)
            out += np.outer(np.cos(phase), amplitudes[0]) + np.outer(np.sin(phase), amplitudes[1])
        return out

    def jacobian(self, z: FloatArray, i: int) -> FloatArray:
        """(n, c, k) how they change with the k free parameters and segment i's own unknowns."""
        state, offset, _, waves = self._own(z, i)
        segment, p, s = self.segments[i], len(self.values), len(self.model.state)
        moved = [*self.free, *range(p, p + s + self._offsets)]
        directions = np.eye(p + s + 1)[moved]
        found = self.model.sensitivities(
            self.parameters(z), state, segment.path, len(segment), directions,
            offset=offset, scale=self.scale,
        )[:, :, self.columns]  # fmt: skip
        known = len(moved) + len(self.biases)
        jacobian = np.zeros((*found.shape[1:], known + waves.size))
        jacobian[:, :, : len(moved)] = np.moveaxis(found, 0, 2)
        for at, (column, _) in enumerate(self.biases):
            jacobian[:, column, len(moved) + at] = 1.0
        for number, (omega, *sizes) in enumerate(waves):
            at = known + number * self._per_wave
            _by_wave(jacobian[:, :, at : at + self._per_wave], omega, np.array(sizes), segment)
        return jacobian

    def measured(self, i: int) -> FloatArray:
        """(n, c) what was measured of them, NaN where nothing was."""
        return self.segments[i].measured[:, self.columns]

    def measured_mask(self, i: int) -> NDArray[np.bool_]:
        """(n, c) which of them were measured."""
        return np.isfinite(self.measured(i))

    def unknown_indices(self, i: int) -> list[int]:
        """Where the unknowns of `jacobian` stand among all."""
        own = self.own_slice(i)
        return [*range(len(self.free)), *range(own.start, own.stop)]

    def _own(self, z: FloatArray, i: int) -> tuple[FloatArray, float, FloatArray, FloatArray]:
        """Segment i's initial state, rudder offset, biases, and waves by rows."""
        own, s = z[self.own_slice(i)], len(self.model.state)
        biases = s + self._offsets
        waves = biases + len(self.biases)
        offset = float(own[s]) if self._offsets else 0.0
        return own[:s], offset, own[biases:waves], own[waves:].reshape(-1, self._per_wave)


def _by_wave(jacobian: FloatArray, omega: float, sizes: FloatArray, segment: Segment) -> None:
    """Fill in how the outputs, (n, c, 1 + 2c), change with a wave's frequency and amplitudes."""
    time, outputs = segment.signals.time_secs, jacobian.shape[1]
    cosine, sine = np.cos(omega * time), np.sin(omega * time)
    for c in range(outputs):
        jacobian[:, c, 0] = time * (sizes[outputs + c] * cosine - sizes[c] * sine)
        jacobian[:, c, 1 + c] = cosine
        jacobian[:, c, 1 + outputs + c] = sine


def residuals(problem: Problem, z: FloatArray) -> Sequence[FloatArray]:
    """Measured less predicted, (n, c) for each segment."""
    return [problem.measured(i) - problem.predicted(z, i) for i in range(len(problem.segments))]

"""The unknowns of a fit: a model's free parameters, and each segment's own unknowns."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np
from numpy.typing import NDArray

from shiplog.ships import Model, Scale, StateValue
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .fix_blocks import (
    FIT_OUTPUTS,
    GROUND_VELOCITY,
    FixBlocks,
    course_at_start,
    fix_blocks,
    simulated_track,
    simulated_track_derivatives,
)
from .nuisance import Nuisance
from .own_unknowns import OwnLayout, OwnUnknowns, add_waves, wave_derivatives, wave_prior_stds
from .segment import Segment, segments_by_run

BLOCK_LENGTHS = 0.25  # ship lengths sailed at the approach speed in a block of position fixes
INITIAL_STATE_SECS = 3.0  # at the start of a segment, whose median is the guess of its first state


@dataclass(frozen=True, eq=False)
class Problem:
    """A model, the segments to fit it to, and the layout of the vector of unknowns.

    The m unknowns are the free parameters, the rudder zero of all runs (rad), then for each segment
    its own, as `OwnLayout` orders them.

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
    recorded
        The segments as they were given; `segments` may be means of theirs (`averaged`).
    """

    model: Model
    segments: tuple[Segment, ...]
    scale: Scale
    outputs: tuple[str, ...]
    values: FloatArray
    free: tuple[int, ...]
    nuisance: Nuisance
    waves: tuple[tuple[float, ...], ...] = ()
    recorded: tuple[Segment, ...] = ()

    @cached_property
    def columns(self) -> list[int]:
        """The numbers of the fitted outputs among `FIT_OUTPUTS`."""
        return [FIT_OUTPUTS.index(output) for output in self.outputs]

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
    def common(self) -> int:
        """How many unknowns all segments share: the free parameters, and the rudder zero."""
        return len(self.free) + int(self.nuisance.common_rudder_std > 0)

    @cached_property
    def uses_positions(self) -> bool:
        """Whether velocities over ground are fitted."""
        return GROUND_VELOCITY[0] in self.outputs

    @cached_property
    def own_layout(self) -> OwnLayout:
        """How a segment's own unknowns are laid out."""
        given, positions = self.nuisance, self.uses_positions
        return OwnLayout(
            states=len(self.model.state),
            rudder=int(given.rudder_std > 0),
            biases=len(self.biases),
            speed_scale=int(positions and "speed" in self.outputs and given.speed_scale_std > 0),
            current=2 * int(positions and given.current_std > 0),
            # not the velocities over ground, which are means
            waved=sum(output in MODEL_OUTPUTS for output in self.outputs),
        )

    @cached_property
    def _blocks(self) -> tuple[FixBlocks | None, ...]:
        """The blocks of each segment's fixes; None where they give no velocity."""
        secs = BLOCK_LENGTHS * self.scale.secs
        blocks = (
            None if each.fixes is None else fix_blocks(each.fixes, each.dt_secs, secs, each.antenna)
            for each in self.segments
        )
        return tuple(each if each and each.has_velocities else None for each in blocks)

    def has_velocities(self, i: int) -> bool:
        """Return whether the fixes of segment i give velocities over ground, fitted or not."""
        return self._blocks[i] is not None

    @cached_property
    def _edges(self) -> list[int]:
        """Where each segment's own unknowns start, and where the last ones end."""
        layout = self.own_layout
        counts = [len(self._waves(i)) for i in range(len(self.segments))]
        sizes = [layout.calm + count * layout.per_wave for count in counts]
        return [int(edge) for edge in np.cumsum([self.common, *sizes])]

    def _waves(self, i: int) -> tuple[float, ...]:
        return self.waves[i] if self.waves else ()

    @cached_property
    def runs(self) -> tuple[tuple[int, ...], ...]:
        """The numbers of each run's segments."""
        return segments_by_run(self.segments)

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
        return rest, np.concatenate([z[: self.common], *(z[self.own_slice(i)] for i in kept)])

    @property
    def size(self) -> int:
        """The number of unknowns, m."""
        return self._edges[-1]

    def own_slice(self, i: int) -> slice:
        """Return where segment i's own unknowns are among all."""
        return slice(self._edges[i], self._edges[i + 1])

    def start(self) -> FloatArray:
        """Return the initial guess of the unknowns, (m,): all but states and frequencies zero."""
        parts = [self.values[list(self.free)], np.zeros(self.common - len(self.free))]
        layout = self.own_layout
        for i in range(len(self.segments)):
            parts += [self._first_state(i), np.zeros(layout.calm - layout.states)]
            parts += [np.append(wave, np.zeros(layout.per_wave - 1)) for wave in self._waves(i)]
        return np.concatenate(parts)

    def _first_state(self, number: int) -> FloatArray:
        segment = self.segments[number]
        first = max(2, round(INITIAL_STATE_SECS / segment.dt_secs))
        state = np.zeros(len(self.model.state))
        for i, value in enumerate(self.model.state):
            if value.channel is not None and segment.has(value.channel):
                measured = segment.measured[:, MODEL_OUTPUTS.index(value.channel)]
                measured = measured[np.isfinite(measured)][:first]
                state[i] = np.median(measured) / self.scale.of_channel(value.channel)
            elif (
                value.channel == "heading"
                and segment.fixes is not None
                and self.has_velocities(number)
            ):
                state[i] = course_at_start(segment.fixes)
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
        stds = [p.prior_std for p in parameters]
        stds += [self.nuisance.common_rudder_std] * (self.common - len(self.free))
        centre = self.start()
        centre[: len(parameters)] = [p.start for p in parameters]
        for i, segment in enumerate(self.segments):
            own = self.own_slice(i)
            centre[own.start : own.start + self.own_layout.calm] = 0.0
            stds += self._own_prior_stds(i, segment)
            if not self._observes_heading(i):
                heading = [value.channel for value in self.model.state].index("heading")
                # no output depends on it: any prior keeps it from drifting
                centre[own.start + heading] = self._first_state(i)[heading]
                stds[own.start + heading] = 1.0
        return centre, np.array(stds) ** -2.0

    def _observes_heading(self, i: int) -> bool:
        measured = "heading" in self.outputs and self.segments[i].has("heading")
        return measured or (self.uses_positions and self.has_velocities(i))

    def _own_prior_stds(self, i: int, segment: Segment) -> list[float]:
        """Return the prior standard deviations of segment i's own unknowns."""
        layout, given, stds = self.own_layout, self.nuisance, []
        for value in self.model.state:
            std = value.prior_std
            if not np.isfinite(std):
                std = self._typical_state(value)[1]
            measured = value.channel in self.outputs and segment.has(value.channel or "")
            if value.channel == "heading":
                measured = measured or self._observes_heading(i)
            stds.append(inf if measured else std)
        stds += [given.rudder_std] * layout.rudder + [std for _, std in self.biases]
        stds += [given.speed_scale_std] * layout.speed_scale
        stds += [given.current_std] * layout.current
        for _ in self._waves(i):
            stds += wave_prior_stds(layout, len(segment) * segment.dt_secs)
        return stds

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
        own, segment = self.own(z, i), self.segments[i]
        return self.model.simulate(
            self.parameters(z), own.state, segment.path, len(segment),
            offset=self.rudder_zero(z) + own.rudder, scale=self.scale,
        )  # fmt: skip

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
        own, segment = self.own(z, i), self.segments[i]
        out = self._with_velocities(self.simulated(z, i), own.current, i)[:, self.columns]
        if self.own_layout.speed_scale:
            out[:, self.outputs.index("speed")] *= 1 + own.speed_scale
        for (column, _), bias in zip(self.biases, own.biases, strict=True):
            out[:, column] += bias
        add_waves(out[:, : self.own_layout.waved], own.waves, segment.signals.time_secs)
        return out

    def _with_velocities(self, simulated: FloatArray, current: FloatArray, i: int) -> FloatArray:
        """Return the simulated outputs, (n, 4), with the velocities over ground, (n, 6)."""
        if not self.uses_positions:
            return simulated
        velocities, blocks = np.full((len(simulated), 2), np.nan), self._blocks[i]
        if blocks is not None:
            track = simulated_track(simulated, self.segments[i].dt_secs, blocks.antenna)
            velocities = blocks.velocities(track) + current
        return np.column_stack((simulated, velocities))

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
        own, layout, segment = self.own(z, i), self.own_layout, self.segments[i]
        p, s = len(self.values), layout.states
        zeros = [p + s] * (self.common - len(self.free))
        simulated = [*self.free, *zeros, *range(p, p + s + layout.rudder)]
        run = self.model.propagate(
            self.parameters(z), own.state, segment.path, len(segment),
            np.eye(p + s + 1)[simulated],
            offset=self.rudder_zero(z) + own.rudder, scale=self.scale,
        )  # fmt: skip
        by = np.moveaxis(run.outputs_by, 0, 2)
        if self.uses_positions:
            by = self._with_velocity_derivatives(run.outputs, by, i)
        jacobian = np.zeros((len(segment), len(self.outputs), len(self.unknown_indices(i))))
        jacobian[:, :, : len(simulated)] = by[:, self.columns]
        for at, (column, _) in enumerate(self.biases, self.common + layout.first_bias):
            jacobian[:, column, at] = 1.0
        if layout.speed_scale:
            speed = self.outputs.index("speed")
            jacobian[:, speed] *= 1 + own.speed_scale
            speeds = run.outputs[:, MODEL_OUTPUTS.index("speed")]
            jacobian[:, speed, self.common + layout.first_scale] = speeds
        for at in range(layout.current):
            column = self.outputs.index(GROUND_VELOCITY[at])
            jacobian[:, column, self.common + layout.first_current + at] = 1.0
        for at, wave in enumerate(own.waves):
            first = self.common + layout.calm + at * layout.per_wave
            columns = slice(first, first + layout.per_wave)
            jacobian[:, : layout.waved, columns] = wave_derivatives(wave, segment.signals.time_secs)
        return jacobian

    def _with_velocity_derivatives(
        self, simulated: FloatArray, by: FloatArray, i: int
    ) -> FloatArray:
        """Return the derivatives of the outputs, (n, 4, k), with the velocities', (n, 6, k)."""
        velocities, blocks = np.full((len(by), 2, by.shape[2]), np.nan), self._blocks[i]
        if blocks is not None:
            dt = self.segments[i].dt_secs
            track = simulated_track_derivatives(simulated, by, dt, blocks.antenna)
            velocities = blocks.velocities(track)
        return np.concatenate((by, velocities), axis=1)

    def measured(self, i: int) -> FloatArray:
        """Return the measured values of segment i's outputs, (n, c); NaN where not measured."""
        return self._measured[i]

    @cached_property
    def _measured(self) -> tuple[FloatArray, ...]:
        measured = [segment.measured for segment in self.segments]
        if self.uses_positions:
            for i, segment in enumerate(self.segments):
                velocities, blocks = np.full((len(segment), 2), np.nan), self._blocks[i]
                if blocks is not None and segment.fixes is not None:
                    velocities = blocks.velocities(segment.fixes)
                measured[i] = np.column_stack((measured[i], velocities))
        return tuple(each[:, self.columns] for each in measured)

    def measured_mask(self, i: int) -> NDArray[np.bool_]:
        """Return where segment i's outputs were measured, (n, c)."""
        return np.isfinite(self.measured(i))

    def unknown_indices(self, i: int) -> list[int]:
        """Return where the k unknowns of `jacobian` are among all m."""
        own = self.own_slice(i)
        return [*range(self.common), *range(own.start, own.stop)]

    def rudder_zero(self, z: FloatArray) -> float:
        """Return the rudder offset that all runs share, rad."""
        return float(z[len(self.free)]) if self.common > len(self.free) else 0.0

    def own(self, z: FloatArray, i: int) -> OwnUnknowns:
        """Return segment i's own unknowns."""
        return self.own_layout.split(z[self.own_slice(i)])


def residuals(problem: Problem, z: FloatArray) -> Sequence[FloatArray]:
    """Return measured minus predicted outputs, (n, c) for each segment; NaN where not measured."""
    return [problem.measured(i) - problem.predicted(z, i) for i in range(len(problem.segments))]

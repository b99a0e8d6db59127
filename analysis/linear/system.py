"""A linear system: plant, channels, noise, disturbances, method of estimation, regulator."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from analysis.design.augmentation import Exosystem, Plant
from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .methods import KalmanMethod, Method
from .spectra import ShapedNoise


@dataclass(frozen=True)
class ChannelBinding:
    """A signal of the system and the channel of a log from which it is read.

    The signal is scale · (channel - offset), the channel being in `unit`.

    Attributes
    ----------
    name
        Name of the signal in the system.
    channel
        Name of the channel.
    unit
        Unit in which the system takes the channel; None for the unit of the channel in the log.
    offset
        Reading of the channel at which the signal is zero, in `unit`.
    scale
        Factor from `unit` to the unit of the signal.
    std
        Of an output: standard deviation of the white noise of one sample of the channel, in `unit`;
        None where it is estimated from the log by third differences.
    """

    name: str
    channel: str
    unit: str | None = None
    offset: float = 0.0
    scale: float = 1.0
    std: float | None = None


class Linearisation(NamedTuple):
    """x' = A x + B u + b near a point of a trajectory.

    Attributes
    ----------
    A
        (n, n), 1/s.
    B
        (n, inputs).
    b
        (n,): what remains of the rate of change at the point.
    """

    A: FloatArray
    B: FloatArray
    b: FloatArray


# from the estimate (n,) and the scheduling signals (s,) at the start of a tick
Linearise = Callable[[FloatArray, FloatArray], Linearisation]


@dataclass(frozen=True, eq=False)
class SystemDisturbance:
    """A disturbance of known modes: its generator and where it acts.

    Attributes
    ----------
    name, unit
        Name and unit of the disturbance.
    exosystem
        Its generator.
    on_state, on_input, on_sensor
        Factor on the rate of change of each named state, on each named input, and on each named
        output.
    intensity
        Intensity of white noise on the rate of change of its last state (of the last two of an
        oscillation), by which a filter with a covariance lets the disturbance vary.
    """

    name: str
    exosystem: Exosystem
    on_state: Mapping[str, float] = field(default_factory=dict)
    on_input: Mapping[str, float] = field(default_factory=dict)
    on_sensor: Mapping[str, float] = field(default_factory=dict)
    intensity: float = 0.0
    unit: str = "1"


@dataclass(frozen=True, eq=False)
class RegulatorWeights:
    """Weights of the regulator u = L x̂ and its shift; see `analysis.design.quality`.

    Attributes
    ----------
    P
        (n, n): weight of the states of the plant.
    R
        (inputs, inputs): weight of the inputs.
    G
        (n, n): weight of the rates.
    shift
        c, 1/s.
    cycles
        Number of designs one after the other, (11).
    """

    P: FloatArray
    R: FloatArray
    G: FloatArray
    shift: float = 0.0
    cycles: int = 1


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """A plant x' = A x + B u + w, y = C x + D u + v, and how its states are estimated from a log.

    Attributes
    ----------
    name
        Name of the system.
    plant
        A (n, n), B (n, inputs), C (m, n), names of states and of outputs.
    D
        (m, inputs).
    units
        (n,): units of the states.
    inputs, outputs
        The channels of the inputs, in the order of B's columns, and of the outputs, in the order of
        C's rows.
    W
        (n, n): intensity of the white noise w.
    method
        The method of estimation.
    disturbances
        Disturbances of known modes.
    shaped
        Coloured noise by shaping filters.
    initial, initial_std
        Initial values of states by name, and their standard deviations; what is not given follows
        from the log.
    schedule, linearise
        Channels along which the plant is linearised anew at each tick, and the function that does
        so; A and B of the plant are then those of the start.
    tick_secs
        Duration of a tick, s; None for one step of the clock.
    step_secs
        Step of the clock, s; None where it follows from the intervals of the outputs.
    regulator
        Weights of a regulator that is computed beside the recorded inputs.
    zero_inputs
        Names of inputs of the plant that have no channel and are taken as zero.
    file
        The file that describes it, for messages; empty for none.
    """

    name: str
    plant: Plant
    D: FloatArray
    units: tuple[str, ...]
    inputs: tuple[ChannelBinding, ...]
    outputs: tuple[ChannelBinding, ...]
    W: FloatArray
    method: Method = field(default_factory=KalmanMethod)
    disturbances: tuple[SystemDisturbance, ...] = ()
    shaped: tuple[ShapedNoise, ...] = ()
    initial: Mapping[str, float] = field(default_factory=dict)
    initial_std: Mapping[str, float] = field(default_factory=dict)
    schedule: tuple[ChannelBinding, ...] = ()
    linearise: Linearise | None = None
    tick_secs: float | None = None
    step_secs: float | None = None
    regulator: RegulatorWeights | None = None
    zero_inputs: tuple[str, ...] = ()
    file: str = ""

    @property
    def bindings(self) -> tuple[ChannelBinding, ...]:
        """Every channel that is read: outputs, inputs, schedule."""
        return (*self.outputs, *self.inputs, *self.schedule)

    def start(self) -> Linearisation:
        """Return the plant's own A and B, with b = 0."""
        return Linearisation(self.plant.A, self.plant.B, np.zeros(len(self.plant.A)))

    def linearised_at(self, schedule: FloatArray) -> Linearisation:
        """Return the plant at scheduling signals (s,), its state being zero."""
        if self.linearise is None:
            return self.start()
        return self.linearise(np.zeros(len(self.plant.A)), schedule)


@contextmanager
def naming_system_file(system: LinearSystem) -> Iterator[None]:
    """Add the file of a system to an error about what the system asks for.

    Raises
    ------
    UsageError
        The error with the path of the file at its end.
    """
    try:
        yield
    except UsageError as error:
        if not system.file:
            raise
        raise UsageError(f"{error}: {system.file}") from error

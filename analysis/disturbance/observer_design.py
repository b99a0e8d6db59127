"""Design of a discrete observer of the force on a plant: slow part and wave.

Plant and exosystems form one system, of which one output, the plant's first state, is measured.

Source: "Algorithm of ship course control system watcher for assessing disturbances and noise
measurements", eqs (3) and (4).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from analysis.design.augmentation import (
    AugmentedPlant,
    DisturbanceInput,
    Exosystem,
    Plant,
    augment_with_disturbances,
)
from analysis.design.luenberger import POLE_PATTERNS, discrete_observer
from analysis.design.observability import ComplexArray
from shiplog.types import FloatArray

# The wave's poles keep its frequency and decay at a fifth of it. Evaluated on simulated yaw of 0.15
# deg/s at 0.3 to 1 rad/s, with the paper's noise and with white noise: the amplitude is within 10 %
# after 16 to 62 s, the slow part is as accurate as with any other decay, and the error in irregular
# waves (damping 0.1) is the smallest, as with 0.3. With 0.1, a frequency error of 5 % doubles the
# error of both parts; with 0.3, the slow part is disturbed for up to 90 s, and the error due to
# noise grows with the square root of the decay. A Butterworth pair at two thirds of the frequency,
# such as 0.4 for 0.6 rad/s, lies far from the wave: 55 to 200 s, and two to three times the error
# in irregular waves.
WAVE_DECAY = 0.2
# settling time times frequency: of a constant, from the paper, and of a ramp
SLOW_SETTLING = (5.0, 9.0)


@dataclass(frozen=True)
class ForceModel:
    """The kind of force assumed, and how fast the observer follows it.

    Attributes
    ----------
    degree
        Degree of the slow part: 0 for a constant, 1 for a ramp, None for no slow part.
    wave
        Frequency of the wave, rad/s; None for no wave.
    spectrum
        Pattern of the poles of plant and slow part, a key of `POLE_PATTERNS`.
    frequency
        Magnitude of these poles, rad/s.
    """

    degree: int | None
    wave: float | None
    spectrum: str
    frequency: float


class Force(NamedTuple):
    """Matrices of a force observer for a plant of p states and a force of k states.

    The leading axis of `motion` and `mean` has two entries: the free motion of the force, and the
    motion with the slow part held.

    Attributes
    ----------
    correction
        Gain of the innovation on the states of plant and force, (p + k,).
    motion
        Transition matrices of the force over one instant, (2, k, k).
    mean
        Rows that give the mean of the force over one instant, (2, k).
    parts
        Rows that give slow part and wave of the force, (2, k).
    patience
        Number of instants without a sample after which the slow part is held.
    """

    correction: FloatArray
    motion: FloatArray
    mean: FloatArray
    parts: FloatArray
    patience: float


@dataclass(frozen=True, eq=False)
class ForceDesign:
    """A force observer and its accuracy.

    Attributes
    ----------
    force
        The matrices of the observer.
    stds
        Standard deviations of slow part and wave per unit of standard deviation of the measurement.
    settling_secs
        Duration of the first transient, s.
    """

    force: Force
    stds: tuple[float, float]
    settling_secs: float


class Sampling(NamedTuple):
    """Sampling of a plant's output.

    Attributes
    ----------
    interval_secs
        Median time from sample to sample, s.
    longest_secs
        Longest time from sample to sample that is not a gap, s.
    dt_secs
        Time between instants of the clock, s.
    """

    interval_secs: float
    longest_secs: float
    dt_secs: float


def force_observer(plant: FloatArray, model: ForceModel, sampling: Sampling) -> ForceDesign:
    """Design an observer of a force that acts on the last state of x' = plant x.

    The first state is measured. The poles of plant and slow part are those of `model`; those of the
    wave keep its frequency and decay at `WAVE_DECAY` times it, but no slower than the slow part.
    Without samples the wave continues, and a ramp continues for 1 / frequency, or for the longest
    interval that is not a gap; then it is held. By then the noise in its slope has moved it by less
    than half of its own standard deviation. Without the hold its error doubled after gaps of 200 s
    in recorded manoeuvres, where much of the estimate is due to model errors and follows the turn.

    Parameters
    ----------
    plant
        The plant's matrix A, (p, p), 1/s.
    model
        The kind of force and the poles.
    sampling
        The sampling of the plant's first state.

    Raises
    ------
    UsageError
        For a plant that is not finite, and where the samples are too far apart to separate the wave
        from the slow part.

    References
    ----------
    Equations (3) and (4) of the paper named in the module's docstring.

    Examples
    --------
    >>> constant = ForceModel(degree=0, wave=None, spectrum="butterworth", frequency=0.1)
    >>> design = force_observer(np.zeros((1, 1)), constant, Sampling(1.0, 3.0, 1.0))
    >>> design.force.correction.shape, round(design.settling_secs)
    ((2,), 50)
    """
    system = _with_force(plant, model)
    observer = discrete_observer(
        system.A, system.C, _poles(len(plant), model), sampling.interval_secs
    )
    p, parts = len(plant), np.zeros((2, len(system.A) - len(plant)))
    for name, row in zip(system.names, system.D, strict=True):
        parts[int(name == "wave")] = row[p:]
    moving = system.A[p:, p:]
    held = moving * [[system.names[owner] == "wave"] for owner in system.disturbance_index[p:]]
    both = [_discretised(Ac, parts.sum(axis=0), sampling.dt_secs) for Ac in (moving, held)]
    patience = max(1 / model.frequency, sampling.longest_secs) / sampling.dt_secs
    stds = parts @ observer.noise_gain[p:]
    return ForceDesign(
        Force(
            correction=observer.correction,
            motion=np.array([motion for motion, _ in both]),
            mean=np.array([mean for _, mean in both]),
            parts=parts,
            patience=patience,
        ),
        stds=(float(stds[0]), float(stds[1])),
        settling_secs=SLOW_SETTLING[model.degree or 0] / model.frequency,
    )


def _with_force(plant: FloatArray, model: ForceModel) -> AugmentedPlant:
    """Augment the plant with the exosystems, the slow part before the wave."""
    states = tuple(f"x{i}" for i in range(len(plant)))
    exosystems = {}
    if model.degree is not None:
        exosystems["slow"] = Exosystem.polynomial(model.degree)
    if model.wave is not None:
        exosystems["wave"] = Exosystem.harmonic(model.wave)
    measured = Plant(plant, np.zeros((len(plant), 1)), np.eye(1, len(plant)), states, ("y",))
    disturbances = [
        DisturbanceInput(name, own, {states[-1]: 1.0}) for name, own in exosystems.items()
    ]
    return augment_with_disturbances(measured, disturbances)


def _poles(order: int, model: ForceModel) -> ComplexArray:
    """Return the poles of the error for a plant of that order and its force, 1/s."""
    slow = 0 if model.degree is None else model.degree + 1
    poles = POLE_PATTERNS[model.spectrum](order + slow, model.frequency)
    if model.wave is None:
        return poles
    pole = complex(-max(WAVE_DECAY * model.wave, model.frequency), model.wave)
    return np.array([*poles, pole, pole.conjugate()])


def _discretised(Ac: FloatArray, Cc: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Discretise x' = Ac x over dt: the transition (k, k), and the row (k,) of the mean of Cc x."""
    k = len(Ac)
    both = np.zeros((k + 1, k + 1))
    both[:k, :k], both[k, :k] = Ac, Cc
    transition = expm(both * dt)
    return transition[:k, :k], transition[k, :k] / dt

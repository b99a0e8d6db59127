"""An observer of the force on a plant, from sample to sample: of its slow part and of a wave.

Plant and exosystems are one system; one output, the plant's first state, is measured. Source:
"Algorithm of ship course control system watcher for assessing disturbances and noise
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

# The wave's poles keep its frequency and decay at a fifth of it. Tried on simulated yaw of 0.15
# deg/s at 0.3 to 1 rad/s, with the paper's noise and with white noise: the amplitude is within 10 %
# after 16 to 62 s, the slow part as good as with any other decay, and of irregular waves (damping
# 0.1) the least is missed, as with three tenths. At a tenth a frequency 5 % off leaves twice the
# error in both parts; at three tenths the slow poles are shaken for up to 90 s, and noise grows
# with the root. Butterworth's pair at two thirds of the frequency, as 0.4 for 0.6 rad/s, goes far
# from where the wave is: 55 to 200 s, and of irregular waves two to three times as much is missed.
WAVE_DECAY = 0.2
SLOW_SETTLING = (5.0, 9.0)  # over the frequency: a constant's transient, as the paper; a ramp's


@dataclass(frozen=True)
class ForceModel:
    """What a force is thought to be, and how fast it is to be found."""

    degree: int | None  # of the slow part: 0 a constant, 1 a ramp; None: there is none
    wave: float | None  # rad/s; None: there is none
    spectrum: str  # of the poles of plant and slow part, one of SPECTRA
    frequency: float  # rad/s, of these


class Force(NamedTuple):
    """What a loop over the samples needs: the plant's p states, then the force's k."""

    correction: FloatArray  # (p + k,): what an innovation adds to them
    motion: FloatArray  # (2, k, k): from one instant to the next; with the slow part held
    mean: FloatArray  # (2, k): the force's mean over that time; with the slow part held
    parts: FloatArray  # (2, k): of the force's states the slow part and the wave
    patience: float  # instants without a sample after which the slow part is held


@dataclass(frozen=True, eq=False)
class ForceDesign:
    """An observer of a force, and the error that noise leaves in it."""

    force: Force
    stds: tuple[float, float]  # of slow part and wave, per unit of the measurement's
    settling_secs: float  # of the first transient


class Sampling(NamedTuple):
    """When a plant's output is measured."""

    interval_secs: float  # the usual, from sample to sample
    longest_secs: float  # from sample to sample: more is a gap
    dt_secs: float  # from instant to instant of the clock


def force_observer(plant: FloatArray, model: ForceModel, sampling: Sampling) -> ForceDesign:
    """The observer of a force on the last state of x' = plant x, the first being measured.

    `plant` is (p, p). Poles of plant and slow part are `model`'s; the wave's are its own frequency,
    decaying at `WAVE_DECAY` of it, yet no slower than the slow part. Without samples a wave turns
    on, and a ramp goes on for 1 / frequency, or the longest usual interval; then it is held. By
    then noise in its slope has moved it by less than half of what noise leaves in itself. Let run
    on, it had twice the error after gaps of 200 s in recorded manoeuvres, where much of what is
    seen comes of the model's errors and turns with the ship.

    Raises `UsageError` for a plant that is not finite, and where samples so far apart do not tell
    the wave from the slow part.
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
    both = [_carried(Ac, parts.sum(axis=0), sampling.dt_secs) for Ac in (moving, held)]
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
    """Plant and exosystems as one, the slow part before the wave."""
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
    """Of a plant of that order and its force, 1/s."""
    slow = 0 if model.degree is None else model.degree + 1
    poles = POLE_PATTERNS[model.spectrum](order + slow, model.frequency)
    if model.wave is None:
        return poles
    pole = complex(-max(WAVE_DECAY * model.wave, model.frequency), model.wave)
    return np.array([*poles, pole, pole.conjugate()])


def _carried(Ac: FloatArray, Cc: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """x' = Ac x over dt: what x becomes, (k, k), and the mean of Cc x until then, (k,)."""
    k = len(Ac)
    both = np.zeros((k + 1, k + 1))
    both[:k, :k], both[k, :k] = Ac, Cc
    found = expm(both * dt)
    return found[:k, :k], found[k, :k] / dt

"""A rigid body that turns freely: Euler angles measured, angular rates estimated.

The plant of Zubov, Mikrin, Oleinik and Ryabchenko, linearised at the estimate of each tick.
"""

from pathlib import Path

import numpy as np

from shiplog.types import FloatArray

from .file_section import FileSection
from .plant_form import PlantForm
from .system import Linearisation

STATES = {
    "roll": "rad",
    "pitch": "rad",
    "yaw": "rad",
    "roll_rate": "rad/s",
    "pitch_rate": "rad/s",
    "yaw_rate": "rad/s",
}
INPUTS = {"roll_moment": "Nm", "pitch_moment": "Nm", "yaw_moment": "Nm"}


def rigid_body(section: FileSection, _: Path) -> PlantForm:
    """Build the rotation of a rigid body: angles yaw, pitch, roll in this order, body-fixed rates.

    `inertia` is the list of its three principal moments of inertia, kg m². The rates of the angles
    are infinite where the pitch is 90°.
    """
    inertia = section.numbers("inertia")
    if len(inertia) != 3 or np.any(inertia <= 0):
        section.errors.append("plant.inertia must be three positive moments of inertia")
        inertia = np.ones(3)
    ratios = (np.roll(inertia, -1) - np.roll(inertia, -2)) / inertia
    B = np.vstack((np.zeros((3, 3)), np.diag(1 / inertia)))

    def linearise(x: FloatArray, _: FloatArray) -> Linearisation:
        A = _jacobian(x, ratios)
        return Linearisation(A, B, _rate(x, ratios) - A @ x)

    start = linearise(np.zeros(6), np.zeros(0))
    return PlantForm(start.A, B, STATES, INPUTS, linearise=linearise)


def _rate(x: FloatArray, ratios: FloatArray) -> FloatArray:
    """Return x' of x = (roll, pitch, yaw, p, q, r) without moments."""
    phi, theta, _, p, q, r = x
    turn = q * np.sin(phi) + r * np.cos(phi)
    return np.array(
        [
            p + np.tan(theta) * turn,
            q * np.cos(phi) - r * np.sin(phi),
            turn / np.cos(theta),
            *(ratios * [q * r, r * p, p * q]),
        ]
    )


def _jacobian(x: FloatArray, ratios: FloatArray) -> FloatArray:
    """Return the derivative (6, 6) of `_rate`."""
    phi, theta, _, p, q, r = x
    s, c, tan, sec = np.sin(phi), np.cos(phi), np.tan(theta), 1 / np.cos(theta)
    turn, across = q * s + r * c, q * c - r * s
    a, b, g = ratios
    return np.array(
        [
            [tan * across, sec**2 * turn, 0, 1, tan * s, tan * c],
            [-turn, 0, 0, 0, c, -s],
            [across * sec, turn * sec * tan, 0, 0, s * sec, c * sec],
            [0, 0, 0, 0, a * r, a * q],
            [0, 0, 0, b * r, 0, b * p],
            [0, 0, 0, g * q, g * p, 0],
        ]
    )

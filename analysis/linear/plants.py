"""Plants by name: roll, yaw and surge, from their parameters or from a vessel's coefficients."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from shiplog.errors import VesselError
from shiplog.types import FloatArray

from .file_section import FileSection
from .plant_form import PlantForm
from .rigid_body import rigid_body
from .system import Linearisation, Linearise

if TYPE_CHECKING:
    from shiplog.ships.paper import Coefficients


def roll(section: FileSection, _: Path) -> PlantForm:
    """Build I ω' = -damping ω - stiffness φ + moment, φ' = ω; without a stiffness only ω.

    Inertia in kg m², damping in N m s, stiffness in N m/rad.
    """
    inertia = section.number("inertia", positive=True)
    damping = section.number("damping", 0.0, least=0.0) / inertia
    has_angle = "stiffness" in section
    stiffness = section.number("stiffness", 0.0, least=0.0) / inertia
    A, B = np.array([[-damping, -stiffness], [1.0, 0.0]]), np.array([[1 / inertia], [0.0]])
    size = 2 if has_angle else 1
    states = {"roll_rate": "rad/s", "roll": "rad"} if has_angle else {"roll_rate": "rad/s"}
    return PlantForm(A[:size, :size], B[:size], states, {"moment": "Nm"})


def yaw(section: FileSection, folder: Path) -> PlantForm:
    """Build Nomoto's model: T ω' + ω = K δ, or of second order with T1, T2, T3; with a heading.

    T1 T2 ω'' + (T1 + T2) ω' + ω = K (δ + T3 δ'). From a vessel file the model is the nonlinear one
    of the identification paper, linearised along the recorded yaw rate, speed and revolutions. The
    second state is ω' less the part that is proportional to δ.
    """
    has_heading = section.flag("heading")
    if "vessel" in section:
        form = _yaw_of_vessel(section, folder)
    elif "T" in section:
        T, K = section.number("T", positive=True), section.number("K")
        form = PlantForm(np.array([[-1 / T]]), np.array([[K / T]]), {"yaw_rate": "rad/s"})
    else:
        T1, T2 = (section.number(key, positive=True) for key in ("T1", "T2"))
        T3, K = section.number("T3", 0.0), section.number("K")
        A = np.array([[0.0, 1.0], [-1 / (T1 * T2), -(T1 + T2) / (T1 * T2)]])
        B = np.array([[1.0], [A[1, 1]]]) * (K * T3 / (T1 * T2)) + [[0.0], [K / (T1 * T2)]]
        form = PlantForm(A, B, _YAW_STATES)
    form = PlantForm(
        form.A, form.B, form.states, {"rudder": "rad"}, schedule=form.schedule,
        linearise=form.linearise,
    )  # fmt: skip
    return _with_heading(form) if has_heading else form


def surge(section: FileSection, folder: Path) -> PlantForm:
    """Build v' = (-v + K n) / T, n in rpm, or the identification paper's v' = f ω² + g v² + h n.

    From a vessel file it is linearised along the recorded speed and yaw rate.
    """
    states, inputs = {"speed": "m/s"}, {"rpm": "rpm"}
    if "vessel" not in section:
        T, K = section.number("T", positive=True), section.number("K")
        return PlantForm(np.array([[-1 / T]]), np.array([[K / T]]), states, inputs)
    c = _coefficients(section, folder)

    def linearise(_: FloatArray, at: FloatArray) -> Linearisation:
        v, w = at.tolist()
        return Linearisation(
            np.array([[2 * c.g * v]]), np.array([[c.h]]), np.array([c.f * w**2 - c.g * v**2])
        )

    schedule = {"speed": "m/s", "yaw_rate": "rad/s"}
    return _at_rest(linearise, states, schedule, inputs)


def _yaw_of_vessel(section: FileSection, folder: Path) -> PlantForm:
    """Build the yaw equation of the identification paper, linearised along a trajectory."""
    c = _coefficients(section, folder)

    def linearise(_: FloatArray, at: FloatArray) -> Linearisation:
        w, v, n = at.tolist()
        effect = c.alpha1 * v + c.alpha2 * n * float(np.exp(-c.alpha3 * v))
        stiffness = c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w**2
        rest = -c.b2 * w * abs(w) - 2 * c.b3 * w**3
        B = effect * np.array([[c.e], [c.d + c.a * c.e]])
        return Linearisation(np.array([[0.0, 1.0], [stiffness, c.a]]), B, np.array([0.0, rest]))

    schedule = {"yaw_rate": "rad/s", "speed": "m/s", "rpm": "rpm"}
    return _at_rest(linearise, _YAW_STATES, schedule, {"rudder": "rad"})


_YAW_STATES = {"yaw_rate": "rad/s", "yaw_acceleration_rest": "rad/s2"}


def _at_rest(
    linearise: Linearise,
    states: Mapping[str, str],
    schedule: Mapping[str, str],
    inputs: Mapping[str, str],
) -> PlantForm:
    """Return a scheduled plant whose A and B are those at rest."""
    at = linearise(np.zeros(len(states)), np.zeros(len(schedule)))
    return PlantForm(at.A, at.B, states, inputs, schedule=schedule, linearise=linearise)


def _with_heading(form: PlantForm) -> PlantForm:
    """Append the heading, the integral of the first state."""

    def extended(at: Linearisation) -> Linearisation:
        n = len(at.A)
        A = np.block([[at.A, np.zeros((n, 1))], [np.eye(1, n), np.zeros((1, 1))]])
        B = np.vstack((at.B, np.zeros((1, at.B.shape[1]))))
        return Linearisation(A, B, np.append(at.b, 0.0))

    start = extended(Linearisation(form.A, form.B, np.zeros(len(form.A))))
    inner = form.linearise

    def linearise(x: FloatArray, at: FloatArray) -> Linearisation:
        assert inner is not None  # noqa: S101 - it is used only where the plant has a schedule
        return extended(inner(x[:-1], at))

    states = {**form.states, "heading": "rad"}
    return PlantForm(
        start.A, start.B, states, form.inputs, schedule=form.schedule,
        linearise=linearise if inner else None,
    )  # fmt: skip


def _coefficients(section: FileSection, folder: Path) -> "Coefficients":
    """Load the coefficients of a vessel file or preset; relative to the folder of the file."""
    from shiplog.vessel.presets import PRESETS  # noqa: PLC0415 - only this form needs vessels
    from shiplog.vessel.vessel_parser import load_vessel  # noqa: PLC0415

    name = section.text("vessel")
    try:
        vessel, _ = load_vessel(name if name in PRESETS else folder / name)
        if vessel.coefficients is not None:
            return vessel.coefficients
        section.errors.append(f"{section.name('vessel')} = {name!r} has no [yaw] and [surge]")
    except VesselError as error:
        section.errors.append(f"{section.name('vessel')}: {error}")
    return load_vessel("table1")[0].paper_coefficients  # the file is refused; any will do


BUILT_IN: Mapping[str, Callable[[FileSection, Path], PlantForm]] = {
    "roll": roll,
    "yaw": yaw,
    "surge": surge,
    "rigid-body": rigid_body,
}

"""A plant as a system file gives it, before it is bound to channels."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from shiplog.types import FloatArray

from .system import Linearise


@dataclass(frozen=True, eq=False)
class PlantForm:
    """A plant as a section ``[plant]`` gives it, before it is bound to channels.

    Attributes
    ----------
    A, B
        (n, n) and (n, inputs).
    states, inputs
        Units by name.
    C, D
        (m, n) and (m, inputs); None where each output is the state of its name.
    G
        (n, q): where the process noise enters; None for the rates of all states.
    schedule
        Scheduling signals by name, with their units.
    linearise
        Function of the estimate and the scheduling signals.
    refused
        Names of the matrices that have errors, from which no further ones follow.
    """

    A: FloatArray
    B: FloatArray
    states: Mapping[str, str]
    inputs: Mapping[str, str] | None = None
    C: FloatArray | None = None
    D: FloatArray | None = None
    G: FloatArray | None = None
    schedule: Mapping[str, str] = field(default_factory=dict)
    linearise: Linearise | None = None
    refused: frozenset[str] = frozenset()

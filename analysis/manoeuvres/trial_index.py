"""An index of a sailed manoeuvre with its interval, the limit of the norm, and the verdict."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import pi

from shiplog.units import UNITS

DISPLAY = {
    "rad": ("°", 180 / pi),
    "rad/s": ("°/s", 180 / pi),
    "W": ("kW", 1e-3),
    "m/s": ("kn", 1 / UNITS["kn"][1]),
}


class Verdict(StrEnum):
    """Whether an index meets the limit of a norm.

    It is decided where the limit lies outside the index's 95 % interval.
    """

    MEETS = "meets"
    FAILS = "fails"
    UNDECIDED = "not decided by this trial"


@dataclass(frozen=True)
class Criterion:
    """The limit of a norm on one index.

    Attributes
    ----------
    name
        Such as ``advance``.
    limit
        The largest value permitted, in the unit of the index.
    text
        The limit as the norm gives it, such as ``4.5 L``.
    paragraph
        The norm and its paragraph, such as ``IMO MSC.137(76), 5.3.1``.
    """

    name: str
    limit: float
    text: str
    paragraph: str


@dataclass(frozen=True)
class TrialIndex:
    """An index of a sailed manoeuvre.

    Attributes
    ----------
    name
        Such as ``advance`` or ``overshoot 1``.
    symbol
        Such as ``Ad``; empty where the field has none.
    value
        In `unit`; the best estimate, with all corrections.
    unit
        The SI unit: m, s, rad, rad/s, m/s, W, or 1; rpm of revolutions.
    std
        Standard uncertainty, in `unit`; NaN where it cannot be estimated.
    low, high
        The 95 % interval.
    sources
        Standard uncertainty by its source, such as ``sensor noise``, ``heading bias``,
        ``position bias``, ``start rule``, ``current``, ``sampling``.
    start_rules
        The value by each of the other start rules that apply, by the rule's name.
    in_lengths
        The value in ship lengths; NaN where the index is no distance or the length is unknown.
    criterion
        The limit of the norm; None where there is none, or it cannot be computed.
    probability
        That the limit is met; NaN without a limit.
    note
        A definition or a restriction for the reader; empty where the name suffices.

    Examples
    --------
    >>> limit = Criterion("advance", 1440.0, "4.5 L", "IMO MSC.137(76), 5.3.1")
    >>> index = TrialIndex("advance", "Ad", 999.0, "m", 8.0, 983.3, 1014.7, criterion=limit,
    ...                    probability=1.0)
    >>> index.verdict
    <Verdict.MEETS: 'meets'>
    """

    name: str
    symbol: str
    value: float
    unit: str
    std: float
    low: float
    high: float
    sources: Mapping[str, float] = field(default_factory=dict)
    start_rules: Mapping[str, float] = field(default_factory=dict)
    in_lengths: float = float("nan")
    criterion: Criterion | None = None
    probability: float = float("nan")
    note: str = ""

    @property
    def verdict(self) -> Verdict | None:
        """The verdict; None without a limit."""
        if self.criterion is None:
            return None
        if self.high <= self.criterion.limit:
            return Verdict.MEETS
        return Verdict.FAILS if self.low > self.criterion.limit else Verdict.UNDECIDED

    @property
    def display_unit(self) -> str:
        """The unit in which people are shown the index."""
        return DISPLAY.get(self.unit, (self.unit, 1.0))[0]

    @property
    def display_factor(self) -> float:
        """The factor from `unit` to `display_unit`."""
        return DISPLAY.get(self.unit, (self.unit, 1.0))[1]

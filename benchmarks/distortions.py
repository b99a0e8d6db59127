"""The catalogue of distortions, and the cases of the matrix: singles and pairs."""

from dataclasses import dataclass
from itertools import combinations
from zlib import crc32

from .distorted_times import clock_distortions, sampling_distortions
from .distorted_values import (
    position_distortions,
    sentinel_distortions,
    sign_distortions,
    source_distortions,
    unit_distortions,
)
from .distortion import Distortion

CASES = 200


@dataclass(frozen=True)
class Case:
    """One or two distortions of the trial, in the order in which they are applied."""

    distortions: tuple[Distortion, ...]

    def __str__(self) -> str:
        return " + ".join(map(str, self.distortions))

    @property
    def family(self) -> str:
        """The family of a single distortion; "pair" of two."""
        return self.distortions[0].family if len(self.distortions) == 1 else "pair"


def distortions() -> tuple[Distortion, ...]:
    """Return all distortions, in the order in which they are applied to one log."""
    return (
        *unit_distortions(),
        *sign_distortions(),
        *sampling_distortions(),
        *sentinel_distortions(),
        *position_distortions(),
        *source_distortions(),
        *clock_distortions(),
    )


def cases(count: int = CASES) -> tuple[Case, ...]:
    """Return each distortion alone, and pairs to make up a number.

    The pairs are of different families and use all distortions about equally; they are the same in
    every run.

    Parameters
    ----------
    count
        The number of distorted cases.
    """
    singles = distortions()
    pairs = [pair for pair in combinations(singles, 2) if _can_be_combined(*pair)]
    pairs.sort(key=lambda pair: crc32(f"{pair[0]} {pair[1]}".encode()))
    uses = dict.fromkeys(map(str, singles), 0)
    chosen: dict[tuple[str, ...], Case] = {}
    most_uses = 0
    while len(chosen) < min(count - len(singles), len(pairs)):
        most_uses += 1
        for pair in pairs:
            names = tuple(map(str, pair))
            if names not in chosen and all(uses[name] < most_uses for name in names):
                chosen[names] = Case(pair)
                for name in names:
                    uses[name] += 1
    return (*(Case((single,)) for single in singles), *chosen.values())[:count]


def _can_be_combined(one: Distortion, other: Distortion) -> bool:
    """Whether two distortions are of different families and not both of the positions."""
    of_positions = [d.family == "position" or "position" in d.name for d in (one, other)]
    return one.family != other.family and not all(of_positions)

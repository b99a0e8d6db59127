"""The catalogue of distortions, and the cases of the matrix: singles and pairs."""

from dataclasses import dataclass
from itertools import combinations
from zlib import crc32

from .distorted_tables import table_distortions
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
IDENTIFIED = (  # one of each kind
    "unit: yaw_rate in deg/s read as rad/s",
    "unit: yaw_rate in deg/min read as deg/s",
    "unit: speed in kn read as m/s",
    "unit: rudder in rad read as deg",
    "unit: rpm in rev/s read as rpm",
    "sign: yaw_rate reversed",
    "sign: rudder reversed",
    "sign: heading reversed",
    "sign: heading clockwise from east",
    "sampling: rudder written on change",
    "sampling: rudder every 10 s",
    "sampling: rudder known in every fifteenth row",
    "sampling: yaw rate lost for 30 s",
    "sampling: speed in whole knots",
    "sentinel: heading 511 deg in every third sample",
    "sentinel: yaw_rate 67.1 rad/s at the end",
    "sentinel: speed 0 m/s in every third sample",
    "sentinel: rudder 9.99 rad once",
    "sentinel: yaw_rate stuck",
    "position: 91 and 181 for a while",
    "position: latitude and longitude exchanged",
    "source: slipping rudder first",
    "source: yaw rate to port first",
    "clock: clock set back by 5.25 s",
    "clock: clock of the rudder alone set back by 5 s",
    "clock: times in whole seconds",
    "clock: times in s read as ms",
    "clock: yaw_rate 3 s late",
    "clock: rudder 3 s late",
    "table: speed in kn read as m/s",
    "table: columns of rudder and yaw rate exchanged",
)
IDENTIFIED_PAIRS = (
    ("unit: speed in kn read as m/s", "sign: rudder reversed"),
    ("sign: heading reversed", "sentinel: rudder 9.99 rad once"),
    ("sampling: rudder written on change", "clock: clock set back by 5.25 s"),
    ("sentinel: speed 0 m/s in every third sample", "source: slipping rudder first"),
)


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
        *table_distortions(),
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


def identified_cases() -> tuple[Case, ...]:
    """Return the cases that are identified, too: distortions of each kind, and pairs of these."""
    by_name = {str(distortion): distortion for distortion in distortions()}
    singles = [Case((by_name[name],)) for name in IDENTIFIED]
    pairs = [Case((by_name[one], by_name[other])) for one, other in IDENTIFIED_PAIRS]
    return (*singles, *pairs)


def _can_be_combined(one: Distortion, other: Distortion) -> bool:
    """Whether two distortions are of different families, and neither makes the log a table.

    Two of the positions cannot be combined, either.
    """
    if "table" in (one.family, other.family):
        return False
    of_positions = [d.family == "position" or "position" in d.name for d in (one, other)]
    return one.family != other.family and not all(of_positions)

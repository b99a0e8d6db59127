"""Tables with one wrong bit each: `python -m benchmarks.flipped_bits`.

Single bits at random places of a table, from a fixed seed, are changed one after the other, and the
table is read back. Each must be refused, read with a warning, or give the same log; the exit code
is 1 where a changed log was read without a warning. The tests do the same with fewer.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np

from shiplog import TrialLog, read
from shiplog.errors import ShiplogError
from shiplog.tables.csv_form import read_csv, write_csv
from shiplog.tables.parquet_form import read_parquet, write_parquet

LOG = Path(__file__).parents[1] / "sample_data" / "zigzag_20_20.mcap"
FORMS = {"CSV": (write_csv, read_csv), "Parquet": (write_parquet, read_parquet)}
OUTCOMES = ("refused", "warning", "same log", "wrong without a warning")


def count_outcomes(log: TrialLog, form: str, flips: int) -> Counter[str]:
    """Read a table of a log with one wrong bit, many times, and count what becomes of it.

    Parameters
    ----------
    log
        The log.
    form
        One of `FORMS`.
    flips
        The number of tables with one wrong bit.

    Returns
    -------
    counts
        The number of tables by outcome, of `OUTCOMES`.
    """
    write, read_back = FORMS[form]
    counts: Counter[str] = Counter()
    random = Random(15)  # noqa: S311 - no cryptography
    with TemporaryDirectory() as folder:
        path = Path(folder) / "table"
        write(log, path)
        data = path.read_bytes()
        for _ in range(flips):
            changed = bytearray(data)
            changed[random.randrange(len(data))] ^= 1 << random.randrange(8)
            path.write_bytes(changed)
            counts[_outcome(log, path, read_back)] += 1
    return counts


def _outcome(log: TrialLog, path: Path, read_back: Callable[[Path], TrialLog]) -> str:
    try:
        back = read_back(path)
    except ShiplogError:
        return "refused"
    if back.warnings:
        return "warning"
    return "same log" if _is_same(log, back) else "wrong without a warning"


def _is_same(log: TrialLog, other: TrialLog) -> bool:
    """Whether two logs have the same channels, samples and texts."""
    texts = [
        [(dict(c.metadata), c.key, c.unit) for c in each] + [dict(each.metadata), each.vessel_toml]
        for each in (log, other)
    ]
    return (
        texts[0] == texts[1]
        and log.events == other.events
        and all(
            np.array_equal(getattr(a, name), getattr(b, name), equal_nan=name == "values")
            for a, b in zip(log, other, strict=True)
            for name in ("measured_ns", "received_ns", "values")
        )
    )


def main() -> int:
    """Print a row of counts for each form of a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flipped_bits")
    parser.add_argument("--flips", type=int, default=3000, help="tables of each form")
    flips = parser.parse_args().flips
    log = read(LOG).between(0, 20)
    print(f"| of {flips} bits | {' | '.join(OUTCOMES)} |\n|---|---|---|---|---|")
    wrong = 0
    for form in FORMS:
        counts = count_outcomes(log, form, flips)
        print(f"| {form} | {' | '.join(str(counts[outcome]) for outcome in OUTCOMES)} |")
        wrong += counts[OUTCOMES[-1]]
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

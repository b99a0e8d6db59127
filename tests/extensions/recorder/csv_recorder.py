"""A recorder of CSV files with the columns time_s, yaw_rate_deg_s and speed_kn."""

import argparse
import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from math import radians
from pathlib import Path

import numpy as np

from recorders.source import RecorderCommand
from shiplog import Channel, LogError

CHUNK_ROWS = 100
KNOT = 1852 / 3600  # m/s
COLUMNS = {  # channel: column, SI unit, factor to it
    "yaw_rate": ("yaw_rate_deg_s", "rad/s", radians(1)),
    "speed": ("speed_kn", "m/s", KNOT),
}


@dataclass(frozen=True)
class CsvSource:
    """A source that yields the rows of a CSV file."""

    path: Path
    vessel_toml: str | None = None

    @property
    def metadata(self) -> Mapping[str, str]:
        return {"source": "csv", "file": self.path.name}

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        with self.path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            while rows := list(islice(reader, CHUNK_ROWS)):
                yield self._channels(rows)

    def _channels(self, rows: Sequence[Mapping[str, str]]) -> tuple[Channel, ...]:
        try:
            times = np.array([round(float(row["time_s"]) * 1e9) for row in rows])
            return tuple(
                Channel(
                    name=name,
                    source="csv",
                    unit=unit,
                    measured_ns=times,
                    received_ns=times,
                    values=np.array([float(row[column]) * factor for row in rows]),
                )
                for name, (column, unit, factor) in COLUMNS.items()
            )
        except (KeyError, ValueError) as error:
            raise LogError(f"a column or number is missing ({error}): {self.path}") from error


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="CSV", type=Path)


def _open(arguments: argparse.Namespace) -> CsvSource:
    if not arguments.file.is_file():
        raise LogError(f"no such file: {arguments.file}")
    return CsvSource(arguments.file)


CSV = RecorderCommand("a CSV file of yaw rate and speed", _configure, _open)

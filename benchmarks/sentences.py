"""NMEA 0183 from a file to a log, beside the parsers: `python -m benchmarks.sentences [FILE]`.

Sentences a second of processor time, the best of several rounds: of marlin, pynmea2 and pynmeagps,
which parse lines that were read before, and of shiplog's whole way from the file to the MCAP log,
which marlin is a part of. Without a file, the sample recording is repeated.
"""

import argparse
import gc
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import marlin.envelope
import pynmea2
import pynmeagps

from recorders.nmea0183.sentence_stream import NMEA0183
from recorders.record import record
from recorders.streams.line_files import read_lines
from recorders.streams.stream_source import StreamSource
from shiplog.cli.main import RARE_COLLECTION

SAMPLE = Path(__file__).parents[1] / "sample_data" / "ship.nmea"
ROUNDS = 5
REPEATS = 15  # of the sample: some 100,000 sentences
MAX_PARSED = 20_000  # by the parsers


def main() -> int:
    """Measure, and print the rates."""
    gc.set_threshold(RARE_COLLECTION)  # as the command `shiplog` does
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path)
    path = parser.parse_args().file
    with tempfile.TemporaryDirectory(prefix="shiplog-benchmarks-") as folder:
        if path is None:
            path = Path(folder) / "sentences.nmea"
            plain = [line.partition(b" ")[2] for line in SAMPLE.read_bytes().splitlines(True)]
            path.write_bytes(b"".join(plain) * REPEATS)
        lines = path.read_text(encoding="latin-1").splitlines()
        parsed = lines[:MAX_PARSED]
        log = Path(folder) / "sentences.mcap"
        rates = {
            "marlin, parsing only": _rate(len(parsed), lambda: _parse_by_marlin(parsed)),
            "pynmea2, parsing only": _rate(len(parsed), lambda: _parse_by_pynmea2(parsed)),
            "pynmeagps, parsing only": _rate(len(parsed), lambda: _parse_by_pynmeagps(parsed)),
            "shiplog, file to log": _rate(len(lines), lambda: _record(path, log)),
        }
    for name, rate in rates.items():
        print(f"{rate:9,.0f} /s  {name}")
    return 0


def _rate(sentences: int, work: Callable[[], None]) -> float:
    """Return sentences a second of processor time."""
    best = float("inf")
    for _ in range(ROUNDS):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return sentences / best


def _parse_by_marlin(lines: list[str]) -> None:
    for line in lines:
        try:
            sentence = marlin.envelope.parse(line.encode("latin-1"))
        except marlin.envelope.EnvelopeError:  # no sentence, or a wrong checksum
            continue
        _ = sentence.talker, sentence.sentence_type, sentence.fields  # made when they are read


def _parse_by_pynmea2(lines: list[str]) -> None:
    for line in lines:
        try:
            pynmea2.parse(line)
        except ValueError:  # kinds that it does not know
            continue


def _parse_by_pynmeagps(lines: list[str]) -> None:
    for line in lines:
        try:
            pynmeagps.NMEAReader.parse(f"{line}\r\n")
        except pynmeagps.NMEAParseError:
            continue


def _record(path: Path, log: Path) -> None:
    options = argparse.ArgumentParser()
    NMEA0183.configure(options)
    opened = NMEA0183.open_file(read_lines(str(path)), options.parse_args([]))
    record(StreamSource("sentences", "nmea0183", opened.batches, opened.decoder), log)


if __name__ == "__main__":
    sys.exit(main())

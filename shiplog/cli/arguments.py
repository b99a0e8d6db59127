"""The command line's grammar: verbs, options, and what their texts mean."""

import argparse
import re
import tomllib
from collections.abc import Sequence
from math import radians
from pathlib import Path
from typing import Any

from shiplog.errors import UsageError
from shiplog.version import __version__
from shiplog.vessel.settings import DISTURBANCES, FILTERS

# of `shiplog.ships`, which brings numba, and --help waits for nobody
SHIP_MODELS = (
    "nomoto", "norrbin", "burylin", "burylin-tied", "slipstream", "drift-lag", "three-dof"
)  # fmt: skip


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command; `verb` names what is to be run, if anything is."""
    parser = argparse.ArgumentParser(
        prog="shiplog", description="Record, convert, replay and check sea trials."
    )
    parser.add_argument("--version", action="version", version=f"shiplog {__version__}")
    verbs = parser.add_subparsers(metavar="VERB")
    _add_record(verbs)
    _add_info(verbs)
    _add_replay(verbs)
    _add_identify(verbs)
    _add_check(verbs)
    _add_convert(verbs)
    return parser


def _add_record(verbs: Any) -> None:  # noqa: ANN401 - argparse keeps that type to itself
    said = "write sensor streams to a log"
    record = verbs.add_parser("record", help=said, description=said.capitalize() + ".")
    sources = record.add_subparsers(metavar="SOURCE", required=True)
    simulate = sources.add_parser(
        "simulate",
        help="a simulated trial",
        description="Sail a manoeuvre with a model ship and record what its sensors say.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="""manoeuvres:
  turning-circle[-ANGLE][-port] (35 degrees)  zigzag-RUDDER-HEADING[-port]
  pull-out[-ANGLE] (20)
  spiral  pseudo-random  paper
sensors, each setting in SI:
  --sensor yaw_rate.bias=1e-4 --sensor speed.rate_hz=2 --sensor rudder.dropout=0.02
  --sensor yaw_rate.spikes=0.001 --sensor yaw_rate.spike_size=0.05
  --sensor sway.white=0.05 measures the sway as well, which a model may have
  rate_hz, jitter_secs, delay_secs, white, uniform, uniform_relative, wave, wave_tau_secs,
  bias, spikes (share of samples off), spike_size (by so much), dropout (share of samples lost),
  dropout_secs""",
    )
    simulate.add_argument("manoeuvre", metavar="MANOEUVRE", help="such as zigzag-20-20")
    simulate.add_argument(
        "--vessel", default="table1", help="a preset (table1, table1-rad) or a vessel.toml"
    )
    simulate.add_argument("--seed", type=int, default=0, help="the same seed, the same samples")
    simulate.add_argument(
        "--duration", type=float, default=600.0, metavar="S", help="in seconds (default: 600)"
    )
    simulate.add_argument(
        "--noise", default="paper", help="of the sensors: none, white, paper (default)"
    )
    simulate.add_argument(
        "--sensor", action="append", default=[], metavar="CHANNEL.SETTING=VALUE", help="see below"
    )
    simulate.add_argument(
        "--gust",
        action="append",
        default=[],
        metavar="DEG@START[+LENGTH]",
        help="a yaw moment worth DEG of rudder at the approach speed (to port: --gust=-2@100)",
    )
    simulate.add_argument(
        "--wave", metavar="DEG@PERIOD", help="a sinusoidal yaw moment worth DEG of rudder"
    )
    simulate.add_argument(
        "--random-forcing",
        metavar="DEG[,MM]",
        help="a white yaw moment and surge force: the standard deviations of their means over a "
        "second, in degrees of rudder at the approach speed and in mm/s²",
    )
    simulate.add_argument(
        "--truth", metavar="FILE", help="write what really happened there, at 10 Hz"
    )
    simulate.add_argument("-o", "--output", required=True, metavar="FILE", help="the log")
    simulate.set_defaults(verb="simulate")


def _add_info(verbs: Any) -> None:  # noqa: ANN401
    said = "what is in a log, without reading it all"
    info = verbs.add_parser("info", help=said, description=f"Show {said}.")
    info.add_argument("log", metavar="LOG")
    info.add_argument("--json", metavar="FILE", help="as JSON, - for stdout")
    info.set_defaults(verb="info")


def _add_replay(verbs: Any) -> None:  # noqa: ANN401
    replay = verbs.add_parser(
        "replay",
        help="filter, observe, identify; a Rerun review and a summary",
        description="Replay a log through the filter, the observer and the identifier.",
    )
    replay.add_argument("log", metavar="LOG")
    replay.add_argument("--vessel", help="a preset or a vessel.toml, instead of the log's own")
    replay.add_argument(
        "--source",
        action="append",
        default=[],
        metavar="CHANNEL=SOURCE",
        help="which of several sources of a channel to use",
    )
    replay.add_argument(
        "--filter", choices=FILTERS, help="of the states (default: the vessel file's, pseudo-input)"
    )
    replay.add_argument("--smooth", action="store_true", help="the states, from the end back too")
    replay.add_argument(
        "--wave",
        action="store_true",
        help="tell waves in the yaw rate from the ship's own turning (filter: extended by default)",
    )
    replay.add_argument(
        "--disturbance",
        metavar="MODELS",
        help=f"what to observe, some of {','.join(DISTURBANCES)} (default: constant)",
    )
    replay.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="any setting of the vessel file's [filter], [disturbance] and [identifier], such as "
        "filter.gate=4, identifier.window_secs=300 or filter.process_ratio=auto, which leaves it "
        "to the log",
    )
    replay.add_argument(
        "-o", "--output", metavar="FILE", help="the review (default: LOG's name with .rrd, here)"
    )
    replay.add_argument(
        "--full", action="store_true", help="every sample in the review, not what a screen can show"
    )
    replay.add_argument("--json", metavar="FILE", help="the summary as JSON, - for stdout")
    replay.add_argument("--view", action="store_true", help="open the review in the Rerun viewer")
    replay.set_defaults(verb="replay")


def _add_identify(verbs: Any) -> None:  # noqa: ANN401
    identify = verbs.add_parser(
        "identify",
        help="a ship's model from her logs, its uncertainty, and a proof on other logs",
        description="Fit a ship model to logs, all at once, and try it on logs it has not seen.",
    )
    identify.add_argument("log", metavar="LOG", nargs="+", help="of one ship, loaded alike")
    identify.add_argument(
        "--model",
        metavar="NAME",
        help=f"{', '.join(SHIP_MODELS)}, or auto: the one that predicts best "
        "(default: burylin; burylin-tied where T3 is known)",
    )
    identify.add_argument(
        "--validate",
        nargs="+",
        action="extend",
        default=[],
        metavar="LOG",
        help="logs to predict, not to fit",
    )
    identify.add_argument(
        "--known",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter that is not to be sought, such as T3=0.5",
    )
    identify.add_argument(
        "--vessel",
        help="a preset or a vessel.toml: length, α's and steering gear, instead of the logs' own",
    )
    identify.add_argument(
        "-o", "--output", metavar="FILE", help="the vessel.toml, to simulate and to replay with"
    )
    identify.add_argument(
        "--review",
        metavar="FILE",
        help="an .rrd for Rerun: measured against simulated, residuals, how coefficients settled",
    )
    identify.add_argument(
        "--view", action="store_true", help="open the review, else identified.rrd, in Rerun"
    )
    identify.add_argument("--json", metavar="FILE", help="the result as JSON, - for stdout")
    identify.set_defaults(verb="identify")


def _add_check(verbs: Any) -> None:  # noqa: ANN401
    check = verbs.add_parser(
        "check",
        help="compare replays with their references",
        description="Replay a log, or the logs of a folder, and compare with NAME.ref.mcap; "
        "what differs is drawn in NAME.check.rrd, here.",
    )
    check.add_argument("path", metavar="PATH", type=Path)
    check.add_argument(
        "--update", action="store_true", help="after looking: make the replays the references"
    )
    check.add_argument("--json", metavar="FILE", help="the comparison as JSON, - for stdout")
    check.set_defaults(verb="check")


def _add_convert(verbs: Any) -> None:  # noqa: ANN401
    convert = verbs.add_parser(
        "convert",
        help="a table to a log, a log to a table",
        description="By the endings: .mcap, .csv, .parquet are ours; other tables need a layout.",
    )
    convert.add_argument("source", metavar="FROM", type=Path)
    convert.add_argument("target", metavar="TO", type=Path)
    convert.add_argument("--layout", type=Path, help="what the table's columns mean (TOML)")
    convert.set_defaults(verb="convert")


def settings(texts: Sequence[str]) -> dict[str, float]:
    """`yaw_rate.bias=1e-4` as a name and a number."""
    settings = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            settings[name] = float(value)
        except ValueError:
            raise UsageError(
                f"--sensor wants CHANNEL.SETTING=VALUE, such as yaw_rate.bias=1e-4, got {text!r}"
            ) from None
    return settings


def known(texts: Sequence[str]) -> dict[str, float]:
    """`T3=0.5` as a name and a number."""
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name] = float(value)
        except ValueError:
            raise UsageError(f"--known wants NAME=VALUE, such as T3=0.5, got {text!r}") from None
    return found


def sources(texts: Sequence[str]) -> dict[str, str]:
    """`speed=doppler` as a name and a source."""
    for text in texts:
        if not re.fullmatch(r"[^=]+=[^=]+", text):
            raise UsageError(f"--source wants CHANNEL=SOURCE, such as speed=doppler, got {text!r}")
    return dict(text.split("=") for text in texts)


def replay_settings(parsed: argparse.Namespace) -> dict[str, object]:
    """The settings of filter and disturbances that the command line gives, by their names."""
    found: dict[str, object] = {}
    for text in parsed.set:
        name, equals, value = text.partition("=")
        try:
            found[name] = tomllib.loads(f"value = {value}")["value"] if equals else None
        except tomllib.TOMLDecodeError:
            found[name] = value  # a word needs no quotes here
        if not (name and value):
            raise UsageError(f"--set wants KEY=VALUE, such as filter.gate=4, got {text!r}")
    if parsed.filter:
        found["filter.kind"] = parsed.filter
    if parsed.disturbance is not None:
        found["disturbance.models"] = [model.strip() for model in parsed.disturbance.split(",")]
    flags = {"filter.smooth": parsed.smooth, "filter.wave": parsed.wave}
    return found | {name: True for name, given in flags.items() if given}


_NUMBER = r"([-+]?\d*\.?\d+(?:e[-+]?\d+)?)"


def gust(text: str) -> tuple[float, ...]:
    """`2@200+60` as the rudder in rad, the start and, if given, the length in s."""
    match = re.fullmatch(rf"{_NUMBER}@{_NUMBER}(?:\+{_NUMBER})?", text)
    if not match:
        raise UsageError(f"--gust wants DEG@START[+LENGTH], such as 2@200+60, got {text!r}")
    angle, *times = (float(number) for number in match.groups() if number is not None)
    return (radians(angle), *times)


def wave(text: str) -> tuple[float, float]:
    """`0.5@8` as the rudder in rad and the period in s."""
    match = re.fullmatch(rf"{_NUMBER}@{_NUMBER}", text)
    if not match or float(match[2]) <= 0:
        raise UsageError(f"--wave wants DEG@PERIOD, such as 0.5@8, got {text!r}")
    return radians(float(match[1])), float(match[2])


def random_forcing(text: str) -> tuple[float, float]:
    """`0.2,5` as the rudder in rad and the force in m/s²; without one the force is 0."""
    match = re.fullmatch(rf"{_NUMBER}(?:,{_NUMBER})?", text)
    if not match:
        raise UsageError(f"--random-forcing wants DEG[,MM], such as 0.2,5, got {text!r}")
    return radians(float(match[1])), float(match[2] or 0) / 1000

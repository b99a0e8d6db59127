"""The source `simulate` of the verb `record`: its options and what they mean."""

import argparse
import re
from math import radians
from typing import TYPE_CHECKING

from recorders.source import RecorderCommand
from shiplog.cli.console import progress
from shiplog.cli.options import NUMBER, assigned_numbers
from shiplog.cli.paths import require_distinct, require_outputs, require_suffix
from shiplog.errors import UsageError

if TYPE_CHECKING:
    from .simulate import SimulatedTrial

EPILOG = """examples:
  shiplog record simulate zigzag-20-20 --seed 1 -o trial.mcap
  shiplog record simulate zigzag-20-20 --gust 2@200 --noise white -o gust.mcap
manoeuvres:
  turning-circle[-ANGLE][-port] (35 degrees)  zigzag-RUDDER-HEADING[-port]
  pull-out[-ANGLE] (20)
  spiral  pseudo-random  paper
sensors, each setting in SI:
  --sensor yaw_rate.bias=1e-4 --sensor speed.rate_hz=2 --sensor rudder.dropout=0.02
  --sensor yaw_rate.spikes=0.001 --sensor yaw_rate.spike_size=0.05
  --sensor sway.white=0.05 measures the sway as well, which a model may have
  rate_hz, jitter_secs, delay_secs, white, uniform, uniform_relative, wave, wave_tau_secs,
  bias, spikes (share of samples), spike_size, dropout (share of samples lost), dropout_secs"""


def _configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of a simulated trial."""
    parser.description = "Simulate a manoeuvre of a ship and record what its sensors measure."
    parser.epilog = EPILOG
    parser.add_argument("manoeuvre", metavar="MANOEUVRE", help="such as zigzag-20-20")
    parser.add_argument(
        "--vessel", default="table1", help="a preset (table1, table1-rad) or a vessel.toml"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of the random numbers; the same seed repeats a trial"
    )
    parser.add_argument(
        "--duration", type=float, default=600.0, metavar="S", help="in seconds (default: 600)"
    )
    parser.add_argument(
        "--noise", default="paper", help="of the sensors: none, white, paper (default)"
    )
    parser.add_argument(
        "--sensor", action="append", default=[], metavar="CHANNEL.SETTING=VALUE", help="see below"
    )
    parser.add_argument(
        "--gust",
        action="append",
        default=[],
        metavar="DEG@START[+LENGTH]",
        help="a yaw moment worth DEG of rudder at the approach speed (to port: --gust=-2@100)",
    )
    parser.add_argument(
        "--wave", metavar="DEG@PERIOD", help="a sinusoidal yaw moment worth DEG of rudder"
    )
    parser.add_argument(
        "--random-forcing",
        metavar="DEG[,MM]",
        help="a white yaw moment and surge force: the standard deviations of their means over a "
        "second, in degrees of rudder at the approach speed and in mm/s²",
    )
    parser.add_argument(
        "--truth", metavar="FILE", help="write the true motion and disturbances there, at 10 Hz"
    )


def _open(arguments: argparse.Namespace) -> "SimulatedTrial":
    """Simulate the trial; its files are checked before."""
    require_outputs(arguments.truth)
    require_distinct([arguments.output, arguments.truth], [arguments.vessel])
    require_suffix(".mcap", arguments.truth)
    from shiplog.vessel.vessel_parser import load_vessel

    from .sensors import suite
    from .simulate import simulate
    from .trajectory import Gust, RandomForcing, WaveMoment

    vessel, text = load_vessel(arguments.vessel)
    wave, forcing = arguments.wave, arguments.random_forcing
    sensor_settings = assigned_numbers(arguments.sensor, "--sensor", "yaw_rate.bias=1e-4")
    with progress("recorders") as on_progress:
        on_progress("simulate")
        return simulate(
            vessel,
            arguments.manoeuvre,
            duration_secs=arguments.duration,
            seed=arguments.seed,
            sensors=suite(arguments.noise, sensor_settings, angle_unit=vessel.angle_unit),
            gusts=tuple(Gust(*_gust(each)) for each in arguments.gust),
            wave=WaveMoment(*_wave(wave)) if wave else None,
            random_forcing=None if forcing is None else RandomForcing(*_random_forcing(forcing)),
            vessel_toml=text,
        )


def _write_truth(arguments: argparse.Namespace, trial: "SimulatedTrial") -> None:
    """Write the true motion where ``--truth`` asks for it."""
    from shiplog.mcap.writer import write

    if arguments.truth:
        write(trial.truth(), arguments.truth)


def _gust(text: str) -> tuple[float, ...]:
    """Parse `2@200+60`: the rudder in rad, the start and, where given, the length in s."""
    match = re.fullmatch(rf"{NUMBER}@{NUMBER}(?:\+{NUMBER})?", text)
    if not match:
        raise UsageError(f"--gust takes DEG@START[+LENGTH], such as 2@200+60, not {text!r}")
    angle, *times = (float(number) for number in match.groups() if number is not None)
    return (radians(angle), *times)


def _wave(text: str) -> tuple[float, float]:
    """Parse `0.5@8`: the rudder in rad and the period in s."""
    match = re.fullmatch(rf"{NUMBER}@{NUMBER}", text)
    if not match or float(match[2]) <= 0:
        raise UsageError(f"--wave takes DEG@PERIOD, such as 0.5@8, not {text!r}")
    return radians(float(match[1])), float(match[2])


def _random_forcing(text: str) -> tuple[float, float]:
    """Parse `0.2,5`: the rudder in rad and the force in m/s², 0 where none is given."""
    match = re.fullmatch(rf"{NUMBER}(?:,{NUMBER})?", text)
    if not match:
        raise UsageError(f"--random-forcing takes DEG[,MM], such as 0.2,5, not {text!r}")
    return radians(float(match[1])), float(match[2] or 0) / 1000


SIMULATE = RecorderCommand("a simulated trial", _configure, _open, _write_truth)

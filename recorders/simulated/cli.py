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

EPILOG = """manoeuvres, all angles in degrees; -port begins to port instead of to starboard:
  turning-circle[-ANGLE][-port]  rudder put over and held; ANGLE is 35 by default
  zigzag-RUDDER-HEADING[-port]   rudder reversed at HEADING to either side of the approach
  pull-out[-ANGLE][-port]        rudder over, amidships, over to the other side; ANGLE is 20
  spiral[-port]                  rudder in steps from 15 on one side to 15 on the other and back
  pseudo-random                  random steps of rudder and revolutions
  paper                          the identification paper's run: from slow speed two circles
settings of the sensors yaw_rate, speed, rudder, rpm, heading, position and sway, in SI:
  rate_hz, jitter_secs           sampling rate, standard deviation of the sampling instants
  delay_secs                     longest delay from measurement to reception
  white, uniform                 standard deviation or half width of white noise
  uniform_relative               half width of white noise as a fraction of the value
  wave, wave_tau_secs            amplitude and tau of a slow error sin(t / tau)
  bias                           constant error
  spikes, spike_size             fraction of samples with a spike, its size
  dropout, dropout_secs          fraction of samples lost, length of one loss
  sway is measured only where a setting of it is given; in a wind also apparent_wind_speed and
  apparent_wind_angle, and, where a setting is given, wind_speed, wind_direction, true_wind_angle
examples:
  shiplog record simulate zigzag-20-20 --seed 1 -o trial.mcap
  shiplog record simulate zigzag-20-20 --gust 2@200 --noise white -o gust.mcap
  shiplog record simulate turning-circle --wind 12,45 -o wind.mcap
  shiplog record simulate spiral --sensor yaw_rate.bias=1e-4 --sensor sway.white=0.05 -o s.mcap"""


def _configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of a simulated trial."""
    parser.description = "Simulate a manoeuvre of a ship and record what its sensors measure."
    parser.epilog = EPILOG
    parser.add_argument("manoeuvre", metavar="MANOEUVRE", help="such as zigzag-20-20; see below")
    parser.add_argument(
        "--vessel",
        default="table1",
        help="the ship: a preset (table1, table1-rad) or a vessel file (default: table1)",
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="a number; the same seed repeats a trial (default: 0)"
    )
    parser.add_argument(
        "--duration",
        type=float,
        default=600.0,
        metavar="S",
        help="length in seconds (default: 600)",
    )
    parser.add_argument(
        "--noise", default="paper", help="of the sensors: none, white or paper (default: paper)"
    )
    parser.add_argument(
        "--sensor", action="append", default=[], metavar="SENSOR.SETTING=VALUE", help="see below"
    )
    parser.add_argument(
        "--gust",
        action="append",
        default=[],
        metavar="DEG@START[+LENGTH]",
        help="a yaw moment as large as that of DEG degrees of rudder at the approach speed, from "
        "START seconds on, for LENGTH seconds or to the end (to port: --gust=-2@100)",
    )
    parser.add_argument(
        "--wave",
        metavar="DEG@PERIOD",
        help="a sinusoidal yaw moment with an amplitude of DEG degrees of rudder and a period in "
        "seconds",
    )
    parser.add_argument(
        "--random-forcing",
        metavar="DEG[,MM]",
        help="a yaw moment and a surge force of white noise: standard deviations of their means "
        "over one second, in degrees of rudder at the approach speed and in mm/s²",
    )
    parser.add_argument(
        "--wind",
        metavar="SPEED,FROM",
        help="a steady wind of SPEED m/s from FROM degrees, 0 from north and 90 from east, which "
        "turns and brakes the ship, and which an anemometer on board measures",
    )
    parser.add_argument(
        "--truth", metavar="FILE", help="another log, of the true motion and disturbances at 10 Hz"
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
    from .wind import APPARENT_WIND, Wind

    vessel, text = load_vessel(arguments.vessel)
    wave, forcing = arguments.wave, arguments.random_forcing
    wind = None if arguments.wind is None else Wind(*_wind(arguments.wind))
    sensor_settings = assigned_numbers(arguments.sensor, "--sensor", "yaw_rate.bias=1e-4")
    with progress("recorders") as on_progress:
        on_progress("simulate")
        return simulate(
            vessel,
            arguments.manoeuvre,
            duration_secs=arguments.duration,
            seed=arguments.seed,
            sensors=suite(
                arguments.noise,
                sensor_settings,
                angle_unit=vessel.angle_unit,
                also=APPARENT_WIND if wind else (),
            ),
            gusts=tuple(Gust(*_gust(each)) for each in arguments.gust),
            wave=WaveMoment(*_wave(wave)) if wave else None,
            random_forcing=None if forcing is None else RandomForcing(*_random_forcing(forcing)),
            wind=wind,
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


def _wind(text: str) -> tuple[float, float]:
    """Parse `12,45`: the speed in m/s and where the wind blows from, in rad."""
    match = re.fullmatch(rf"{NUMBER},{NUMBER}", text)
    if not match:
        raise UsageError(f"--wind takes SPEED,FROM in m/s and degrees, such as 12,45, not {text!r}")
    return float(match[1]), radians(float(match[2]))


SIMULATE = RecorderCommand("a simulated trial", _configure, _open, _write_truth)

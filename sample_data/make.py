"""Make the sample data: `python sample_data/make.py`.

The files stay the same to the last bit unless the simulation changes. After a change that is meant,
look at the replays, then run `shiplog check sample_data --update`.
"""

from datetime import UTC, datetime
from math import cos, radians
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from recorders.record import record
from recorders.simulated.printed_sentences import RATES, printed_sentences
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from shiplog import load_vessel, read, write
from shiplog.vessel.presets import PRESETS

HERE = Path(__file__).parent
TRUTH_HZ = 2.0

# name: manoeuvre, duration in s, seed, changed settings of the sensors
SAMPLES = {
    "turning_circle_35": ("turning-circle", 500.0, 1, {}),
    "zigzag_20_20": ("zigzag-20-20", 600.0, 2, {}),
    "zigzag_10_10_dropouts": (
        "zigzag-10-10",
        600.0,
        3,
        {
            "yaw_rate.bias": radians(0.02),
            "yaw_rate.jitter_secs": 0.01,
            "yaw_rate.dropout": 0.08,
            "yaw_rate.dropout_secs": 8.0,
            "speed.rate_hz": 2.0,
            "speed.dropout": 0.1,
            "speed.dropout_secs": 20.0,
            "rudder.dropout": 0.02,
        },
    ),
    "pseudo_random": ("pseudo-random", 600.0, 4, {}),
}


def main() -> None:
    """Write every sample with its true motion, and the presets as vessel files."""
    vessel, text = load_vessel("table1")
    for name, (manoeuvre, duration_secs, seed, settings) in SAMPLES.items():
        trial = simulate(
            vessel,
            manoeuvre,
            duration_secs=duration_secs,
            seed=seed,
            sensors=suite("paper", settings),
            vessel_toml=text,
        )
        record(trial, HERE / f"{name}.mcap")
        write(trial.truth(TRUTH_HZ), HERE / f"{name}.truth.mcap")
        print(name)
    write_bridge_table(HERE / "bridge.csv")
    write_sentences(HERE / "ship.nmea")
    for preset, vessel_text in PRESETS.items():
        (HERE / "vessels" / f"{preset}.toml").write_text(vessel_text, encoding="utf-8")


def write_sentences(path: Path) -> None:
    """Write a simulated zig-zag as a logger on board does: each sentence after its time."""
    lines = (
        f"{datetime.fromtimestamp(ns // 10**9, UTC):%Y-%m-%dT%H:%M:%S}.{ns // 10**6 % 1000:03d}Z"
        f" {sentence}\r\n"
        for ns, sentence in printed_sentences(ship_trial())
    )
    path.write_text("".join(lines), encoding="ascii", newline="")


def ship_trial() -> SimulatedTrial:
    """Return the trial of ``ship.nmea``."""
    settings = {f"{name}.rate_hz": rate for name, rate in RATES.items()}
    settings |= {"yaw_rate.white": radians(0.005), "heading.white": radians(0.05)}
    return simulate(
        load_vessel("table1")[0],
        "zigzag-20-20",
        duration_secs=500.0,
        seed=6,
        sensors=suite("paper", settings),
    )


def write_bridge_table(path: Path) -> None:
    """Write a simulated zig-zag as a bridge's data logger prints it, at 2 Hz."""
    vessel, _ = load_vessel("table1")
    trial = simulate(vessel, "zigzag-20-20", duration_secs=600.0, seed=5)
    with TemporaryDirectory() as folder:
        record(trial, Path(folder) / "bridge.mcap")
        frame = read(Path(folder) / "bridge.mcap").to_pandas(0.5, display_units=True)
    frame = frame.interpolate(limit_direction="both")
    frame["heading [deg]"] += np.random.default_rng(5).normal(0, 0.1, len(frame))  # of the compass
    lines = ["Date,Time,HDT [deg],ROT [deg/min],STW [kn],Rudder [deg],RPM,Lat,Lon"]
    for instant, row in frame.iterrows():
        north, east = row["position_north [m]"], row["position_east [m]"]
        latitude = 59.5 + north / 111_412
        longitude = 24.25 + east / (111_412 * cos(radians(59.5)))
        cells = (
            f"{instant:%d.%m.%Y}",
            f"{instant:%H:%M:%S}.{instant.microsecond // 100_000}",
            f"{row['heading [deg]'] % 360:.1f}",
            f"{row['yaw_rate [deg/s]'] * 60:.1f}",
            f"{row['speed [kn]']:.2f}",
            f"{row['rudder [deg]']:.1f}",
            f"{row['rpm [rpm]']:.1f}",
            f"{_degrees_minutes(latitude, 2)}N",
            f"{_degrees_minutes(longitude, 3)}E",
        )
        lines.append(",".join(cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _degrees_minutes(angle_deg: float, digits: int) -> str:
    """Return an angle as ddmm.mmmm, with `digits` digits of degrees."""
    degrees, minutes = divmod(round(angle_deg * 60, 4), 60)
    return f"{int(degrees):0{digits}d}{minutes:07.4f}"


if __name__ == "__main__":
    main()

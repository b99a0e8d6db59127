"""Make the sample data: `python sample_data/make.py`.

The files stay the same to the last bit unless the simulation changes. After a change that is meant,
look at the replays, then run `shiplog check sample_data --update`.
"""

from math import radians
from pathlib import Path

from recorders.record import record
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import load_vessel, write
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
    for preset, vessel_text in PRESETS.items():
        (HERE / "vessels" / f"{preset}.toml").write_text(vessel_text, encoding="utf-8")


if __name__ == "__main__":
    main()

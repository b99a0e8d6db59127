"""The check of the gyro against the heading, on simulated and on real trials."""

from dataclasses import replace

import numpy as np
import pytest
from places import KVLCC2
from tanker_logs import tanker_log
from trial_logs import as_log

from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, Vessel
from shiplog.checks.consistency.consistency_check import consistency_findings


def simulated_log(vessel: Vessel, seed: int = 0, **settings: float) -> TrialLog:
    noisy = {"heading.white": np.radians(0.2)} | {
        name.replace("__", "."): value for name, value in settings.items()
    }
    sensors = suite("paper", noisy)
    return as_log(simulate(vessel, "zigzag-20-20", duration_secs=500.0, seed=seed, sensors=sensors))


def gyro_bias_warning(log: TrialLog) -> str | None:
    """Return the text of the finding about the bias."""
    texts = [finding.text for finding in consistency_findings(log) if finding.kind == "bias"]
    return texts[0] if texts else None


@pytest.mark.parametrize("bias_deg", [-0.02, 0.01])
def test_the_bias_of_a_gyro_is_estimated(vessel: Vessel, bias_deg: float) -> None:
    warning = gyro_bias_warning(simulated_log(vessel, yaw_rate__bias=np.radians(bias_deg)))
    assert warning is not None
    assert float(warning.split("bias of ")[1].split()[0]) == pytest.approx(bias_deg, abs=0.001)


@pytest.mark.parametrize("seed", range(20))
def test_an_unbiased_gyro_gives_no_warning(vessel: Vessel, seed: int) -> None:
    assert gyro_bias_warning(simulated_log(vessel, seed)) is None


def test_dropouts_are_not_mistaken_for_a_bias(vessel: Vessel) -> None:
    for seed in range(5):
        gaps = {"yaw_rate__dropout": 0.05, "yaw_rate__dropout_secs": 10.0}
        assert gyro_bias_warning(simulated_log(vessel, seed, **gaps)) is None


def test_without_a_heading_there_is_no_warning(vessel: Vessel) -> None:
    log = simulated_log(vessel, yaw_rate__bias=1.0)
    assert gyro_bias_warning(replace(log, channels=log.channels[:4])) is None


@pytest.mark.skipif(not KVLCC2.is_dir(), reason="the SIMMAN data are not in ../shared/data/kvlcc2")
def test_the_gyros_of_hsva_agree_with_their_headings() -> None:
    """HSVA's headings have many digits; those of MARIN are themselves rebuilt from the yaw rate."""
    for run in sorted((KVLCC2 / "hsva").glob("*.dat")):
        warning = gyro_bias_warning(tanker_log(run))
        assert warning is None or abs(float(warning.split("bias of ")[1].split()[0])) < 0.01

import numpy as np
import pytest
from gaussian import draws, held
from linear_logs import DT, log_of

from analysis.design.shaping import shaped_variance
from analysis.linear.estimate import estimate
from analysis.linear.spectra import SPECTRA
from analysis.linear.system_file import parse_system
from shiplog import LogError, UsageError
from shiplog.types import FloatArray

TIME, STD = 4.0, 0.02
SEA = """
[plant]
model = "roll"
inertia = 1
damping = 0.1
stiffness = 0.5
[outputs.roll]
std = 1e-3
[[coloured]]
name = "sea"
spectrum = "first-order"
std = 0.1
time = 1.0
on_state = { roll_rate = 1.0 }
fit = ["std", "time"]
"""


def rolling(count: int, seed: int) -> FloatArray:
    """Roll angle, (n,), under an exponentially correlated specific moment."""
    rng = np.random.default_rng(seed)
    A = np.array([[-0.1, -0.5, 1.0], [1, 0, 0], [0, 0, -1 / TIME]])
    F, Q = held(A, np.diag([0, 0, 2 * STD**2 / TIME]), DT)
    states, x = np.empty((count, 3)), np.zeros(3)
    for k, w in enumerate(draws(rng, Q, count)):
        states[k] = x
        x = F @ x + w
    return np.asarray(states[:, 1] + 1e-3 * rng.standard_normal(count))


def test_parameters_of_a_spectrum_are_within_their_standard_errors() -> None:
    found = estimate(log_of(roll=rolling(4000, 1)), parse_system(SEA, "sea.toml"))
    fitted = {each.name: each for each in found.findings.plan.fitted}
    for name, true in (("std", STD), ("time", TIME)):
        assert abs(fitted[name].value - true) < 3 * fitted[name].std
        assert fitted[name].std < 0.4 * true
    assert found.findings.residuals[0].consistent
    assert found.findings.residuals[0].white


def test_a_log_without_the_noise_does_not_determine_its_spectrum() -> None:
    still = log_of(roll=1e-3 * np.random.default_rng(0).standard_normal(400))
    with pytest.raises(LogError, match="the log does not determine 'std' of 'sea'"):
        estimate(still, parse_system(SEA, "sea.toml"))


def test_length_and_speed_together_are_not_determined() -> None:
    text = SEA.replace("first-order", "dryden").replace("time = 1.0", "length = 4\nspeed = 1")
    text = text.replace('["std", "time"]', '["length", "speed"]')
    with pytest.raises(LogError, match="does not determine 'length' of 'sea' and 'speed' of 'sea'"):
        estimate(log_of(roll=rolling(600, 2)), parse_system(text, "sea.toml"))


def test_spectra_of_a_varying_plant_are_not_fitted() -> None:
    text = """
    [plant]
    model = "surge"
    vessel = "table1"
    [outputs.speed]
    [[coloured]]
    name = "gust"
    spectrum = "first-order"
    std = 1
    time = 1
    on_state = { speed = 1 }
    fit = ["std"]
    """
    log = log_of(speed=5 + 0.1 * rolling(300, 0), yaw_rate=np.zeros(300))
    with pytest.raises(UsageError, match="spectra are fitted for a constant plant"):
        estimate(log, parse_system(text, "surge.toml"))


@pytest.mark.parametrize("name", SPECTRA)
def test_every_spectrum_has_the_stated_standard_deviation(name: str) -> None:
    scales = {"length": 50.0, "speed": 8.0, "time": 3.0, "frequency": 0.7, "damping": 0.2}
    given = {key: scales.get(key, 2.5) for key in SPECTRA[name].parameters}
    assert shaped_variance(SPECTRA[name].make(**given)) == pytest.approx(2.5**2)

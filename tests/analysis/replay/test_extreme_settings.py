"""Settings with extreme values: an error that names the setting, or a finite result."""

from dataclasses import fields
from functools import cache
from math import inf, nan

import numpy as np
import pytest
from filter_runs import FILTERS
from trial_logs import as_log

from analysis.disturbance import observer
from analysis.filters.base import WAVE_SETTINGS
from analysis.filters.factory import filter_kind
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, load_vessel
from shiplog.errors import UsageError
from shiplog.vessel.settings import DisturbanceSettings, FilterSettings, IdentifierSettings

SECTIONS = {
    "filter": FilterSettings, "disturbance": DisturbanceSettings, "identifier": IdentifierSettings,
}  # fmt: skip
NUMBERS = {
    f"{section}.{field.name}": field.metadata
    for section, settings in SECTIONS.items()
    for field in fields(settings)
    if field.metadata["kind"] is float
}
OTHERS = [
    f"{section}.{field.name}"
    for section, settings in SECTIONS.items()
    for field in fields(settings)
    if field.metadata["kind"] is not float
]


@cache
def short_log(rate_hz: float = 1.0, secs: float = 90.0) -> TrialLog:
    rates = {f"{name}.rate_hz": rate_hz for name in ("yaw_rate", "speed", "rudder", "rpm")}
    vessel, toml = load_vessel("table1")
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=secs, seed=1, sensors=suite("paper", rates),
        vessel_toml=toml,
    )  # fmt: skip
    return as_log(trial)


def require_named_or_finite(log: TrialLog, settings: dict[str, object], key: str) -> None:
    """Replay a log with settings; a `UsageError` must name the key, a result must be finite."""
    found, message = None, ""
    try:
        found = analyse(log, settings=settings)
    except UsageError as error:
        message = str(error)
    assert is_finite(found) if found else key in message, message
    assert "\n" not in message


def is_finite(found: Analysis) -> bool:
    series = (found.estimates.states, found.estimates.stds, found.disturbance.yaw,
              found.disturbance.surge)  # fmt: skip
    return all(np.isfinite(each).all() for each in series)


def with_its_effect(key: str, value: object) -> dict[str, object]:
    """Return a setting, with the others without which it has no effect."""
    section, _, name = key.partition(".")
    settings: dict[str, object] = {}
    if section == "filter":
        kinds = [kind for kind in FILTERS if name in filter_kind(kind).settings]
        settings["filter.kind"] = kinds[0] if kinds else "extended"
        if name in WAVE_SETTINGS:
            settings |= {"filter.kind": "extended", "filter.wave": True}
    if key == "disturbance.wave_frequency":
        settings["disturbance.models"] = ["constant", "wave"]
    return settings | {key: value}


@pytest.mark.parametrize("key", NUMBERS)
@pytest.mark.parametrize("value", [-1.0, nan, inf, -inf, 1e300])
def test_a_number_out_of_range_is_refused_by_its_name(key: str, value: float) -> None:
    with pytest.raises(UsageError, match=key):
        analyse(short_log(), settings=with_its_effect(key, value))


@pytest.mark.parametrize("key", NUMBERS)
def test_zero_is_refused_by_the_name_of_the_setting_or_means_none(key: str) -> None:
    require_named_or_finite(short_log(), with_its_effect(key, 0.0), key)


@pytest.mark.parametrize("end", ["least", "most"])
@pytest.mark.parametrize("key", NUMBERS)
def test_a_number_at_the_end_of_its_range_is_named_or_gives_a_finite_result(
    key: str, end: str
) -> None:
    value = NUMBERS[key][end]
    if np.isfinite(value):
        require_named_or_finite(short_log(), with_its_effect(key, value), key)


@pytest.mark.parametrize("key", OTHERS)
@pytest.mark.parametrize("value", ["", "nothing", [], ["nothing"], 1, nan])
def test_what_is_no_choice_is_refused_by_the_name_of_the_setting(key: str, value: object) -> None:
    with pytest.raises(UsageError, match=key):
        analyse(short_log(), settings={key: value})


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ("extended", "filter.yaw_bandwidth", 40.0),
        ("steady-state", "filter.yaw_bandwidth", 40.0),
        ("quality", "filter.shift", 100.0),
        ("per-tick", "filter.yaw_decay", 40.0),
        ("per-tick", "filter.speed_std", 1e-4),
        ("pseudo-input", "filter.yaw_rate_std", 1.0),
    ],
)
@pytest.mark.parametrize("rate_hz", [10.0, 0.1])
def test_a_setting_that_no_filter_complies_with_is_named(
    kind: str, key: str, value: float, rate_hz: float
) -> None:
    log = short_log(rate_hz, 600.0 if rate_hz < 1 else 60.0)
    require_named_or_finite(log, {"filter.kind": kind, key: value}, key)


@pytest.mark.parametrize("models", [["constant"], ["ramp"]])
def test_a_setting_at_which_the_observer_diverges_is_named(models: list[str]) -> None:
    settings = {"disturbance.models": models, "disturbance.yaw_frequency": 0.001}
    with pytest.raises(UsageError, match=r"^disturbance\.yaw_frequency = 0\.001 makes the dist"):
        analyse(short_log(0.1, 600.0), settings=settings)


def test_an_observer_that_diverges_with_any_setting_leaves_the_other_results(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(observer, "MAX_DISTURBANCE", 0.0)
    found = analyse(short_log(), settings={"disturbance.yaw_frequency": 0.02})
    assert np.isnan(found.disturbance.yaw).all()
    assert np.isfinite(found.estimates.states).all()


def test_a_wave_in_samples_too_slow_for_it_is_named() -> None:
    settings = {"disturbance.models": ["wave"], "filter.wave": True}
    require_named_or_finite(short_log(0.1, 600.0), settings, "wave_frequency")

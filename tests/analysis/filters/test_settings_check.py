"""Replay settings that a filter cannot comply with, or that have no effect."""

import pytest
from filter_runs import FILTERS, SMOOTHABLE

from analysis.filters.factory import filter_kind, filter_names
from analysis.filters.settings_check import (
    check_filter_settings,
    unused_setting_warnings,
    unused_settings,
)
from shiplog import Vessel
from shiplog.errors import UsageError
from shiplog.vessel.settings import FilterSettings
from shiplog.vessel.vessel import with_settings


def test_every_filter_is_found_by_its_name() -> None:
    assert set(filter_names()) >= set(FILTERS)
    assert [filter_kind(name).name for name in FILTERS] == list(FILTERS)
    assert [name for name in FILTERS if filter_kind(name).smoothable] == list(SMOOTHABLE)
    assert [name for name in FILTERS if not filter_kind(name).models_wave] == ["pseudo-input"]


def test_an_unknown_filter_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match="no filter 'extend'; did you mean 'extended'"):
        filter_kind("extend")


def test_every_setting_of_a_filter_is_a_key_of_its_section() -> None:
    for name in FILTERS:
        assert all(hasattr(FilterSettings(), key) for key in filter_kind(name).settings)


def test_a_wave_needs_a_filter_that_can_model_it() -> None:
    with pytest.raises(UsageError, match=r"^filter.wave needs .* 'pseudo-input' .*'extended'$"):
        check_filter_settings(filter_kind("pseudo-input"), FilterSettings(wave=True))
    check_filter_settings(filter_kind("extended"), FilterSettings(wave=True))


@pytest.mark.parametrize("kind", [kind for kind in FILTERS if kind not in SMOOTHABLE])
def test_a_filter_without_optimal_gain_cannot_be_smoothed(kind: str) -> None:
    with pytest.raises(UsageError, match=f"^filter.smooth .*{kind}.* 'extended' or 'pseudo-input'"):
        check_filter_settings(filter_kind(kind), FilterSettings(kind=kind, smooth=True))


@pytest.mark.parametrize(
    ("settings", "names"),
    [
        ({"filter.shift": 0.2}, ["filter.shift"]),
        ({"filter.kind": "quality", "filter.shift": 0.2}, []),
        ({"filter.kind": "extended", "filter.as_printed": True}, ["filter.as_printed"]),
        ({"filter.yaw_bandwidth": 0.1}, ["filter.yaw_bandwidth"]),
        ({"filter.wave_std": 1e-3}, ["filter.wave_std"]),
        ({"filter.wave": True, "filter.wave_std": 1e-3}, []),
        ({"disturbance.wave_frequency": 0.6}, ["disturbance.wave_frequency"]),
        ({"disturbance.models": ["wave"], "disturbance.wave_frequency": 0.6}, []),
        ({"disturbance.models": ["wave"], "filter.wave_frequency": 0.6}, []),
    ],
)
def test_a_setting_without_effect_gives_a_warning(
    vessel: Vessel, settings: dict[str, object], names: list[str]
) -> None:
    changed = with_settings(vessel, settings)
    kind = filter_kind(changed.filter.chosen)
    assert unused_settings(kind, changed.filter, changed.disturbance) == names
    warnings = unused_setting_warnings(kind, changed.filter, changed.disturbance)
    assert all(name in warnings[0] for name in names)
    assert bool(warnings) == bool(names)

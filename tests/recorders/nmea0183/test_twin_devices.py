"""Tests of recorders.nmea0183.twin_devices."""

from collections.abc import Iterable

import numpy as np
import pytest

from recorders.nmea0183.twin_devices import TwinDevices


def _findings(values: Iterable[float], channel: str = "heading") -> list[str]:
    twins = TwinDevices()
    for value in values:
        twins.add(channel, "HC", value)
    return list(twins.findings())


def test_two_compasses_that_alternate_are_found_across_north() -> None:
    rng = np.random.default_rng(1)
    values = np.radians(np.where(np.arange(200) % 2, 359.2, 0.7) + rng.normal(0, 0.05, 200))
    [finding] = _findings(values.tolist())
    assert finding.startswith("heading of HC alternates by 1.5 deg: two devices send it under one")


@pytest.mark.parametrize(
    "values",
    [
        np.radians(np.linspace(0, 720, 500) % 360),  # a turn
        np.random.default_rng(2).normal(0, 0.01, 500),  # noise
        np.round(np.sin(np.linspace(0, 30, 500)), 1),  # coarse
        np.zeros(500),
        np.where(np.arange(40) % 2, 0.0, 1.0),  # too few
    ],
)
def test_a_single_device_is_not_found(values: np.ndarray) -> None:
    assert _findings(values.tolist()) == []


def test_numbers_too_large_to_subtract_raise_no_warning() -> None:
    values = [1.7e308, -1.7e308] * 30
    assert _findings(values, "heading") == []
    [finding] = _findings(values, "rpm")
    assert finding.startswith("rpm of HC alternates")

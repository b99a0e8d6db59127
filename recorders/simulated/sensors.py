"""Simulated sensors: sampling rate, jitter, noise, bias, spikes, dropouts and delay."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import UsageError
from shiplog.types import FloatArray
from shiplog.units import did_you_mean

from .wind import WIND_SENSORS

DEG = pi / 180


@dataclass(frozen=True)
class Sensor:
    """One sensor and its errors, in the SI unit of its channel; the errors add up.

    Attributes
    ----------
    rate_hz
        The sampling rate.
    jitter_secs
        The standard deviation of the instant of measurement.
    delay_secs
        The longest delay from measurement to reception.
    white
        The standard deviation of Gaussian white noise.
    uniform, uniform_relative
        The half width of uniform white noise, absolute and as a fraction of the value.
    wave, wave_tau_secs
        The amplitude of a slow error sin(t / tau), and tau.
    bias
        A constant error.
    spikes, spike_size
        The fraction of samples with a spike, and its size, of either sign.
    dropout, dropout_secs
        The fraction of samples lost, and the length of one loss; 0 loses single samples.
    """

    rate_hz: float = 10.0
    jitter_secs: float = 0.0
    delay_secs: float = 0.005
    white: float = 0.0
    uniform: float = 0.0
    uniform_relative: float = 0.0
    wave: float = 0.0
    wave_tau_secs: float = 10.0
    bias: float = 0.0
    spikes: float = 0.0
    spike_size: float = 0.0
    dropout: float = 0.0
    dropout_secs: float = 0.0


Suite = Mapping[str, Sensor]

_NAVIGATION = {"heading": Sensor(rate_hz=2.0), "position": Sensor(rate_hz=1.0)}
_PERFECT = {
    "yaw_rate": Sensor(),
    "speed": Sensor(),
    "rudder": Sensor(),
    "rpm": Sensor(),
    **_NAVIGATION,
}
# present only where a setting or the trial asks for it
_ON_REQUEST = {"sway": Sensor(), **dict.fromkeys(WIND_SENSORS, Sensor(rate_hz=1.0))}
_ANEMOMETER = {
    name: Sensor(rate_hz=1.0, white=0.3 if name.endswith("speed") else 2 * DEG)
    for name in WIND_SENSORS
}
SUITES = ("none", "white", "paper")


def suite(
    name: str,
    settings: Mapping[str, float] | None = None,
    *,
    angle_unit: str = "deg",
    also: tuple[str, ...] = (),
) -> Suite:
    """Make a set of sensors.

    Parameters
    ----------
    name
        ``none`` for perfect sensors, ``white`` for white noise of yaw rate and speed, or ``paper``
        for the noise of the identification paper: w (1 + 0.02 nu) + 5e-5 sin(t/10) and
        v + 0.2 nu + 0.05 sin(t/10), with nu uniform on [-1, 1].
    settings
        Changed settings, such as ``{"yaw_rate.bias": 1e-4}``. A setting of ``sway`` or of the wind
        adds a sensor of it.
    angle_unit
        The unit of the paper's yaw rate, ``deg`` or ``rad``: its table can be read in either.
    also
        Further sensors, of ``sway`` or of the wind; with noise, an anemometer errs by 0.3 m/s and
        2 degrees.

    Returns
    -------
    dict of Sensor
        The sensors by channel.

    Raises
    ------
    UsageError
        The name, a sensor or a setting is unknown, or a value is out of range.

    Examples
    --------
    >>> suite("white", {"speed.rate_hz": 2.0})["speed"].rate_hz
    2.0
    """
    if name not in SUITES:
        raise UsageError(
            f"unknown noise {name!r}{did_you_mean(name, SUITES)}; known are {', '.join(SUITES)}"
        )
    sensors = dict(_PERFECT)
    if name == "white":
        sensors |= {"yaw_rate": Sensor(white=0.005 * DEG), "speed": Sensor(white=0.1)}
    elif name == "paper":
        wave = 5e-5 * (DEG if angle_unit == "deg" else 1.0)
        sensors |= {
            "yaw_rate": Sensor(uniform_relative=0.02, wave=wave),
            "speed": Sensor(uniform=0.2, wave=0.05),
        }
    on_request = _ON_REQUEST if name == "none" else _ON_REQUEST | _ANEMOMETER
    sensors |= {channel: on_request[channel] for channel in also}
    for key, value in (settings or {}).items():
        channel, _, setting = key.partition(".")
        if channel in on_request:
            sensors.setdefault(channel, on_request[channel])
        _check_known(channel, setting, sensors)
        sensors[channel] = replace(sensors[channel], **{setting: value})
        _check_range(channel, sensors[channel])
    _check_spikes(sensors)
    return sensors


def _check_known(channel: str, setting: str, sensors: Suite) -> None:
    known = sorted(field.name for field in fields(Sensor))
    if channel not in sensors:
        raise UsageError(
            f"no sensor {channel!r}{did_you_mean(channel, sensors)}; "
            f"the sensors are {', '.join(sensors)}"
        )
    if setting not in known:
        raise UsageError(
            f"a sensor has no {setting!r}{did_you_mean(setting, known)}; it has {', '.join(known)}"
        )


def _check_range(channel: str, sensor: Sensor) -> None:
    for field in fields(Sensor):
        value = getattr(sensor, field.name)
        if not np.isfinite(value) or (field.name != "bias" and value < 0):
            raise UsageError(f"{channel}.{field.name} must be finite and not negative, got {value}")
    if sensor.rate_hz == 0 or sensor.wave_tau_secs == 0:
        raise UsageError(f"{channel}.rate_hz and {channel}.wave_tau_secs must be positive")
    if sensor.dropout >= 1:
        raise UsageError(f"{channel}.dropout is a fraction, below 1; got {sensor.dropout}")
    if sensor.spikes > 1:
        raise UsageError(f"{channel}.spikes is a fraction, at most 1; got {sensor.spikes}")


def _check_spikes(sensors: Suite) -> None:
    for channel, sensor in sensors.items():
        if sensor.spikes and not sensor.spike_size:
            raise UsageError(f"{channel}.spikes have no size; give {channel}.spike_size as well")


def sample_times(sensor: Sensor, duration_secs: float, rng: np.random.Generator) -> FloatArray:
    """Draw the instants of measurement, (n,) s, in whole microseconds, without lost samples.

    Examples
    --------
    >>> sample_times(Sensor(rate_hz=2.0), 1.5, np.random.default_rng(0)).tolist()
    [0.0, 0.5, 1.0, 1.5]
    """
    count = int(np.floor(duration_secs * sensor.rate_hz + 1e-9)) + 1
    times = np.arange(count) / sensor.rate_hz
    if sensor.jitter_secs:
        times = np.sort(np.abs(times + sensor.jitter_secs * rng.standard_normal(count)))
    times = np.unique(np.round(np.minimum(times, duration_secs), 6))
    return times[~_lost(sensor, times, rng)]


def _lost(sensor: Sensor, times: FloatArray, rng: np.random.Generator) -> NDArray[np.bool_]:
    if not sensor.dropout:
        return np.zeros(len(times), bool)
    run = max(1, round(sensor.dropout_secs * sensor.rate_hz))
    starts = rng.random(len(times)) < 1 - (1 - sensor.dropout) ** (1 / run)
    lost = np.convolve(starts, np.ones(run))[: len(times)] > 0
    lost[[0, -1]] = False
    return lost


def corrupt(
    sensor: Sensor, times: FloatArray, truth: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Add the sensor's errors to the true values.

    Parameters
    ----------
    sensor
        The sensor.
    times
        (n,) the instants of measurement, s.
    truth
        (n,) or (n, k) the true values at these times, SI.
    rng
        Draws the noise.

    Returns
    -------
    (n,) or (n, k) array
        The measured values, SI.
    """
    shape = truth.shape
    wave = sensor.wave * np.sin(times / sensor.wave_tau_secs)
    measured: FloatArray = (
        truth * (1 + sensor.uniform_relative * rng.uniform(-1, 1, shape))
        + sensor.white * rng.standard_normal(shape)
        + sensor.uniform * rng.uniform(-1, 1, shape)
        + wave.reshape(-1, *([1] * (truth.ndim - 1)))
        + sensor.bias
    )
    return measured + _spikes(sensor, shape, rng) if sensor.spikes else measured


def _spikes(sensor: Sensor, shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    """Draw the spikes, shaped as the samples; a spike has all components of its sample."""
    own = rng.spawn(1)[0]  # so that the other noise is the same with and without spikes
    hit = own.random((shape[0], *[1] * (len(shape) - 1))) < sensor.spikes
    return sensor.spike_size * np.where(hit, own.choice((-1.0, 1.0), shape), 0.0)


def delays(sensor: Sensor, count: int, rng: np.random.Generator) -> FloatArray:
    """Draw the delays from measurement to reception, (n,) s, in whole microseconds."""
    return np.round(sensor.delay_secs * rng.uniform(0.2, 1.0, count), 6)

"""The signals of a log as the analysis of manoeuvres takes them, and what the log states."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.manoeuvres.trial_signals import TrialSignals, noise_std, printed_step
from analysis.replay.position_fixes import PositionFixes
from analysis.replay.reading_options import ReadingOptions
from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.errors import LogError
from shiplog.progress import ProgressCallback
from shiplog.resampling import Clock, resample_chunks, with_steering_gear
from shiplog.screening import ScreenedLog, screen_values, screen_without_delays
from shiplog.types import Channel, FloatArray, Log, Signals, concatenate_signals
from shiplog.vessel.vessel import Vessel, with_length
from shiplog.vessel.vessel_parser import parse_vessel

STEERING = ("rudder", "rudder_order", "heading", "yaw_rate")
MOTION = ("speed", "sway", "rpm", "power")
WIND = ("wind_speed", "wind_direction")
MIN_STEP_SECS, MAX_STEP_SECS = 0.1, 1.0
MAX_SAMPLES = 250_000  # of the clock: a longer log has a coarser one
MAX_INTERVAL_RATIO = 1.2  # of the longest interval of a regularly sampled channel
MAX_NOISE_SAMPLES = 100_000  # of a channel, from which its noise is estimated


@dataclass(frozen=True, eq=False)
class TrialRecord:
    """What a log holds of a trial.

    Attributes
    ----------
    name
        Name of the log.
    start_ns
        The first instant, ns since 1970-01-01 UTC.
    signals
        On a uniform clock.
    latitude
        Of the first fix, rad; 0 where the log has none or only local positions.
    wind_speed, wind_direction
        Means of the true wind, m/s and rad; NaN where not measured.
    vessel
        The vessel given or attached, with the length given; None where there is neither.
    metadata
        What the log states.
    warnings
        Problems of the data.
    """

    name: str
    start_ns: int
    signals: TrialSignals
    latitude: float
    wind_speed: float
    wind_direction: float
    vessel: Vessel | None
    metadata: Mapping[str, str]
    warnings: tuple[str, ...]


def read_trial(log: Log, options: ReadingOptions, on_progress: ProgressCallback) -> TrialRecord:
    """Read what the analysis of manoeuvres needs from a log, whatever the log lacks.

    Parameters
    ----------
    log
        The log, in memory or in its file.
    options
        Vessel, length, sources and delays of sensors.
    on_progress
        Called with the step and its share done.

    Raises
    ------
    LogError
        The log has neither rudder, heading, yaw rate nor speed over time.
    """
    on_progress("check the log", 0.0)
    names = (*STEERING, *MOTION, *WIND, "position")

    def screen(recorded: Log) -> ScreenedLog:
        return screen_values(recorded, names, sources=options.sources)

    screened = screen_without_delays(log, options.sensor_delays, screen)
    stats = screened.screening.stats
    vessel = with_length(options.vessel or attached_vessel(log), options.length)
    clock = trial_clock(stats, log.name, vessel)
    values, fixes, noise, heading_step = _read(screened, clock, stats, on_progress)
    count = len(values)
    absent = np.full(count, np.nan)
    north_east = fixes.at_samples([values])[0]
    used = {name: values.values.get(name, absent) for name in (*STEERING, *MOTION)}
    events = tuple(
        ((event.time_ns - clock.start_ns) * 1e-9, event.text)
        for event in log.events
        if event.source == "operator"
    )
    intervals = {
        name: stats[name].interval_secs
        for name in (*used, "position")
        if name in stats and not _as_sampled(stats[name]).hold
    }
    return TrialRecord(
        name=log.name,
        start_ns=clock.start_ns,
        signals=TrialSignals(
            clock.dt_secs,
            positions=np.full((count, 2), np.nan) if north_east is None else north_east,
            intervals=intervals,
            noise=noise,
            heading_step=heading_step,
            events=events,
            **used,
        ),
        latitude=fixes.latitude(),
        wind_speed=_mean(values, "wind_speed"),
        wind_direction=_mean_direction(values),
        vessel=vessel,
        metadata=dict(log.metadata),
        warnings=screened.warnings,
    )


def attached_vessel(log: Log) -> Vessel | None:
    """Return the vessel that a log carries; None where it carries none."""
    if log.vessel_toml is None:
        return None
    return parse_vessel(log.vessel_toml, f"vessel.toml in {log.name}")


def trial_clock(stats: LogStats, name: str, vessel: Vessel | None) -> Clock:
    """Return a clock over all that a log has of steering and motion.

    Parameters
    ----------
    stats
        The statistics of its channels, one source of each quantity.
    name
        Of the log, for messages.
    vessel
        Its steering gear turns a rudder whose orders are known; None is the usual gear.

    Raises
    ------
    LogError
        The log has neither rudder, heading, yaw rate nor speed over time.
    """
    used = {
        channel: _as_sampled(stats[channel])
        for channel in (*STEERING, *MOTION, *WIND)
        if channel in stats
        and not stats[channel].fields
        and (stats[channel].valid > 1 or stats[channel].hold)
    }
    sampled = [each for key, each in used.items() if key not in WIND and not each.hold]
    spans = [each.valid_span_ns for key, each in used.items() if key not in WIND]
    if not spans:
        raise LogError(
            f"neither rudder, heading, yaw rate nor speed over time: no manoeuvre can be found; "
            f"choose another log: {name}"
        )
    start, end = min(first for first, _ in spans), max(last for _, last in spans)
    duration = (end - start) * 1e-9
    step = min((each.interval_secs for each in sampled), default=MAX_STEP_SECS)
    dt = max(float(np.clip(step, MIN_STEP_SECS, MAX_STEP_SECS)), duration / MAX_SAMPLES)
    clock = Clock(start, dt, int(duration / dt + 1e-6) + 1, used)
    return with_steering_gear(clock, (vessel or Vessel("", None)).rudder_rate)


def _as_sampled(channel: ChannelStats) -> ChannelStats:
    """Return a rudder that is recorded at one interval as sampled, however few samples there are.

    The few samples of a trial at 20 s may look like steps that were written on change.
    """
    hold = channel.hold
    if channel.name != "rudder" or hold is None or hold.stated:
        return channel
    is_regular = hold.longest_secs < MAX_INTERVAL_RATIO * channel.interval_secs
    return replace(channel, hold=None) if is_regular else channel


def _read(
    log: ScreenedLog, clock: Clock, stats: LogStats, on_progress: ProgressCallback
) -> tuple[Signals, PositionFixes, dict[str, float], float]:
    """Resample the scalar channels; return them, the fixes, noise, and the heading's step."""
    fixes = PositionFixes(stats.get("position"))
    raw: dict[str, list[FloatArray]] = {name: [] for name in clock.channels}

    def chunks() -> "list[tuple[Channel, ...]]":
        parts = []
        for chunk in log.chunks():
            fixes.add(chunk)
            for name, kept in raw.items():
                part = clock.channels[name].select(chunk)
                if part is not None and sum(map(len, kept)) < MAX_NOISE_SAMPLES:
                    kept.append(part.values[np.isfinite(part.values)])
            parts.append(chunk)
        return parts

    on_progress("read the log", 0.0)
    parts = []
    for signals in resample_chunks(chunks(), clock):
        parts.append(signals)
        on_progress("read the log", (signals.first + len(signals)) / clock.count)
    samples = {name: np.concatenate(kept) for name, kept in raw.items() if kept}
    if "heading" in samples:
        samples["heading"] = np.unwrap(samples["heading"])
    noise = {name: noise_std(each) for name, each in samples.items()}
    _, north_east = fixes.north_east()
    if len(north_east):
        noise["position"] = max(noise_std(column) for column in north_east.T)
    heading_step = printed_step(samples.get("heading", np.empty(0)))
    return concatenate_signals(parts), fixes, noise, heading_step


def _mean(values: Signals, name: str) -> float:
    known = values[name][np.isfinite(values[name])] if name in values else np.empty(0)
    return float(np.mean(known)) if len(known) else np.nan


def _mean_direction(values: Signals) -> float:
    if "wind_direction" not in values:
        return np.nan
    known = values["wind_direction"][np.isfinite(values["wind_direction"])]
    return float(np.angle(np.mean(np.exp(1j * known)))) % (2 * np.pi) if len(known) else np.nan

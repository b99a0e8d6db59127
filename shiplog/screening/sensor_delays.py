"""Delays of sensors as stated, or as estimated from the lags between the channels of a log."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

from shiplog.checks.consistency.consistency_check import ConsistencyCheck
from shiplog.checks.consistency.lags import Lag
from shiplog.errors import LogError, UsageError
from shiplog.types import Log
from shiplog.units import did_you_mean

from .delayed_log import DelayedLog, SensorDelay
from .screened_log import ScreenedLog

AUTO: Literal["auto"] = "auto"
StatedDelays = Mapping[str, float] | Literal["auto"]  # s, by the name of a quantity

MAX_DELAY_SECS = 60.0
MAX_ERROR_SECS = 0.5  # of an estimate that is used
MIN_ERRORS = 3.0  # standard errors from which a delay is significant
MAX_ESTIMATES = 4  # each from the times corrected so far: the equations are linear in a small lag
MAX_STEP_ERRORS = 0.1  # standard errors by which the last estimate may change the delay
PAIRS = {
    ("heading", "yaw_rate"): "needs a yaw rate and a heading that turn alike",
    ("speed", "position"): "needs fixes, a heading, and turns to both sides",
}


def screen_without_delays(
    log: Log, delays: StatedDelays, screen: Callable[[Log], ScreenedLog]
) -> ScreenedLog:
    """Correct the times of late channels, and screen the log.

    Of two channels that measure one motion, the later one is delayed by their lag at the least:
    its times are corrected.

    Parameters
    ----------
    log
        The log as recorded.
    delays
        The delays, s, by the name of a quantity, or ``"auto"``: estimated are those of heading
        against yaw rate and of speed against position.
    screen
        Screens a log, as `screen_log` does.

    Raises
    ------
    UsageError
        A delay is not between 0 and `MAX_DELAY_SECS`.
    LogError
        The log lacks a channel whose delay is stated, or shows no delay.

    Examples
    --------
    >>> import shiplog
    >>> from shiplog.screening import screen_log
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
    >>> screened = screen_without_delays(
    ...     log, {"speed": 0.4}, lambda log: screen_log(log, ("speed",), purpose="a replay")
    ... )
    >>> screened.warnings
    ('speed: its times are 0.4 s earlier than recorded, as stated',)
    """
    if not delays:
        return screen(log)
    found, warnings = _estimated(log, screen) if delays == AUTO else (_stated(delays), [])
    screened = screen(DelayedLog(log, found))
    _require_channels(screened, found)
    texts = (*(each.warning for each in found), *warnings, *screened.screening.warnings)
    return ScreenedLog(log, replace(screened.screening, delays=found, warnings=texts))


def _stated(delays: Mapping[str, float]) -> tuple[SensorDelay, ...]:
    for name, secs in delays.items():
        if not 0 < secs <= MAX_DELAY_SECS:
            raise UsageError(
                f"the delay of a sensor is more than 0 and at most {MAX_DELAY_SECS:g} s, got "
                f"{secs:g} s of {name!r}; a sensor is never early: give the delay of the others"
            )
    return tuple(SensorDelay(name, secs) for name, secs in delays.items())


def _require_channels(log: ScreenedLog, delays: Sequence[SensorDelay]) -> None:
    present = sorted({channel.name for channel in log.screening.all_stats})
    for delay in delays:
        if delay.name not in present:
            raise LogError(
                f"no channel {delay.name!r}, whose delay is given, in {log.name}"
                f"{did_you_mean(delay.name, present)}; it has {', '.join(present)}"
            )


def _estimated(
    log: Log, screen: Callable[[Log], ScreenedLog]
) -> tuple[tuple[SensorDelay, ...], list[str]]:
    """Return the delays that the log shows, and warnings about those that it does not show."""
    shown = _lags(screen(log))
    lags = {pair: lag for pair, lag in shown.items() if lag.error_secs <= MAX_ERROR_SECS}
    reasons = {pair: _reason(pair, shown.get(pair)) for pair in PAIRS if pair not in lags}
    if not lags:
        causes = "; ".join(f"that of the {name} {why}" for (name, _), why in reasons.items())
        raise LogError(
            f"no sensor delay can be estimated from {log.name}: {causes}; state the delays, such "
            "as heading=1.2"
        )
    for _ in range(MAX_ESTIMATES - 1):
        further = _lags(screen(DelayedLog(log, _delays(lags.values()))))
        steps = {pair: further[pair] for pair in lags if pair in further}
        lags |= {pair: replace(lag, secs=lags[pair].secs + lag.secs) for pair, lag in steps.items()}
        if all(abs(lag.secs) < MAX_STEP_ERRORS * lag.error_secs for lag in steps.values()):
            break
    late = [lag for lag in lags.values() if abs(lag.secs) > MIN_ERRORS * lag.error_secs]
    warnings = [
        f"{lag.channel}: its times are as recorded: against the {lag.reference.replace('_', ' ')} "
        f"they are {lag.secs:.2g} ± {lag.error_secs:.2g} s late (standard error), no certain delay"
        for lag in lags.values()
        if lag not in late
    ]
    warnings += [
        f"{name}: its times are as recorded: its delay {why}" for (name, _), why in reasons.items()
    ]
    return _delays(late), warnings


def _reason(pair: tuple[str, str], lag: Lag | None) -> str:
    """Return why the delay of a channel is not estimated, as a predicate."""
    if lag is None:
        return f"cannot be estimated, which {PAIRS[pair]}"
    return (
        f"has a standard error of {lag.error_secs:.2g} s, and at most {MAX_ERROR_SECS:g} s is of "
        "use: it needs a longer log, or less noise"
    )


def _delays(lags: Iterable[Lag]) -> tuple[SensorDelay, ...]:
    """Return the delays of the later one of each two channels."""
    return tuple(
        SensorDelay(lag.channel, lag.secs, lag.error_secs, lag.reference)
        if lag.secs > 0
        else SensorDelay(lag.reference, -lag.secs, lag.error_secs, lag.channel)
        for lag in lags
    )


def _lags(log: ScreenedLog) -> dict[tuple[str, str], Lag]:
    """Return the lags that the channels of a log show, by channel and reference."""
    check = ConsistencyCheck(log.screening.stats)
    for chunk in log.chunks():
        check.add(chunk)
    derived = {each.name for each in log.screening.derivations}
    return {
        (lag.channel, lag.reference): lag
        for lag in check.lags()
        if lag.reference not in derived and lag.channel not in derived
    }

"""Conversion between logs, tables and foreign tables, chosen by the endings of file names."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from shiplog.checks.consistency.consistency_check import COMPARED_CHANNELS, consistency_findings
from shiplog.checks.consistency.findings import refuse_contradictions
from shiplog.checks.data_quality import times_in_words
from shiplog.errors import UsageError
from shiplog.mcap.clock_repair import refuse_mixed_times
from shiplog.mcap.kept_records import KeptGroup, kept_groups
from shiplog.mcap.part_names import part_files
from shiplog.mcap.raw_reader import raw_groups
from shiplog.mcap.trial_log import concerns_kept, no_samples_error
from shiplog.mcap.writer import write
from shiplog.screening import DerivedLog, plan_derivations, screen_values
from shiplog.types import TrialLog, concatenate_channels
from shiplog.types.time_cut import resolve_cut

from .any_log import SUFFIXES, is_mcap_log, read_any_log
from .csv_form import write_csv
from .parquet_form import write_parquet
from .plain_csv import CsvShape, write_plain_csv
from .track_files import write_track

TRACK_SUFFIXES = (".kml", ".gpx")


def convert(
    source: Path,
    target: Path,
    layout: Path | None = None,
    *,
    start: float | str | None = None,
    end: float | str | None = None,
    strict: bool = False,
    derive: Sequence[str] = (),
    shape: CsvShape | None = None,
) -> tuple[TrialLog, list[str]]:
    """Convert a file to another format.

    Parameters
    ----------
    source
        A log (`.mcap`), a table that shiplog wrote (`.csv`, `.parquet`), or a foreign table.
    target
        File to write, in the format of its suffix: one of `SUFFIXES`, or of `TRACK_SUFFIXES` for
        the track alone. From MCAP to MCAP each
        channel is sorted by measured time; attachments and metadata records of other programs are
        kept, and their topics too unless a layout states what is converted.
    layout
        Layout file of a foreign table, or of an MCAP file of another program.
    start, end
        The part to convert, as `TrialLog.between` takes them; by default all.
    strict
        Refuse a foreign file whose channels contradict each other in unit or sign.
    derive
        The channels to add that the log lacks, some of ``yaw_rate`` and ``speed``.
    shape
        The shape of a CSV for other programs; by default a CSV keeps the whole log.

    Returns
    -------
    log
        The trial written.
    warnings
        One line each.

    Raises
    ------
    UsageError
        The suffixes or the layout do not fit the files.
    LogError, LayoutError
        The source cannot be read, or has no samples; then no file is written.
    """
    _check_target(source, target, shape)
    suffix = target.suffix.lower()
    is_mcap = is_mcap_log(source)
    log, mixed = read_any_log(source, layout)
    is_copy = is_mcap and layout is None and suffix == ".mcap"
    if not (is_copy and any(raw_groups(source))):  # a recording of raw packets alone is kept
        _require_samples(log, source)
    whole = log
    log = whole.between(start, end)
    refuse_mixed_times(mixed, log.span_ns)
    warnings = list(log.warnings)
    if derive:
        log, derived = _with_derived(log, derive)
        warnings += derived
    if is_copy:
        log, sort_warnings = sorted_by_time(log)
        warnings += sort_warnings
    if layout is not None:
        screened = screen_values(log, COMPARED_CHANNELS)
        findings = consistency_findings(screened, screened.screening.stats)
        if strict:
            refuse_contradictions(findings)
        warnings += [finding.text for finding in findings]
    if suffix == ".mcap":
        write(log, target, _kept_within(source, whole, start, end, layout) if is_mcap else ())
        return log, [each for each in warnings if not concerns_kept(each, with_topics=not layout)]
    if suffix in TRACK_SUFFIXES:
        warnings += write_track(log, target)
        return replace(log, channels=tuple(c for c in log if c.name == "position")), warnings
    warnings += _dropped_raw(source) if is_mcap else []
    if shape is not None:
        write_plain_csv(log, target, shape)
    else:
        (write_parquet if suffix == ".parquet" else write_csv)(log, target)
    return log, warnings


def _check_target(source: Path, target: Path, shape: CsvShape | None) -> None:
    """Refuse a target that cannot be written."""
    suffix, possible = target.suffix.lower(), (*SUFFIXES, *TRACK_SUFFIXES)
    if suffix not in possible:
        raise UsageError(
            f"cannot write {target.suffix or 'a file without suffix'!r}; "
            f"possible are {', '.join(possible)}: {target}"
        )
    if shape is not None and suffix != ".csv":
        raise UsageError(f"only a .csv file has a shape and units to choose; omit them: {target}")
    if target.resolve() in {file.resolve() for file in (source, *part_files(source))}:
        raise UsageError(f"the target is the source or a part of it; name another target: {target}")


def _kept_within(
    source: Path,
    whole: TrialLog,
    start: float | str | None,
    end: float | str | None,
    layout: Path | None,
) -> Iterator[KeptGroup]:
    """Yield what is kept as it is, of messages those received within a cut of the whole log.

    Where a layout states what is converted, topics of other programs are not kept.
    """
    cut = None
    if start is not None or end is not None:
        cut = resolve_cut(start, end, whole.span_ns, whole.name)
    return kept_groups(source, cut, with_topics=layout is None)


def _dropped_raw(source: Path) -> list[str]:
    """Report the raw packets that a table does not keep."""
    packets: Counter[str] = Counter()
    for group in raw_groups(source):
        for each in group:
            packets[each.topic] += len(each)
    if not packets:
        return []
    counts = ", ".join(f"{count} of {topic}" for topic, count in packets.items())
    return [f"a table keeps no raw packets, dropped are {counts}; convert to .mcap to keep them"]


def _with_derived(log: TrialLog, names: Sequence[str]) -> tuple[TrialLog, list[str]]:
    """Return the log with derived channels, each marked in its metadata, and their warnings."""
    derivations = plan_derivations(log, names)
    chunks = [chunk[len(log) :] for chunk in DerivedLog(log, derivations).chunks()]
    derived = [concatenate_channels(parts) for parts in zip(*chunks, strict=True)]
    warnings = [each.warning for each in derivations]
    return replace(log, channels=(*log.channels, *derived)), warnings


def _require_samples(log: TrialLog, source: Path) -> None:
    """Refuse a log without samples, with the reader's warnings, which list foreign topics."""
    if not any(len(channel) for channel in log):
        raise no_samples_error("convert", log.warnings, source)


def sorted_by_time(log: TrialLog) -> tuple[TrialLog, list[str]]:
    """Sort the samples of each channel by measured time.

    Readers put samples in the order of reception. So a sample that moves behind others takes the
    latest time of reception of those before it.

    Returns
    -------
    log
        The sorted trial.
    warnings
        One line for each channel that was not in order.
    """
    channels, warnings = [], []
    for channel in log:
        late = int(np.count_nonzero(np.diff(channel.measured_ns) < 0))
        if late:
            order = np.argsort(channel.measured_ns, kind="stable")
            channel = channel.take(order)  # noqa: PLW2901 - the same channel, in order
            received_ns = np.maximum.accumulate(channel.received_ns)
            channel = replace(channel, received_ns=received_ns)  # noqa: PLW2901
            warnings.append(
                f"{channel.topic}: the measured times ran backwards {times_in_words(late)}; "
                "now sorted"
            )
        channels.append(channel)
    return replace(log, channels=tuple(channels)), warnings

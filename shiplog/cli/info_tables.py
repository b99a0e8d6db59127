"""Tables of what is in a log, or in many, as `shiplog info` prints them."""

from collections.abc import Sequence

from shiplog.checks.event_table import event_table
from shiplog.checks.log_content import ChannelInfo, ForeignTopic, LogInfo, RawTopic, ValueRange
from shiplog.text_table import TextTable
from shiplog.units import utc_text


def info_tables(info: LogInfo) -> list[TextTable]:
    """Return the channels of a log, their signs, its raw packets, foreign topics and events.

    Tables without rows are omitted.
    """
    channels = TextTable(
        "Channels",
        ("topic", "samples", "rate\n[Hz]", "lowest", "highest", "unit", "gaps"),
        tuple(row for channel in info.channels for row in _channel_rows(channel)),
        tuple(_remarks(info.channels)),
    )
    signs = TextTable(
        "Signs",
        ("topic", "positive"),
        tuple((channel.topic, channel.positive) for channel in info.channels if channel.positive),
    )
    foreign = TextTable(
        "Topics of other programs",
        ("topic", "type", "messages", "rate\n[Hz]", "encoding", "first [s]", "last [s]"),
        tuple(_foreign_row(topic, info) for topic in info.foreign),
        ("`shiplog layout` drafts their conversion; times are of reception, in s from the start.",),
    )
    raw = TextTable(
        "Raw packets",
        ("topic", "packets", "rate\n[Hz]", "bytes", "format", "first [s]", "last [s]"),
        tuple(_raw_row(topic, info) for topic in info.raw),
    )
    events = event_table(info.events, info.start_ns)
    return [table for table in (channels, signs, raw, foreign, events) if table.rows]


def info_overview(infos: Sequence[LogInfo]) -> TextTable:
    """Return a table of several logs, one row each; what is unusual stands below it."""
    rows = []
    for info in infos:
        start = (info.start_utc or "no samples").replace("T", " ").rstrip("Z")
        samples = sum(channel.samples for channel in info.channels)
        rows.append((info.name, start, f"{info.duration_secs:.0f}", str(samples)))
    columns = ("log", "start (UTC)", "duration\n[s]", "samples")
    remarks = [f"{info.name}: {info.state}." for info in infos if info.state != "finished"]
    remarks += [
        f"{info.name}: {len(info.foreign)} topics of other programs."
        for info in infos
        if info.foreign
    ]
    return TextTable(f"{len(infos)} logs", columns, tuple(rows), tuple(remarks))


def _channel_rows(channel: ChannelInfo) -> list[tuple[str, ...]]:
    """Return a row of a channel; of one with components a further row for each of them."""
    rate = "" if channel.rate_hz is None else f"{channel.rate_hz:.3g}"
    rate += " *" if channel.irregular else ""
    gaps = "" if channel.gaps is None else str(channel.gaps)
    is_time = channel.topic.startswith("/gnss_time/")
    scalar = [each for each in channel.ranges if not each.component]
    values = _range_cells(scalar[0]) if scalar else ("", "", channel.unit)
    if channel.ranges and (is_time or not scalar):
        values = ("", "", "")
    rows: list[tuple[str, ...]] = [(channel.topic, str(channel.samples), rate, *values, gaps)]
    rows += [row for each in scalar if is_time for row in _time_rows(each)]
    rows += [
        (f"  {each.component}", "", "", *_range_cells(each), "")
        for each in channel.ranges
        if each.component
    ]
    return rows


def _time_rows(values: ValueRange) -> list[tuple[str, ...]]:
    """Return a row of the dates of a range of times, and one of their times of day."""
    lowest, highest = (utc_text(each).split(" ") for each in (values.lowest, values.highest))
    parts = zip(("  date", "  time of day"), lowest, highest, strict=True)
    return [(part, "", "", first, last, "UTC", "") for part, first, last in parts]


def _range_cells(values: ValueRange) -> tuple[str, str, str]:
    """Return the cells of a range; of degrees of position with enough digits to find the place."""
    digits = 7 if values.component in {"latitude", "longitude"} else 4
    return f"{values.lowest:.{digits}g}", f"{values.highest:.{digits}g}", values.unit


def _remarks(channels: Sequence[ChannelInfo]) -> list[str]:
    remarks = []
    if any(channel.irregular for channel in channels):
        remarks.append("* irregular: more than a tenth of the intervals differ by more than half.")
    remarks += [
        f"{channel.topic}: the longest gap is {channel.longest_gap_secs:.1f} s."
        for channel in channels
        if channel.gaps and channel.longest_gap_secs
    ]
    return remarks


def _raw_row(topic: RawTopic, info: LogInfo) -> tuple[str, ...]:
    size = "" if topic.size is None else str(topic.size)
    return (
        topic.topic,
        str(topic.packets),
        _rate_cell(topic),
        size,
        topic.format,
        *_span_cells(topic, info),
    )


def _foreign_row(topic: ForeignTopic, info: LogInfo) -> tuple[str, ...]:
    encodings = [text for text in (topic.encoding, topic.schema_encoding) if text]
    encoding = "/".join(dict.fromkeys(encodings))
    messages, span = str(topic.messages), _span_cells(topic, info)
    return (topic.topic, topic.schema, messages, _rate_cell(topic), encoding, *span)


def _rate_cell(topic: RawTopic | ForeignTopic) -> str:
    return "" if topic.rate_hz is None else f"{topic.rate_hz:.3g}"


def _span_cells(topic: RawTopic | ForeignTopic, info: LogInfo) -> tuple[str, str]:
    """Return the first and the last time of a topic, in s since the start."""
    start_ns = info.start_ns or 0
    first, last = (
        "" if at_ns is None else f"{(at_ns - start_ns) * 1e-9:.1f}"
        for at_ns in (topic.first_ns, topic.last_ns)
    )
    return first, last

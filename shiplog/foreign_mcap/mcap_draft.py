"""Draft of the layout of an MCAP file, from the types, names and first messages of its topics."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from shiplog.errors import LayoutError, LogError
from shiplog.layouts.header_words import recognise, split_header
from shiplog.layouts.layout import Draft
from shiplog.mcap.contents import McapContents
from shiplog.mcap.decode import is_foreign
from shiplog.mcap.mcap_file import open_mcap
from shiplog.mcap.scan import scan
from shiplog.mcap.schema import LOCATION_FIX
from shiplog.printable import printable
from shiplog.toml_output import toml_key, toml_string
from shiplog.units import CATALOGUE, UNITS

from .field_values import field_paths, optional_value
from .message_decoders import MessageError, message_decoder
from .message_stamps import numeric_stamp
from .ready_layouts import ready_layouts
from .topic_choice import FileTopic, read_file_topics, source_of_topic
from .topic_samples import short_type

MAX_LISTED_FIELDS = 20  # of a topic, as comments
_NAMELESS = ("data", "value", "val", "v")  # fields whose topic names the quantity
_STAMPS = r"(.*\.)?(stamp|timestamp|time)\.\w+|header\..*"
_POSITION = ("latitude", "longitude")
_NAMELESS_TYPE = "std_msgs/Float64"


def draft_mcap_layout(path: Path) -> Draft:
    """Draft the layout of an MCAP file.

    Well-known types have sections of their own; of other types the numbers whose names are those of
    a quantity. What neither type nor name determines is marked as assumed, about which `convert`
    warns.

    Raises
    ------
    LayoutError
        No topic has numbers that can be read.
    LogError
        The file is missing or is not MCAP.
    """
    topics = [topic for topic in read_file_topics(path) if _is_of_others(topic)]
    if not topics:
        raise LayoutError(
            f"no topics of other programs, so that it needs no layout (`shiplog info`): {path}"
        )
    ready = ready_layouts()
    lines = [f"# drafted from {printable(path.name)}; check every unit and sense"]
    remarks: list[str] = []
    for each in _drafted_topics(path, topics):
        topic, text = each.topic, ready.get(short_type(each.topic.type), "")
        lines += ["", f"# ---- {printable(topic.topic)}: {printable(topic.type or 'no type')}"]
        if text and topic.messages and short_type(topic.type) != _NAMELESS_TYPE:
            lines += _adapted(text, each)
            remarks.append(f"{topic.topic}: sections of the type {topic.type}")
        else:
            lines += _sections_by_name(each, remarks)
    if not any("field = " in line or line.startswith("[") for line in lines):
        causes = "; ".join(remarks) or "no messages"
        raise LayoutError(f"no topic has numbers that can be read ({causes}): {path}")
    return Draft("\n".join(lines) + "\n", tuple(remarks))


@dataclass(frozen=True, eq=False)
class _DraftedTopic:
    """A topic of which sections are drafted.

    Attributes
    ----------
    topic
        The topic.
    source
        The source of its channels, which no other topic has.
    place
        The lines of a section that select its messages.
    message, cause
        Its first message, decoded; or None, and why there is none.
    """

    topic: FileTopic
    source: str
    place: tuple[str, ...]
    message: object
    cause: str


def _drafted_topics(path: Path, topics: Sequence[FileTopic]) -> list[_DraftedTopic]:
    samples = _first_messages(path, topics)
    names = [topic.topic for topic in topics]
    drafted: list[_DraftedTopic] = []
    for topic in topics:
        source = source_of_topic(topic.topic)
        taken = {each.source for each in drafted}
        if source in taken:
            numbered = (f"{source}_{number}" for number in range(2, len(topics) + 2))
            source = next(name for name in numbered if name not in taken)
        place = [f"topic = {toml_string(topic.topic)}"]
        if names.count(topic.topic) > 1 and topic.type:
            place.append(f"type = {toml_string(topic.type)}")
        message, cause = _decoded(topic, samples.get(topic.record.id))
        drafted.append(_DraftedTopic(topic, source, tuple(place), message, cause))
    return drafted


def _is_of_others(topic: FileTopic) -> bool:
    """Whether a topic is not of shiplog; its own positions state their channel."""
    schemas = {topic.schema.id: topic.schema} if topic.schema else {}
    is_fix = topic.type == LOCATION_FIX and "channel" not in topic.record.metadata
    return is_fix or is_foreign(topic.record, schemas)


def _first_messages(path: Path, topics: Sequence[FileTopic]) -> dict[int, bytes]:
    """Return the first message of each topic, by the id of its channel."""
    wanted = {topic.record.id for topic in topics if topic.messages}
    found: dict[int, bytes] = {}
    contents = McapContents(
        selected=frozenset(), keeps=lambda record, _: record.id in wanted - found.keys()
    )
    with open_mcap(path) as file:
        for _ in scan(file, contents):
            contents.event_messages.clear()
            for channel_id, kept in contents.take_kept().items():
                found[channel_id] = kept[0].messages[0]
            if wanted <= found.keys():
                break
    return found


def _decoded(topic: FileTopic, data: bytes | None) -> tuple[object, str]:
    """Return the decoded message, or why there is none."""
    if data is None:
        return None, "no messages"
    try:
        return message_decoder(topic.record, topic.schema)(data), ""
    except (LogError, MessageError) as error:
        return None, str(error)


def _adapted(text: str, drafted: _DraftedTopic) -> list[str]:
    """Return the sections of a well-known type for a topic, with its source."""
    text = re.sub(
        r"^\[(\w+)\]",
        lambda section: f"[{toml_key(section[1], drafted.source)}]",
        text,
        flags=re.MULTILINE,
    )
    place = "\n".join(drafted.place)
    text = re.sub(r"^type = .*$", lambda _: place, text, flags=re.MULTILINE)
    frame = optional_value(drafted.message, "header.frame_id")
    lines = text.rstrip().split("\n")
    if isinstance(frame, str) and frame:
        lines.insert(0, f"# frame of its messages: {printable(frame)}")
        if re.search(r"(^|[_/])(ned|frd)([_/]|$)", frame.lower()):
            lines = [
                re.sub(r'^axes = "enu"', 'axes = "ned"', re.sub("^sign = -1 ", "sign = 1  ", line))
                for line in lines
            ]
    return lines


def _sections_by_name(drafted: _DraftedTopic, remarks: list[str]) -> list[str]:
    """Return sections of the numbers whose names are those of a quantity, others as comments."""
    topic, message = drafted.topic, drafted.message
    if message is None:
        remarks.append(f"{topic.topic}: {drafted.cause}")
        return [f"# not read: {printable(drafted.cause)}"]
    stamps = (numeric_stamp(message), "timestamp_ns", "time", "t")
    paths = [p for p in field_paths(message) if not re.fullmatch(_STAMPS, p) and p not in stamps]
    words = {path: split_header(_name(path, topic.topic)) for path in paths}
    named = {path: text for path, (text, _) in words.items() if len(text) > 2}
    found = {
        role: path
        for role, path in recognise(named, []).items()
        if role.partition(".")[0] in (*CATALOGUE, *_POSITION)
    }
    if not set(_POSITION) <= found.keys():
        found = {role: path for role, path in found.items() if role not in _POSITION}
    lines = _position_section(drafted, found) if set(_POSITION) <= found.keys() else []
    for role, path in found.items():
        if role not in _POSITION:
            lines += _section(drafted, role, path, words[path][1])
    rest = [path for path in paths if path not in found.values()][:MAX_LISTED_FIELDS]
    if rest:
        lines += ["", "# not recognised; a channel needs topic, field, unit, and often sign:"]
        lines += [f"# {drafted.place[0]}, field = {toml_string(path)}" for path in rest]
    remarks.append(
        f"{topic.topic}: recognised by name: {', '.join(found) or 'nothing'}"
        + ("; check every unit and sign" if found else "")
    )
    return lines or ["# no numbers"]


def _section(drafted: _DraftedTopic, role: str, path: str, stated: str) -> list[str]:
    """Return the section of a quantity that a name states; its unit where none is stated is SI."""
    quantity, _, side = role.partition(".")
    kind = CATALOGUE[quantity]
    is_stated = stated in UNITS and UNITS[stated][0] == kind.unit
    unit, assumed = (stated, "sign") if is_stated else (kind.unit, "unit, sign")
    return [
        "",
        f"[{toml_key(quantity, '_'.join(filter(None, (drafted.source, side))))}]",
        *drafted.place,
        f"field = {toml_string(path)}",
        f"unit = {toml_string(unit)}",
        f"sign = 1           # positive: {kind.positive}",
        f'assumed = "{assumed}"   # check, then remove this line',
    ]


def _position_section(drafted: _DraftedTopic, found: Mapping[str, str]) -> list[str]:
    return [
        "",
        f"[{toml_key('position', drafted.source)}]",
        *drafted.place,
        *(f"{part} = {toml_string(found[part])}" for part in _POSITION),
        'unit = "deg"',
        'assumed = "unit"   # check, then remove this line',
    ]


def _name(path: str, topic: str) -> str:
    """Return the name that states the quantity of a field: its own, or that of its topic."""
    name = re.sub(r"(\[\d+\])+$", "", path).rpartition(".")[2].strip('"')
    return name if name.lower() not in _NAMELESS else topic.rstrip("/").rpartition("/")[2]

import struct
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from shiplog import Channel
from shiplog.mcap.messages import decode_messages, descriptor_set, encode_messages
from shiplog.mcap.schema import schema_for, schema_named
from shiplog.units import GEOGRAPHIC

EXTREMES = [0.0, -0.0, 1.0, -1e308, 5e-324, float("inf"), float("-inf"), float("nan")]


def channel(values: Any, fields: tuple[str, ...] = ()) -> Channel:  # noqa: ANN401 - any array
    at = np.arange(len(values)) + 1_700_000_000_000_000_000
    return Channel("some", "test", "1", at, at, np.asarray(values, float), fields)


def message_type_of(descriptor_set: bytes, name: str) -> Any:  # noqa: ANN401 - a class made at run time
    """Return the message class that a program makes of the descriptors in a file."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptor_set).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


def bits(array: Any) -> bytes:  # noqa: ANN401 - any array
    return np.asarray(array, "<f8").tobytes()


@pytest.mark.parametrize("fields", [(), ("north", "east"), GEOGRAPHIC])
def test_a_decoder_made_from_the_descriptors_reads_our_messages(fields: tuple[str, ...]) -> None:
    rng = np.random.default_rng(0)
    values = rng.choice(EXTREMES, (50, len(fields)) if fields else 50)
    schema = schema_for(fields)
    message_type = message_type_of(descriptor_set(schema), schema.name)
    messages = [message_type.FromString(data) for data in encode_messages(channel(values, fields))]
    read = [[getattr(m, f) for f in fields or ("value",)] for m in messages]
    assert bits(read) == bits(values)


@pytest.mark.parametrize("fields", [(), ("north", "east")])
def test_we_read_messages_of_an_encoder_made_from_the_descriptors(fields: tuple[str, ...]) -> None:
    schema = schema_for(fields)
    message_type = message_type_of(descriptor_set(schema), schema.name)
    rows = np.random.default_rng(1).choice(EXTREMES, (50, len(schema.fields)))
    data = [
        message_type(**dict(zip(schema.fields, row, strict=True))).SerializeToString()
        for row in rows.tolist()
    ]
    assert bits(decode_messages(schema, data)[0]) == bits(rows)


@pytest.mark.parametrize("fields", [(), ("north", "east")])
def test_messages_have_one_length_and_layout_whatever_their_values(fields: tuple[str, ...]) -> None:
    schema = schema_for(fields)
    width = len(schema.fields)
    values = np.array(EXTREMES * width).reshape(-1, *([width] if fields else []))
    data = encode_messages(channel(values, fields))
    assert schema.dtype is not None
    assert {len(message) for message in data} == {schema.dtype.itemsize} == {9 * width}
    tags = {message[::9] for message in data}
    assert tags == {bytes(schema.tags.values())} == {bytes(range(0x09, 0x09 + 8 * width, 8))}


def test_a_scalar_message_is_a_tag_and_a_double() -> None:
    assert encode_messages(channel([1.5])) == [b"\x09" + struct.pack("<d", 1.5)]


def test_an_absent_field_is_nan_and_zero_is_written() -> None:
    schema = schema_for(("north", "east"))
    north_alone = b"\x09" + struct.pack("<d", 0.0)
    assert bits(decode_messages(schema, [north_alone, b""])[0]) == bits(
        [[0.0, np.nan], [np.nan, np.nan]]
    )


def test_fields_are_read_in_any_order_and_unknown_ones_are_skipped() -> None:
    schema = schema_for(("north", "east"))
    north, east = b"\x09" + struct.pack("<d", 1.0), b"\x11" + struct.pack("<d", 2.0)
    unknown = b"\x19" + struct.pack("<d", 3.0)
    np.testing.assert_array_equal(
        decode_messages(schema, [unknown + east + north])[0], [[1.0, 2.0]]
    )


def test_a_location_fix_has_its_time_of_measurement() -> None:
    schema = schema_for(GEOGRAPHIC)
    fix = channel([[59.9, 30.2, 1.0]], GEOGRAPHIC)
    message = message_type_of(descriptor_set(schema), schema.name).FromString(
        encode_messages(fix)[0]
    )
    assert message.timestamp.ToNanoseconds() == fix.measured_ns[0]


def test_schemas_are_found_by_name_and_unknown_ones_are_none() -> None:
    for fields in ((), ("north", "east"), GEOGRAPHIC):
        assert schema_named(schema_for(fields).name) == schema_for(fields)
    assert schema_named("sensor_msgs.Imu") is None
    with pytest.raises(ValueError, match="no message schema has the fields"):
        schema_for(("up", "down"))


def test_no_samples_give_no_messages() -> None:
    assert encode_messages(channel([])) == []
    assert decode_messages(schema_for(()), [])[0].shape == (0, 1)

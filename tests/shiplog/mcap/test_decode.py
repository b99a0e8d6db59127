"""Messages are the same whichever way they are located in an MCAP chunk."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from mcap_files import (
    START,
    channel,
    flip_bit,
    position,
    samples,
    samples_by_mcap,
    scalar,
    write_by_mcap,
)

import shiplog.mcap.decode
from shiplog import LogError, read
from shiplog.mcap.messages import descriptor_set
from shiplog.mcap.schema import schema_for


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


@pytest.mark.parametrize(
    "disabled",
    [(), ("locate_by_size",), ("locate_by_index",), ("locate_by_size", "locate_by_index")],
)
@pytest.mark.parametrize("mixed", [False, True])
def test_messages_are_the_same_located_by_size_by_index_or_by_a_walk(
    path: Path, monkeypatch: pytest.MonkeyPatch, disabled: tuple[str, ...], *, mixed: bool
) -> None:
    original = [channel("yaw_rate", 2000, 1), channel("speed", 700, 2)]
    original += [position(40, ("north", "east"))] if mixed else []
    write_by_mcap(path, *original, chunk_size=5000)
    for way in disabled:
        monkeypatch.setattr(shiplog.mcap.decode, way, lambda *_: {})
    assert samples(read(path)) == samples_by_mcap(path)


@pytest.mark.parametrize("mixed", [False, True])
def test_an_mcap_chunk_of_fixed_width_messages_is_not_walked(
    path: Path, monkeypatch: pytest.MonkeyPatch, *, mixed: bool
) -> None:
    original = [channel("yaw_rate", 2000, 1), channel("speed", 700, 2)]
    original += [position(40, ("north", "east"))] if mixed else []
    write_by_mcap(path, *original)
    monkeypatch.delattr(shiplog.mcap.decode, "_locate_by_walk")
    assert samples(read(path)) == samples_by_mcap(path)


def test_a_channel_described_among_the_messages_of_another_is_read(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        for topic in ("/a/x", "/b/x", "/c/x"):
            channel_id = writer.register_channel(topic, "protobuf", schema_id, {})
            for k in range(50):
                writer.add_message(channel_id, START + k, scalar(k), START)
        writer.finish()
    assert samples(read(path)) == samples_by_mcap(path)


def test_a_short_last_message_is_not_read_beyond_the_mcap_chunk(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        channel_id = writer.register_channel("/a/x", "protobuf", schema_id, {})
        for k, data in enumerate((scalar(1.0), scalar(2.0), b"")):
            writer.add_message(channel_id, k, data, k)
        writer.finish()
    np.testing.assert_array_equal(read(path)["a"].values, [1, 2, np.nan])


def test_changed_bytes_in_an_mcap_chunk_without_checksums_are_read_or_rejected(
    path: Path,
) -> None:
    """The change is not detectable, but nothing may be read beyond the MCAP chunk."""
    write_by_mcap(
        path, channel("speed", 30, 2), compression=CompressionType.NONE, enable_crcs=False
    )
    data = path.read_bytes()
    for bit in np.random.default_rng(0).integers(64, 8 * len(data), 400).tolist():
        path.write_bytes(flip_bit(data, bit))
        with suppress(LogError):
            read(path)

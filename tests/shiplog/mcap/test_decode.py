"""Messages are the same whichever way they are found in a chunk."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from mcap_files import START, channel, flipped, position, samples, samples_by_mcap, scalar, written

import shiplog.mcap.decode
from shiplog import LogError, read
from shiplog.mcap.schema import schema_for


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


@pytest.mark.parametrize(
    "disabled",
    [(), ("locate_by_size",), ("locate_by_index",), ("locate_by_size", "locate_by_index")],
)
@pytest.mark.parametrize("mixed", [False, True])
def test_by_their_even_size_by_the_index_or_by_a_walk(
    path: Path, monkeypatch: pytest.MonkeyPatch, disabled: tuple[str, ...], *, mixed: bool
) -> None:
    held = [channel("yaw_rate", 2000, 1), channel("speed", 700, 2)]
    held += [position(40, ("north", "east"))] if mixed else []
    written(path, *held, chunk_size=5000)
    for way in disabled:
        monkeypatch.setattr(shiplog.mcap.decode, way, lambda *_: {})
    assert samples(read(path)) == samples_by_mcap(path)


@pytest.mark.parametrize("mixed", [False, True])
def test_a_chunk_of_our_own_is_not_walked(
    path: Path, monkeypatch: pytest.MonkeyPatch, *, mixed: bool
) -> None:
    held = [channel("yaw_rate", 2000, 1), channel("speed", 700, 2)]
    held += [position(40, ("north", "east"))] if mixed else []
    written(path, *held)
    monkeypatch.delattr(shiplog.mcap.decode, "_locate_by_walk")
    assert samples(read(path)) == samples_by_mcap(path)


def test_a_channel_that_is_described_among_the_messages_of_another(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", schema.descriptor_set)
        for topic in ("/a/x", "/b/x", "/c/x"):
            channel_id = writer.register_channel(topic, "protobuf", schema_id, {})
            for k in range(50):
                writer.add_message(channel_id, START + k, scalar(k), START)
        writer.finish()
    assert samples(read(path)) == samples_by_mcap(path)


def test_a_short_message_ends_no_gather_beyond_the_chunk(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", schema.descriptor_set)
        channel_id = writer.register_channel("/a/x", "protobuf", schema_id, {})
        for k, data in enumerate((scalar(1.0), scalar(2.0), b"")):
            writer.add_message(channel_id, k, data, k)
        writer.finish()
    np.testing.assert_array_equal(read(path)["a"].values, [1, 2, np.nan])


def test_bytes_changed_anywhere_in_a_chunk_without_checksums_are_read_or_refused(
    path: Path,
) -> None:
    """Nothing tells that they changed: still nothing is read beyond the chunk."""
    written(path, channel("speed", 30, 2), compression=CompressionType.NONE, enable_crcs=False)
    data = path.read_bytes()
    for bit in np.random.default_rng(0).integers(64, 8 * len(data), 400).tolist():
        path.write_bytes(flipped(data, bit))
        with suppress(LogError):
            read(path)

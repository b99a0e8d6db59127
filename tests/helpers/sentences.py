"""Sentences of NMEA 0183 for tests."""

from functools import reduce
from operator import xor

from recorders.nmea0183.sentence_decoder import DecodingOptions, SentenceDecoder
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import SampleBuffer
from shiplog.types import Channel


def sentence(body: str, start: str = "$") -> bytes:
    """Return a sentence with its checksum."""
    return f"{start}{body}*{reduce(xor, body.encode(), 0):02X}".encode()


def tagged(tag: str, body: str) -> bytes:
    """Return a sentence with a TAG block before it."""
    return b"\\" + sentence(tag)[1:] + b"\\" + sentence(body)


def decoded(
    *bodies: str, options: DecodingOptions | None = None, received_ns: int = 0
) -> dict[str, list[float | list[float]]]:
    """Return the values of sentences by topic, in the units of the catalogue."""
    decoder, samples = SentenceDecoder(options), SampleBuffer()
    decoder.decode([Packet(sentence(body), received_ns) for body in bodies], samples)
    assert not decoder.counts.rejected
    return {
        item.topic: item.values.tolist() for item in samples.take() if isinstance(item, Channel)
    }

"""Channels derived from others, where a log lacks them and the user asks for them.

A derived channel is marked by its source, `derived.SOURCE`, and by its metadata.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees

from shiplog.checks.channel_stats import ChannelStats
from shiplog.errors import LogError
from shiplog.types import Channel, Log

from .heading_rate import HeadingDifferentiator, HeadingRate
from .log_view import LogView


@dataclass(frozen=True)
class Derivation:
    """A channel that is derived from another: plain data, for any number of passes.

    Attributes
    ----------
    name
        The derived quantity.
    base
        Statistics of the channel from which it is derived.
    rate
        Of a yaw rate, how it is computed; None for a speed.
    """

    name: str
    base: ChannelStats
    rate: HeadingRate | None

    @property
    def source(self) -> str:
        """The source of the derived channel, such as ``derived.HE``."""
        return f"derived.{self.base.source}"

    @property
    def metadata(self) -> dict[str, str]:
        """What marks the channel as derived: from what, how, and with which noise."""
        if self.rate is None:
            return {"derived_from": self.base.topic, "noise": "the current, in full"}
        return {
            "derived_from": self.base.topic,
            "noise": f"{self.rate.noise:.3g} rad/s",
            "bandwidth": f"{self.rate.bandwidth_hz:.3g} Hz",
            "window": f"{self.rate.samples} samples, {self.rate.window_secs:.3g} s",
        }

    @property
    def warning(self) -> str:
        """What the derived channel is worth, in a sentence."""
        if self.rate is None:
            return (
                f"speed: derived, {self.base.topic} is taken for the speed through the water; the "
                "current is in it in full, and going astern is not seen"
            )
        return f"yaw_rate: derived from {self.base.topic}, {self.rate}"

    @property
    def remedy(self) -> str:
        """What the user may do where the quantity is missing."""
        option = f"--derive {self.name}"
        if self.rate is None:
            return f"{option} takes {self.base.topic} for it, with the current in it"
        noise = f"{degrees(self.rate.noise):.2g} deg/s"
        return f"{option} computes it from {self.base.topic}, with a noise of {noise}"


class DerivedLog(LogView):
    """A log with derived channels beside its own; a `shiplog.types.Log`.

    Parameters
    ----------
    log
        The log as recorded.
    derivations
        The channels to derive, from `plan_derivations` of this log.
    selected
        The source to keep, by channel name.
    """

    def __init__(
        self,
        log: Log,
        derivations: Sequence[Derivation],
        selected: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(log)
        self._derivations = tuple(derivations)
        self._selected = dict(selected or {})

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Iterate over the samples in chunks; the derived channels follow the recorded ones."""
        steps = [(each, _Deriver(each)) for each in self._derivations]
        for chunk in self._log.chunks():
            by_key = {channel.key: channel for channel in chunk}
            derived = [step(by_key[each.base.topic, each.base.fields]) for each, step in steps]
            yield tuple(
                channel
                for channel in (*chunk, *derived)
                if self._selected.get(channel.name, channel.source) == channel.source
            )

    def select_sources(self, sources: Mapping[str, str]) -> "DerivedLog":
        """Return the log with a single source for each of the names given.

        Raises
        ------
        LogError
            The log has no such channel.
        """
        derived = {each.name: each.source for each in self._derivations}
        for name, source in sources.items():
            if name in derived and source != derived[name]:
                raise LogError(f"no source {source!r} of {name!r}; it is {derived[name]}")
        self._log.select_sources({n: s for n, s in sources.items() if n not in derived})
        return DerivedLog(self._log, self._derivations, self._selected | dict(sources))


class _Deriver:
    """Derives a channel, part by part."""

    def __init__(self, derivation: Derivation) -> None:
        self._derivation = derivation
        self._rates = HeadingDifferentiator(derivation.rate) if derivation.rate else None

    def __call__(self, part: Channel) -> Channel:
        """Return the next part of the derived channel, given that of its base."""
        derivation = self._derivation
        base = derivation.base.screened(part)
        if self._rates is None:
            name, source, metadata = derivation.name, derivation.source, derivation.metadata
            return replace(base, name=name, source=source, metadata=metadata)
        times, received, values = self._rates.step(base)
        return Channel(
            derivation.name,
            derivation.source,
            "rad/s",
            times,
            received,
            values,
            metadata=derivation.metadata,
        )

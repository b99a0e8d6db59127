from itertools import pairwise

import numpy as np
import pytest

from shiplog.checks.fixes import MAX_IMPOSSIBLE_VALUES, FixScreen, FixScreening
from shiplog.geodesy import LocalFrame, LocalPositions
from shiplog.types import Channel

SPEED = 8.0  # m/s


def straight(count: int = 300, noise: float = 3.0) -> np.ndarray:
    """Return a track of 8 m/s to the north-east, one fix per second, (n, 2) m."""
    rng = np.random.default_rng(4)
    return SPEED / np.sqrt(2) * np.arange(count)[:, None] + rng.normal(0, noise, (count, 2))


def fixes(values: np.ndarray, times: np.ndarray | None = None) -> Channel:
    at = np.arange(len(values)) if times is None else times
    stamps = 1_700_000_000_000_000_000 + (at * 1e9).astype(np.int64)
    return Channel("position", "gps", "m", stamps, stamps, values, ("north", "east"))


def geographic(track: np.ndarray, datum: tuple[float, float] = (60.0, 20.0)) -> Channel:
    globe = LocalFrame(datum, geographic=True).to_geographic(LocalPositions(*track.T))
    values = np.column_stack((globe.latitude, globe.longitude, np.full(len(track), np.nan)))
    at = fixes(track).measured_ns
    return Channel("position", "gps", "deg", at, at, values, ("latitude", "longitude", "altitude"))


def with_rows(channel: Channel, rows: slice | list[int], values: object) -> Channel:
    changed = channel.values.copy()
    changed[rows, :2] = values
    at = channel.measured_ns
    return Channel("position", "gps", channel.unit, at, at, changed, channel.fields)


def screened(channel: Channel, cuts: tuple[int, ...] = ()) -> tuple[FixScreening, list[int]]:
    screen = FixScreen()
    edges = [0, *cuts, len(channel)]
    for start, stop in pairwise(edges):
        screen.add(channel.part(start, stop))
    result = screen.result(SPEED)
    unused = np.isnan(result.apply(channel).values[:, 0])
    return result, np.flatnonzero(unused).tolist()


@pytest.mark.parametrize(
    "datum", [(60, 20), (-17, 179.999), (-17, -179.9999), (89.999, 30), (0, 0), (0.001, 180)]
)
def test_good_fixes_are_all_used(datum: tuple[float, float]) -> None:
    for channel in (geographic(straight(), datum), fixes(straight())):
        result, unused = screened(channel)
        assert unused == []
        assert list(result.warnings()) == []
        assert result.usable == 300


@pytest.mark.parametrize("rows", [[0], [150], [299], [0, 1, 2], [50, 51, 52, 90, 200]])
@pytest.mark.parametrize("cuts", [(), (1,), (50, 51, 151), tuple(range(1, 300))])
def test_wild_fixes_are_rejected_wherever_they_are(rows: list[int], cuts: tuple[int, ...]) -> None:
    for channel in (
        with_rows(geographic(straight()), rows, (61.0, 20.0)),
        with_rows(fixes(straight()), rows, (9000.0, -7000.0)),
    ):
        result, unused = screened(channel, cuts)
        assert unused == rows
        (warning,) = result.warnings()
        assert f"{len(rows)} fix" in warning
        assert "cannot reach" in warning


def test_a_long_stretch_of_wild_fixes_is_rejected() -> None:
    track = straight()
    track[100:180] += [5000.0, 0.0]
    result, unused = screened(fixes(track), (110, 170))
    assert unused == list(range(100, 180))
    (warning,) = result.warnings()
    assert "80 fixes in 1 stretch" in warning
    assert "5.0 km" in warning
    assert "the first 100.0 s" in warning
    assert "datum or origin may have changed" in warning


def test_fixes_scattered_at_random_are_rejected() -> None:
    track = straight()
    track[100:140] += np.random.default_rng(2).uniform(-50_000, 50_000, (40, 2))
    assert screened(fixes(track))[1] == list(range(100, 140))


def test_a_wild_fix_after_a_gap_does_not_cost_the_fixes_that_follow() -> None:
    track, times = straight(), np.arange(300.0)
    times[150:] += 60
    track[150:] += SPEED / np.sqrt(2) * 60
    track[150:155] += [-1500.0, 0.0]  # within reach after the gap, but then not back
    assert screened(fixes(track, times))[1] == list(range(150, 155))


def test_fixes_after_a_long_gap_are_used() -> None:
    track, times = straight(), np.arange(300.0)
    times[150:] += 3600
    track[150:] += SPEED / np.sqrt(2) * 3600
    assert screened(fixes(track, times))[1] == []


@pytest.mark.parametrize("rows", [slice(30), slice(100, 130), slice(270, 300), slice(200)])
@pytest.mark.parametrize("cuts", [(), (1,), (15, 100, 115)])
def test_latitude_0_longitude_0_is_no_fix(rows: slice, cuts: tuple[int, ...]) -> None:
    result, unused = screened(with_rows(geographic(straight()), rows, (0.0, 0.0)), cuts)
    assert unused == list(range(*rows.indices(300)))
    (warning,) = result.warnings()
    assert "latitude 0, longitude 0" in warning
    assert result.usable_span_ns[1] > result.usable_span_ns[0]


def test_latitude_0_longitude_0_throughout_is_no_position() -> None:
    result, unused = screened(with_rows(geographic(straight()), slice(None), (0.0, 0.0)))
    assert len(unused) == 300
    assert result.usable == 0


def test_a_ship_that_passes_latitude_0_longitude_0_is_there() -> None:
    channel = geographic(straight(noise=0.0) - straight(noise=0.0)[150], (0.0, 0.0))
    assert channel.values[150, :2] == pytest.approx(0, abs=1e-12)
    assert screened(channel)[1] == []


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((91.0, 181.0), "30 at latitude 91, longitude 181"),
        ((-999.0, -999.0), "30 at latitude -999, longitude -999"),
        ((60.0, 9999.0), "30 at latitude 60, longitude 9999"),
        ((np.inf, 20.0), "30 at latitude inf, longitude 20"),
    ],
)
@pytest.mark.parametrize("first", [0, 100])
def test_impossible_positions_are_counted_by_value(
    values: tuple[float, float], text: str, first: int
) -> None:
    channel = with_rows(geographic(straight()), slice(first, first + 30), values)
    result, unused = screened(channel, (first + 10,))
    assert unused == list(range(first, first + 30))
    (warning,) = result.warnings()
    assert text in warning
    assert f"the first {first:.1f} s" in warning


@pytest.mark.parametrize("cuts", [(), (700, 1600)])
def test_impossible_positions_that_all_differ_are_counted_in_bounded_memory(
    cuts: tuple[int, ...],
) -> None:
    wild = np.column_stack((100.0 + np.arange(2000)[::-1], np.full(2000, 20.0)))
    channel = with_rows(geographic(straight(2300)), slice(100, 2100), wild)
    channel = with_rows(channel, slice(2100, 2200), wild[0])  # one of the first again
    result, unused = screened(channel, cuts)
    assert unused == list(range(100, 2200))
    assert len(result.impossible) == MAX_IMPOSSIBLE_VALUES
    assert result.impossible[2099.0, 20.0] == 101
    (warning,) = result.warnings()
    assert warning.startswith("2100 fixes at an impossible position (101 at latitude 2099")
    assert ", 1997 at others)" in warning


@pytest.mark.parametrize("row", [(np.nan, np.nan), (np.nan, 20.0), (60.0, np.nan)])
def test_a_fix_without_one_component_is_not_measured(row: tuple[float, float]) -> None:
    result, unused = screened(with_rows(geographic(straight()), slice(0, 10), row))
    assert unused == list(range(10))
    assert list(result.warnings()) == []


def test_longitudes_from_0_to_360_are_used() -> None:
    channel = geographic(straight(), (50.0, -0.01))
    channel = with_rows(channel, slice(None), np.mod(channel.values[:, :2], [400.0, 360.0]))
    assert np.ptp(channel.values[:, 1]) > 359
    assert screened(channel)[1] == []


@pytest.mark.parametrize("cuts", [(), (1,), (120, 121, 180), tuple(range(1, 300))])
def test_a_frozen_receiver_does_not_cost_the_fixes_around(cuts: tuple[int, ...]) -> None:
    track = straight()
    track[100:180] = track[100]
    assert screened(fixes(track), cuts)[1] == []


def test_a_receiver_that_repeats_a_wild_fix_is_rejected_as_one_stretch() -> None:
    result, unused = screened(with_rows(geographic(straight()), slice(100, 200), (60.0, 21.0)))
    assert unused == list(range(100, 200))
    assert result.counts.tolist() == [100]


def test_fixes_once_a_minute_of_a_fast_ship_are_used() -> None:
    track = 25.0 * 60 * np.column_stack((np.arange(200.0), np.zeros(200)))
    assert screened(fixes(track, 60.0 * np.arange(200)))[1] == []


def test_a_channel_without_samples_has_no_usable_fix() -> None:
    screen = FixScreen()
    screen.add(fixes(straight()).part(0, 0))
    assert screen.result(SPEED).usable == 0

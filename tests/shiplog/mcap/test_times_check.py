"""Tests of the check whether times need a repair, on blocks of samples."""

import numpy as np
import pytest
from mcap import records

from shiplog.mcap.contents import McapContents, SampleBlock
from shiplog.mcap.times_check import TimesCheck

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
CONTENTS = McapContents(
    channels={id_: records.Channel(id_, "/rudder/test", "protobuf", {}, 1) for id_ in (1, 2)}
)


def need_repair(received: np.ndarray, measured: np.ndarray, block: int, *, ids: int = 1) -> bool:
    """Check the times in blocks of some samples, of channels that take turns within a block."""
    check = TimesCheck()
    for number, at in enumerate(range(0, len(received), block)):
        rows = np.arange(at, min(at + block, len(received)))
        blocks = {
            1 + k: [SampleBlock(received[part], measured[part], [], number, 40 * part)]
            for k in range(ids)
            if len(part := rows[k::ids])
        }
        check.add(blocks, CONTENTS)
    return check.need_repair()


def clocks() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    measured = START + np.arange(300) * SECOND // 10
    return measured + rng.integers(0, 20_000_000, 300), measured


@pytest.mark.parametrize("block", [1, 7, 300])
@pytest.mark.parametrize("ids", [1, 2])
def test_steady_clocks_and_pauses_need_none(block: int, ids: int) -> None:
    received, measured = clocks()
    pause = np.where(np.arange(300) >= 150, 3600 * SECOND, 0)
    assert not need_repair(received, measured, block, ids=ids)
    assert not need_repair(received + pause, measured + pause, block, ids=ids)


@pytest.mark.parametrize("block", [1, 7, 100, 300])
@pytest.mark.parametrize("ids", [1, 2])
@pytest.mark.parametrize("at", [3, 150, 297])
@pytest.mark.parametrize("size", [-3600, -2, 2, 3600])
def test_a_step_of_either_clock_anywhere_needs_one(
    block: int, ids: int, at: int, size: int
) -> None:
    received, measured = clocks()
    step = np.where(np.arange(300) >= at, size * SECOND, 0)
    assert need_repair(received, measured + step, block, ids=ids)
    if size < 0:
        assert need_repair(received + step, measured + step, block, ids=ids)


@pytest.mark.parametrize("time", [0, -1, START + 400 * 86_400 * SECOND])
def test_a_time_that_is_not_set_or_impossible_needs_one(time: int) -> None:
    received, measured = clocks()
    measured[100] = time
    assert need_repair(received, measured, 50)


def test_no_samples_need_none() -> None:
    assert not TimesCheck().need_repair()

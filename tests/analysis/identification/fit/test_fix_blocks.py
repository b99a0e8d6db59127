"""Mean velocities between blocks of fixes: exact for the track that the fixes are of."""

import numpy as np
import pytest

from analysis.identification.fit.fix_blocks import (
    course_at_start,
    fix_blocks,
    simulated_track,
    simulated_track_derivatives,
)
from shiplog.types import FloatArray

DT = 0.5


def motion(n: int = 400) -> FloatArray:
    """Outputs of a turning ship that drifts."""
    time = np.arange(n) * DT
    yaw_rate = 0.01 * np.sin(time / 15)
    heading = 0.3 + np.concatenate(([0.0], np.cumsum(yaw_rate[:-1]) * DT))
    return np.column_stack((yaw_rate, 7 - 0.2 * np.cos(time / 20), -30 * yaw_rate, heading))


def test_velocities_of_fixes_are_those_of_the_simulated_track_though_blocks_average() -> None:
    track = simulated_track(motion(), DT, (0.0, 0.0))
    drift = np.arange(len(track))[:, None] * DT * np.array([0.3, -0.2])
    blocks = fix_blocks(track, DT, 10.0)
    exact, moved = blocks.velocities(track), blocks.velocities(track + drift)
    np.testing.assert_allclose(
        (moved - exact)[blocks.at], np.tile([0.3, -0.2], (len(blocks.at), 1))
    )
    speeds = np.hypot(*exact[blocks.at].T)
    assert np.all((speeds > 6.5) & (speeds < 7.5))


def test_no_velocity_reaches_across_a_gap_of_the_fixes() -> None:
    track = simulated_track(motion(), DT, (0.0, 0.0))
    track[100:200] = np.nan
    blocks = fix_blocks(track, DT, 10.0)
    velocities = blocks.velocities(np.nan_to_num(track))
    at = blocks.at[(blocks.at >= 200) & (blocks.at < 220)]
    assert np.isnan(velocities[at]).all()
    assert np.isfinite(velocities[blocks.at]).any(axis=1).sum() > 10


def test_an_antenna_at_the_bow_moves_with_the_turn() -> None:
    outputs = motion()
    at_midship = simulated_track(outputs, DT, (0.0, 0.0))
    at_bow = simulated_track(outputs, DT, (100.0, 0.0))
    heading = outputs[:, 3]
    arm = 100.0 * np.column_stack((np.cos(heading), np.sin(heading)))
    np.testing.assert_allclose(at_bow - at_midship, arm - arm[0], atol=0.3)


def test_derivatives_of_the_track_are_those_by_differences() -> None:
    rng = np.random.default_rng(2)
    outputs, by = motion(), rng.normal(size=(400, 4, 3)) * 0.01
    derivatives = simulated_track_derivatives(outputs, by, DT, (20.0, -3.0))
    for k in range(3):
        up, down = (
            simulated_track(outputs + side * 1e-4 * by[:, :, k], DT, (20.0, -3.0))
            for side in (1, -1)
        )
        np.testing.assert_allclose(derivatives[:, :, k], (up - down) / 2e-4, atol=1e-5)


@pytest.mark.parametrize("fixes", [np.full((5, 2), np.nan), np.zeros((1, 2)), np.zeros((0, 2))])
def test_too_few_fixes_give_no_velocity_and_no_course(fixes: FloatArray) -> None:
    blocks = fix_blocks(fixes, DT, 10.0)
    assert not np.isfinite(blocks.velocities(fixes)).any()
    assert course_at_start(fixes) == 0.0

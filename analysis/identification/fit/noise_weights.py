"""The standard deviations by which a fit weights residuals: first guesses, then estimates."""

from collections.abc import Sequence
from math import radians

import numpy as np

from shiplog.types import FloatArray

from .fix_blocks import GROUND_VELOCITY
from .least_squares import ResidualStd
from .problem import Problem
from .residual_noise import (
    MIN_WHITE_SHARE,
    OutputResiduals,
    ResidualNoise,
    fit_residual_noise,
    interval_secs,
)

MIN_STDS = {  # of any instrument: rad/s, m/s, m/s, rad
    "yaw_rate": radians(1e-5), "speed": 1e-4, "sway": 1e-4, "heading": radians(0.02),
    "velocity_north": 0.005, "velocity_east": 0.005,
}  # fmt: skip
NOT_PROPORTIONAL = ("heading", *GROUND_VELOCITY)


def initial_residual_stds(problem: Problem) -> list[ResidualStd]:
    """Return residual standard deviations for a first fit, for each segment.

    A tenth of each output's standard deviation, at least `MIN_STDS`.
    """
    stds = []
    for column, output in enumerate(problem.outputs):
        measured = np.concatenate(
            [problem.measured(i)[:, column] for i in range(len(problem.segments))]
        )
        stds.append(max(float(np.nanstd(measured)) / 10, MIN_STDS[output]))
    row = np.array(stds)
    return [
        ResidualStd(np.tile(row, (len(segment), 1)), np.tile(row, (len(segment), 1)))
        for segment in problem.segments
    ]


def estimate_noise(
    problem: Problem, z: FloatArray, share: float = MIN_WHITE_SHARE
) -> tuple[list[ResidualNoise], list[ResidualStd]]:
    """Estimate the noise from the residuals.

    Parameters
    ----------
    problem
        The problem.
    z
        (m,) unknowns.
    share
        As of `fit_residual_noise`.

    Returns
    -------
    noises
        Of each output. The heading's has no part in proportion to the heading.
    residual_stds
        Of each segment.
    """
    segments = range(len(problem.segments))
    levels = [problem.predicted(z, i) for i in segments]
    residual = [problem.measured(i) - levels[i] for i in segments]
    noises = [
        fit_residual_noise(
            [
                OutputResiduals.of(
                    residual[i][:, c], levels[i][:, c], problem.segments[i].dt_secs
                )
                for i in segments
            ],
            proportional=output not in NOT_PROPORTIONAL, least=MIN_STDS[output], share=share,
        )
        for c, output in enumerate(problem.outputs)
    ]  # fmt: skip
    return noises, [_segment_stds(problem, i, noises, levels[i]) for i in segments]


def _segment_stds(
    problem: Problem, i: int, noises: Sequence[ResidualNoise], level: FloatArray
) -> ResidualStd:
    """Return the standard deviations of segment i, whose predicted outputs are `level`, (n, c)."""
    measured, dt = problem.measured(i), problem.segments[i].dt_secs
    pairs = [
        noise.stds(level[:, c], interval_secs(measured[:, c], dt)) for c, noise in enumerate(noises)
    ]
    return ResidualStd(
        np.column_stack([p[0] for p in pairs]), np.column_stack([p[1] for p in pairs])
    )

"""Logs of a simulated linear system, and systems of text."""

import numpy as np
from channels import channel
from scipy.signal import lsim

from shiplog.types import FloatArray, TrialLog

DT = 0.1


def log_of(**values: FloatArray) -> TrialLog:
    """Return a log of channels of 10 Hz by name, NaN being no sample."""
    channels = []
    for name, samples in values.items():
        known = np.isfinite(samples)
        channels.append(channel(samples[known], DT * np.flatnonzero(known), name))
    return TrialLog("made.mcap", tuple(channels))


def response(
    A: FloatArray, B: FloatArray, u: FloatArray, x0: FloatArray, dt: float = DT
) -> FloatArray:
    """Return the states (n, s) from x0 under inputs (n, r) that vary linearly between samples."""
    s, r = B.shape
    C, D = np.eye(s), np.zeros((s, r))
    _, _, states = lsim((A, B, C, D), u, dt * np.arange(len(u)), x0, interp=True)
    return np.reshape(states, (len(u), s))

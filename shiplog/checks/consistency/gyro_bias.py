"""Bias of the yaw rate against the heading: a biased gyro drifts away from the compass."""

from collections.abc import Iterator

import numpy as np

from shiplog.units import conversion_factor

from .coarse_record import CoarseSignals
from .findings import Finding

BLOCKS = 8  # stretches of a record, each of which gives an estimate of the bias
SIGNIFICANT_ERRORS = 4.0  # standard errors by which a bias must differ from zero
MIN_DRIFT = np.radians(1.0)  # rad over the whole record: a smaller drift does not matter


def bias_findings(signals: CoarseSignals) -> Iterator[Finding]:
    """Report an integrated yaw rate that drifts away from the heading.

    The record is divided into blocks. In each, the bias is the difference between the integral of
    the yaw rate and the change of the heading, over the block's length. The estimate is the mean
    over the blocks, its standard error follows from their scatter. Blocks with a gap in either
    channel are not used.

    Parameters
    ----------
    signals
        The channels of the log.

    Yields
    ------
    Finding
        The bias, its effect and the remedy; nothing where the two agree, where a channel is
        missing, or where too few blocks are complete.
    """
    difference = signals.yaw - signals.heading
    known = np.flatnonzero(np.isfinite(difference))
    if len(known) < 4 * BLOCKS:
        return
    edges = np.linspace(known[0], known[-1], BLOCKS + 1).round().astype(int)
    gaps = np.concatenate(([0], np.cumsum(np.isnan(difference))))
    complete = gaps[edges[1:] + 1] == gaps[edges[:-1]]
    lengths = np.diff(edges) * signals.dt_secs
    biases = (np.diff(difference[edges]) / lengths)[complete]
    if len(biases) < BLOCKS // 2:
        return
    bias = float(np.mean(biases))
    error = float(np.std(biases, ddof=1)) / np.sqrt(len(biases))
    drift = abs(bias) * len(difference) * signals.dt_secs
    if abs(bias) < SIGNIFICANT_ERRORS * error or drift < MIN_DRIFT:
        return
    bias_deg, error_deg = (x * conversion_factor("rad/s", "deg/s") for x in (bias, error))
    yield Finding(
        "bias",
        "yaw_rate",
        f"{signals.topics['yaw_rate']}: bias of {bias_deg:+.4f} ± {2 * error_deg:.1g} deg/s "
        "against the heading; a bias acts like a yaw moment and distorts b1, b2, b3 and e: "
        "calibrate the gyro, subtract the bias, or estimate it in a replay by --sensor-bias auto",
    )

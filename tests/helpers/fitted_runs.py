"""Simulated runs of the paper's ship and the fits to them, each computed once."""

from functools import cache

from trial_logs import as_log

from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.segment import Segment, split_into_segments
from analysis.identification.fit.uncertainty import Uncertainty, uncertainty
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import load_vessel, resample
from shiplog.ships import ship_model

CHANNELS = ("yaw_rate", "speed", "rudder", "rpm")
TRUE = load_vessel("table1")[0].coefficients._asdict()


@cache
def a_trial(manoeuvre: str = "zigzag-20-20", seed: int = 3, seconds: float = 400.0) -> Segment:
    """Return a simulated manoeuvre with white noise as the segment of a fit."""
    vessel = load_vessel("table1")[0]
    trial = simulate(vessel, manoeuvre, duration_secs=seconds, seed=seed, sensors=suite("white"))
    return split_into_segments(resample(as_log(trial, "t"), channels=CHANNELS), "t")[0]


@cache
def fitted(model: str = "burylin", runs: int = 1) -> tuple[OutputError, Uncertainty]:
    """Return the fit of a model to one or more zigzags, and its uncertainty."""
    fixed = {"T3": 0.5} if model == "burylin-tied" else {}
    segments = [a_trial(seed=3 + i) for i in range(runs)]
    fit = output_error(segments, ship_model(model), fixed=fixed)
    return fit, uncertainty(fit)

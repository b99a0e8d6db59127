"""The tanker KVLCC2: her circle predicted from her zig-zags alone, in the tool's own way."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from io import BytesIO
from math import degrees, radians
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.identification.prediction import zigzag_overshoots
from analysis.identification.runs import run_from_log
from analysis.identification.validation import Validation, validate
from shiplog import TrialLog, Vessel, load_vessel
from shiplog.tables.foreign import read_table
from shiplog.tables.layout import load_layout
from shiplog.types import FloatArray

PROJECT = Path(__file__).resolve().parents[1]
KVLCC2 = PROJECT.parent / "shared" / "data" / "kvlcc2"
VESSEL: Vessel = replace(load_vessel("table1")[0], name="KVLCC2", length=320.0)
MARIN = ("marin/MARIN_FREE_KVLCC2_zz_10_m.dat", "marin/MARIN_FREE_KVLCC2_zz_20_m.dat")
HSVA = tuple(
    f"hsva/HSVA_CPMC_KVLCC2_Z_{run}.dat"
    for run in ("10_05", "10_10_P", "20_05", "20_10_S", "30_05", "35_05")
)
CIRCLE = "marin/MARIN_FREE_KVLCC2_tc_35_m.dat"
GOALS = {  # per cent, from MARIN's zig-zags and from HSVA's
    "advance": (3, 6), "transfer": (10, 10), "tactical diameter": (5, 5),
    "time to 90°": (4, 5), "time to 180°": (None, None), "steady yaw rate": (6, 6),
    "steady speed": (10, 10),
}  # fmt: skip
OVERSHOOTS = {10: (9.39, 15.11), 20: (15.59, 12.81)}  # MARIN's, degrees beyond 10 and 20
EXECUTES = {10: 10.11, 20: 20.85}  # degrees off, at which her rudder began to go back
FIRST_OVERSHOOT = 2.0  # degrees it may be off
SPEEDS = {10: 7.97, 20: 8.11}  # m/s, of those runs as they began
APPROACH = {"rudder_rate": radians(2.32), "rpm": 91.7, "duration_secs": 700.0}
INTRODUCTION = """
## A tanker's circle from her zig-zags

The model tests of the KVLCC2 (SIMMAN 2008: MARIN, full-scale values; HSVA, scaled by Froude's law),
length 320 m stated, nothing else. The model is the one that `--model auto` takes by
cross-validation over the zig-zags; the circle is MARIN's at 35°, and no fit has seen it. It is
simulated open loop under its recorded rudder and revolutions from how it began, and counted from
where the rudder leaves its rest by 0.5°. What misses its goal is set bold."""
CAUTION = """
**These figures are not wholly blind.** The model with three degrees of freedom got its flow
straightening at the rudder, its drift's drag and its thrust that grows as she slows while its
errors on this very circle were in sight. Its parameters and the choice among the models come from
the zig-zags alone. A second attempt was blind: some forty variants (other inflow and stall of the
rudder, wake lost in drift, thrust and race tied by momentum, the screw's asymmetry, uneven
cross-flow, wider and narrower priors) were judged by how zig-zags predict harder ones, by somebody
who had neither the circle nor its figures. Only narrower priors of the surge were worth keeping,
for a gain of 5 % on the harder zig-zags and next to none here.

**What is missed, and why.** The speed in the steady circle, and the yaw rate with it. At the
constant revolutions of these tests the balance of thrust and drag in the circle is near-singular:
1 % in the drag is 3 % in the speed and 6 % in the yaw rate. The zig-zags do not go there; what the
model says of that speed is prior to a good part (`w`, `x4`, `g`, `p` are not identifiable from
them, and the tool says so). The data's own floor is about 1.5 % in advance and 3 % in tactical
diameter; the best figures published on them are 2 % and 3 to 6 %."""


OVERSHOT = """
Beyond 10° and 20°; goal of the first ones: 2°. MARIN's fit and the one from both were made from
these zig-zags among others; HSVA's has seen neither. Under the recorded rudder the ships differ by
the model and by the rudder's zero, which no other run tells: she is unstable on a straight course,
and half a degree of it moves an overshoot by degrees. Steered by her own heading she corrects
herself: the simulated ship is given the approach and the execute of the test, whose rudder began
to go back at 10.11° and at 20.85°."""


def tanker(figures: Path) -> None:
    """Print the section and draw its picture."""
    print(INTRODUCTION)
    circle = _log(CIRCLE)
    zigzags = [_log(run) for run in MARIN]
    found = {}
    for said, runs in (("MARIN", MARIN), ("HSVA", HSVA), ("both", (*MARIN, *HSVA))):
        logs = [_log(run) for run in runs]
        found[said] = identify(logs, "auto", vessel=VESSEL, validation_logs=[circle])
    print("\n| cross-validation score, % | " + " | ".join(found) + " |\n|---|---|---|---|")
    for name in [c.model.name for c in next(iter(found.values())).candidates]:
        print(f"| {name} | {' | '.join(_score(each, name) for each in found.values())} |")
    print("\n| off, % of the measured | measured | MARIN | goal | HSVA | goal | both |")
    print("|---|---|---|---|---|---|---|")
    for row in _circle_rows(found):
        print(f"| {' | '.join(row)} |")
    print("\n| overshoot | measured | MARIN | HSVA | both |\n|---|---|---|---|---|")
    for row in (*_sailed_rows(found, zigzags), *_overshoot_rows(found)):
        print(f"| {' | '.join(row)} |")
    print(OVERSHOT)
    print(CAUTION)
    _draw(found, figures / "kvlcc2.png")
    print(
        "\n![KVLCC2, 35° circle: predicted over measured](images/accuracy/kvlcc2.png)\n\n"
        "*The 35° circle: measured, and predicted from zig-zags alone.*"
    )


def _log(path: str) -> TrialLog:
    layout = PROJECT / "sample_data" / "layouts" / f"simman_{path.split('/', maxsplit=1)[0]}.toml"
    return read_table(KVLCC2 / path, load_layout(layout))


def _score(found: IdentifiedShip, name: str) -> str:
    (candidate,) = [c for c in found.candidates if c.model.name == name]
    said = f"{100 * candidate.score:.0f}" if candidate.fit else "runs away"
    return f"**{said}**" if name == found.model.name else said


def _circle(found: IdentifiedShip) -> Validation:
    return found.validations[0]


def _circle_rows(found: dict[str, IdentifiedShip]) -> Iterator[tuple[str, ...]]:
    figures = {said: _circle(each).indices for said, each in found.items()}
    shown = {"rad/s": (degrees(1), "°/s"), "m": (1.0, "m"), "s": (1.0, "s"), "m/s": (1.0, "m/s")}
    for marin, hsva, both in zip(*figures.values(), strict=True):
        factor, unit = shown[marin.unit]
        first, second = GOALS[marin.name]
        cells = [100 * figure.error / figure.measured for figure in (marin, hsva, both)]
        yield (
            marin.name, f"{marin.measured * factor:.4g} {unit}",
            _held(cells[0], first), f"{first or ''}", _held(cells[1], second), f"{second or ''}",
            f"{cells[2]:+.1f}",
        )  # fmt: skip


def _held(value: float, most: float | None) -> str:
    said = f"{value:+.1f}"
    return f"**{said}**" if most is not None and abs(value) > most else said


def _sailed_rows(
    found: dict[str, IdentifiedShip], zigzags: list[TrialLog]
) -> Iterator[tuple[str, ...]]:
    """The overshoots under the rudder as it was recorded."""
    for angle, log in zip(OVERSHOOTS, zigzags, strict=True):
        run = run_from_log(log)
        figures = [
            {figure.name: figure for figure in validate(each.fit, run)[0].indices}
            for each in found.values()
        ]
        for k, name in enumerate(("first", "second")):
            both = [each[f"overshoot {k + 1}"] for each in figures]
            measured = degrees(both[0].measured)
            cells = [_overshoot([degrees(f.simulated)] * (k + 1), k, measured) for f in both]
            yield (f"{angle}/{angle}, {name}, recorded rudder", f"{measured:.2f}°", *cells)


def _overshoot_rows(found: dict[str, IdentifiedShip]) -> Iterator[tuple[str, ...]]:
    """The same steered by her own heading."""
    for angle, measured in OVERSHOOTS.items():
        execute, late = radians(EXECUTES[angle]), EXECUTES[angle] - angle
        said = [
            late
            + np.degrees(
                zigzag_overshoots(
                    each.fit, radians(-angle), execute, speed=SPEEDS[angle], **APPROACH
                )
            )
            for each in found.values()
        ]
        for k, name in enumerate(("first", "second")):
            cells = [_overshoot(each, k, measured[k]) for each in said]
            yield (f"{angle}/{angle}, {name}, own heading", f"{measured[k]}°", *cells)


def _overshoot(said: Sequence[float] | FloatArray, k: int, measured: float) -> str:
    """Only the first is held to a goal."""
    if len(said) <= k:
        return "none"
    missed = k == 0 and abs(said[k] - measured) > FIRST_OVERSHOOT
    return f"**{said[k]:.1f}°**" if missed else f"{said[k]:.1f}°"


def _draw(found: dict[str, IdentifiedShip], path: Path) -> None:
    mpl.use("Agg")
    colours = dict(zip(found, ("#2a6f97", "#e09f3e", "#3a7d44"), strict=True))
    figure, (track, rate, speed) = plt.subplots(
        1, 3, figsize=(11, 3.9), constrained_layout=True, width_ratios=(1.25, 1, 1)
    )
    measured = _circle(found["MARIN"])
    time = measured.segment.signals.time_secs
    length = VESSEL.length or 1.0
    until = int(np.searchsorted(time, 1000.0))
    grey = {"color": "#8d99ae", "lw": 4, "label": "measured"}
    track.plot(*(measured.measured_track[:until, ::-1].T / length), **grey)
    rate.plot(time[:until], np.degrees(measured.segment.measured[:until, 0]), **grey)
    speed.plot(time[:until], measured.segment.measured[:until, 1], **grey)
    for said, each in found.items():
        line = {"color": colours[said], "lw": 1.4, "label": f"from {said}'s zig-zags"}
        if said == "both":
            line["label"] = "from both"
        circle = _circle(each)
        track.plot(*(circle.track[:until, ::-1].T / length), **line)
        rate.plot(time[:until], np.degrees(circle.simulated[:until, 0]), **line)
        speed.plot(time[:until], circle.simulated[:until, 1], **line)
    track.set(aspect="equal", xlabel="east, lengths", ylabel="north, lengths", title="track")
    rate.set(xlabel="time, s", ylabel="yaw rate, °/s", title="yaw rate")
    speed.set(xlabel="time, s", ylabel="speed ahead, m/s", title="speed")
    track.legend(frameon=False, fontsize=8)
    for axes in (track, rate, speed):
        axes.grid(color="#e5e5e5")
        axes.spines[["top", "right"]].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    shot = BytesIO()
    figure.savefig(shot, format="png", dpi=110)
    Image.open(shot).convert("RGB").quantize(64).save(path, optimize=True)

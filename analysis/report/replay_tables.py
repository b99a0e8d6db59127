"""What a replay found as tables and words: for the terminal, and for Rerun's page."""

from math import degrees, isfinite, pi

import numpy as np

from analysis.disturbance.observer import DISTURBANCE_UNITS
from analysis.replay.plan import FITTED_MODEL
from analysis.replay.replay import Findings
from analysis.replay.residuals import OutputResiduals
from analysis.view.series import BAND_STDS
from shiplog.units import CATALOGUE, conversion_factor

from .section import Section, markdown_page

DISTURBANCES = {
    "rudder": "yaw, as rudder",
    "yaw": "yaw",
    "yaw_wave": "yaw, wave",
    "surge": "surge",
    "surge_wave": "surge, wave",
}


def replay_tables(findings: Findings) -> tuple[Section, ...]:
    """The summary as tables, in the units people use, and its verdicts in words."""
    return (
        _log_section(findings),
        _filter_section(findings),
        _disturbance_section(findings),
        _coefficient_section(findings),
        *_change_sections(findings),
    )


def replay_markdown(findings: Findings) -> str:
    """The summary as a page of text."""
    log, *found = replay_tables(findings)
    # what was found first: a page is read from its top
    return markdown_page(findings.plan.name, (*found, log), findings.warnings)


def _log_section(findings: Findings) -> Section:
    log_stats, rows = findings.plan.log_stats, []
    for channel in log_stats:
        rate = f"{1 / channel.interval_secs:.3g} Hz" if channel.interval_secs else ""
        gaps = "none"
        if channel.gaps:
            longest = max(length for _, length in channel.gaps)
            gaps = f"{len(channel.gaps)}, the longest {longest:.1f} s"
        rows.append((channel.topic, f"{channel.samples}", rate, gaps))
    start = np.datetime64(log_stats.span_ns[0], "ns").astype("M8[s]")
    title = f"Log, {log_stats.duration_secs:.0f} s from {start} UTC"
    return Section(title, ("channel", "samples", "rate", "gaps"), tuple(rows))


def _filter_section(findings: Findings) -> Section:
    fitted = findings.plan.model_is_fitted
    model = (
        FITTED_MODEL if fitted else f"{findings.plan.vessel.name} ({findings.plan.model_origin})"
    )
    rows, remarks = [], [f"Model: {model}.", _chosen(findings)]
    for residuals in findings.residuals:
        unit = CATALOGUE[residuals.name].display_unit
        rms = residuals.rms * conversion_factor(residuals.unit, unit)
        rows.append(
            (
                f"{residuals.name} [{unit}]",
                f"{rms:.3g}",
                f"{residuals.normalised_squared:.4g}",
                f"{residuals.whiteness_p:.2g}",
                f"{residuals.gated}",
            )
        )
        remarks.append(_verdict(residuals))
    columns = ("output", "innovation rms", "normalised, squared (1)", "whiteness p", "gated")
    return Section("Filter", columns, tuple(rows), tuple(remarks))


def _chosen(findings: Findings) -> str:
    """Which filter it was, in words."""
    settings, wave = findings.plan.vessel.filter, findings.plan.noise.wave
    smoothed = ", smoothed from the end back" if settings.smooth else ""
    said = f"Filter: {settings.chosen}{smoothed}; gated: off by over {settings.gate:g} σ."
    if wave is None:
        return said
    return (
        f"{said} Waves of {degrees(wave.std):.2g} deg/s rms about {wave.frequency:.3g} rad/s "
        f"({2 * pi / wave.frequency:.3g} s) are told from the ship's turning."
    )


def _verdict(residuals: OutputResiduals) -> str:
    size = ""
    if not residuals.consistent:
        larger = residuals.normalised_squared > residuals.expected[1]
        size = f"; they are {'larger' if larger else 'smaller'} than the noise assumed"
    if residuals.white is None:
        return f"{residuals.name}: the innovations cannot be told to be white or not{size}."
    if residuals.white:
        return f"{residuals.name}: innovations are white (test at 1 %){size}."
    return (
        f"{residuals.name}: innovations are NOT white (test at 1 %){size}: "
        "the model or the noise does not explain the data."
    )


def _disturbance_section(findings: Findings) -> Section:
    rows = []
    slow = {"constant", "ramp"} & set(findings.plan.disturbance_settings.models)
    for name, label in DISTURBANCES.items():
        if name not in findings.disturbances or not (slow or name.endswith("wave")):
            continue
        course, (_, unit, scale) = findings.disturbances[name], DISTURBANCE_UNITS[name]
        values = (course.mean, course.rms, course.last, course.std)
        rows.append(
            (f"{label} [{unit}]", *(f"{v * scale:.3g}" if isfinite(v) else "" for v in values))
        )
    columns = ("disturbance", "mean", "rms", "at the end", "std by noise")
    caution = (
        "As rudder: the angle that would do the same at the speed then. "
        "The std is by sensor noise alone; an error of the model counts as a disturbance."
    )
    remarks = [f"Models: {_observed(findings)}.", caution]
    if findings.plan.model_is_fitted:
        remarks.append("The model was fitted to this log: this is what it leaves unexplained.")
    return Section("Disturbance observed", columns, tuple(rows), tuple(remarks))


def _observed(findings: Findings) -> str:
    """Which disturbances were looked for, in words."""
    settings = findings.plan.disturbance_settings
    said = [model for model in dict.fromkeys(settings.models) if model != "wave"]
    if "wave" in settings.models and settings.wave_frequency is not None:
        said.append(f"a wave of {settings.wave_frequency:.3g} rad/s")
    return ", ".join(said)


def _coefficient_section(findings: Findings) -> Section:
    model, rows = findings.plan.vessel.paper_coefficients._asdict(), []
    for found in (findings.yaw, findings.surge):
        for name, coefficient in found.coefficients.items():
            value, std = f"{coefficient.value:.4g}", f"{coefficient.std:.2g}"
            if not coefficient.determined:
                value, std = "not determined", f"{coefficient.std:.2g}" if std != "nan" else ""
            rows.append((name, value, std, coefficient.unit, f"{model[name]:.4g}"))
    if findings.plan.model_is_fitted:  # beside itself it would only seem confirmed
        rows = [(*row[:-1], "") for row in rows]
    remark = (
        f"Condition of the scaled regressors: yaw {findings.yaw.condition:.0f}, "
        f"surge {findings.surge.condition:.0f}. "
        "Not determined: the log cannot tell it from the others, or not even its sign. "
        "Two standard deviations are about a 95 % interval, less where a few seconds tell all. "
        "A gyro's bias goes into b1, b2, b3 and e."
    )
    remarks = [remark]
    if any(residuals.gated for residuals in findings.residuals):
        remarks.append("Gated samples are in this fit all the same: spikes spoil b1, b2, b3 and e.")
    if findings.plan.model_is_fitted:
        remarks.append(
            "With no model the rudder is taken to work in proportion to the speed (α = 1, 0, 0): "
            "d and e are not to be laid beside those of a vessel whose slipstream is known."
        )
    columns = ("coefficient", "from this log", "std", "unit", "in the model")
    return Section("Coefficients", columns, tuple(rows), tuple(remarks))


def _change_sections(findings: Findings) -> tuple[Section, ...]:
    """What changed within the trial; nothing where nothing did."""
    rows = [
        (
            f"{change.name} [{change.unit}]",
            f"{change.at_secs:.0f} s",
            f"{change.before:.3g} ± {BAND_STDS * change.before_std:.2g}",
            f"{change.after:.3g} ± {BAND_STDS * change.after_std:.2g}",
            change.by.removeprefix("by ").replace(" %", "", 1) if isfinite(change.share) else "",
        )
        for change in findings.changes
    ]
    if not rows:
        return ()
    remark = (
        "A coefficient that differs before and after says that the ship did, her loading, the "
        "depth or the weather, or that the model does not hold for both; over the whole trial it "
        "is a mixture. Each by itself, ±2σ; the difference with its 95 % interval."
    )
    remarks = [remark]
    remarks += [
        f"At {change.at_secs:.0f} s {' or '.join(change.instead)} may have changed in place of "
        f"{change.name}: the log cannot tell which."
        for change in findings.changes
        if change.instead
    ]
    columns = ("coefficient", "at", "before", "after", "difference")
    return (Section("Changes within the trial", columns, tuple(rows), tuple(remarks)),)

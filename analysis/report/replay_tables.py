"""The results of a replay as tables and sentences, for the terminal and for Rerun."""

from collections.abc import Iterator, Sequence
from math import degrees, isfinite, pi

import numpy as np

from analysis.replay.replay_results import Findings
from analysis.replay.residuals import MIN_CORRELATION, SIGNIFICANCE, ResidualSummary
from shiplog.checks.channel_stats import LogStats
from shiplog.checks.event_table import event_table
from shiplog.ships.paper import PAPER_OUTPUTS
from shiplog.text_table import TextTable
from shiplog.units import display_conversion

from .display import BAND_STDS, DISTURBANCES
from .further_tables import further_tables
from .markdown import markdown_page

MIN_PRINTED_P = 1e-9  # below it the exact p-value is of no use


def replay_tables(findings: Findings) -> tuple[TextTable, ...]:
    """Return the results of a replay as tables in the units people use.

    Returns
    -------
    tuple of TextTable
        The log, the filter's residuals, the sensor errors and the current where they are
        estimated, the disturbances and the coefficients; then the changes of coefficients within
        the trial and the events, where there are any.
    """
    return (
        log_table(findings.plan.log_stats),
        *finding_tables(findings),
        *_event_tables(findings),
    )


def finding_tables(findings: Findings) -> tuple[TextTable, ...]:
    """Return what a replay estimates as tables, without those of the log itself."""
    return (
        _residual_table(findings),
        *further_tables(findings),
        _disturbance_table(findings),
        _coefficient_table(findings),
        *_change_tables(findings),
    )


def replay_markdown(findings: Findings) -> str:
    """Return the results of a replay as a page in Markdown, the table of the log last."""
    log, *results = replay_tables(findings)
    return markdown_page(findings.plan.name, (*results, log), findings.warnings)


def _event_tables(findings: Findings) -> tuple[TextTable, ...]:
    if not findings.events:
        return ()
    return (event_table(findings.events, findings.plan.log_stats.span_ns[0]),)


def log_table(log_stats: LogStats) -> TextTable:
    """Return the channels of a log with their rates and gaps."""
    rows = []
    for channel in log_stats:
        rate = f"{1 / channel.interval_secs:.3g} Hz" if channel.interval_secs else ""
        gaps = "held" if channel.hold else "none"
        if channel.gaps:
            longest = max(length for _, length in channel.gaps)
            gaps = f"{len(channel.gaps)}, longest {longest:.1f} s"
        rows.append((channel.topic, f"{channel.samples}", rate, gaps))
    start = np.datetime64(log_stats.span_ns[0], "ns").astype("M8[s]")
    title = f"Log: {log_stats.duration_secs:.0f} s from {start} UTC"
    return TextTable(title, ("channel", "samples", "rate", "gaps"), tuple(rows))


def _residual_table(findings: Findings) -> TextTable:
    rows = []
    for residuals in findings.residuals:
        unit, factor = display_conversion(residuals.name, residuals.unit)
        rms = residuals.rms * factor
        low, high = residuals.nis_band
        cells = (
            f"{_words(residuals.name)} [{unit}]",
            f"{rms:.3g}",
            f"{residuals.mean_nis:.3f}" if residuals.judged else "not judged",
            f"{max(low, 0.0):.2f}–{high:.2f}" if residuals.judged else "",
            *whiteness_cells(residuals),
            f"{residuals.rejected}",
        )
        rows.append(cells)
    columns = (
        "output", "rms", "mean\nNIS", "expected\n(99 %)",
        "white\np", "ρ", "lag\n[s]", "gated",
    )  # fmt: skip
    judged = findings.residuals[: len(PAPER_OUTPUTS)], findings.residuals[len(PAPER_OUTPUTS) :]
    remarks = (
        *_filter_remarks(findings),
        *map(residual_remark, judged[0]),
        *_further_remarks(findings, judged[1]),
    )
    return TextTable("Filter residuals", columns, tuple(rows), remarks)


def _further_remarks(findings: Findings, residuals: Sequence[ResidualSummary]) -> Iterator[str]:
    """Describe the innovations of heading and position.

    Where they are smaller than expected, the noise assumed contains slow errors of the sensor that
    its samples do not show: that is intended, and such innovations need not be white.
    """
    stds = findings.plan.noise.further.output_stds
    yield from (residual_remark(r) for r in residuals if not r.small)
    assumed = [
        f"{_words(r.name)} {std * factor:.2g} {unit}"
        for r, std in zip(residuals, stds, strict=True)
        if r.small
        for unit, factor in [display_conversion(r.name, r.unit)]
    ]
    if assumed:
        keys = dict.fromkeys(
            "filter.heading_std" if r.name == "heading" else "filter.position_std"
            for r in residuals
            if r.small
        )
        yield (
            f"Innovations smaller than the noise assumed, which allows for slow errors of the "
            f"sensor: {', '.join(assumed)}; change it by {' and '.join(keys)}."
        )


def whiteness_cells(residuals: ResidualSummary) -> tuple[str, str, str]:
    """Return p-value, largest correlation and its lag; empty where whiteness was not tested."""
    if residuals.white is None:
        return "", "", ""
    return (
        f"{residuals.whiteness_p:.1g}" if residuals.whiteness_p > MIN_PRINTED_P else "<1e-9",
        f"{residuals.correlation:.2f}",
        f"{round(residuals.correlation_lag_secs, 2):g}",
    )


def _filter_remarks(findings: Findings) -> Iterator[str]:
    """Describe the model, the filter and the wave, and explain the table."""
    plan = findings.plan
    origin = plan.model_origin
    model = origin if plan.model_is_fitted else f"{plan.vessel.name} ({origin})"
    settings, wave = plan.vessel.filter, plan.noise.wave
    smoothed = ", smoothed backwards from the end" if settings.smooth else ""
    yield f"Model: {model}."
    yield f"Filter: {settings.chosen}{smoothed}."
    if wave is not None:
        yield (
            f"Waves of {degrees(wave.std):.2g} deg/s rms at {wave.frequency:.3g} rad/s (period "
            f"{2 * pi / wave.frequency:.3g} s) are separated from the ship's own turning."
        )
    yield (
        "Innovation: measured minus predicted. NIS: its square over the variance that the filter "
        "expects. ρ: the largest correlation of the innovations with those before, and its lag. "
        f"Gated: rejected, as further than {settings.gate:g} σ from the prediction."
    )


def residual_remark(residuals: ResidualSummary) -> str:
    """Describe the size and the whiteness of an output's innovations in a sentence."""
    name = _words(residuals.name)
    if not residuals.judged:
        return f"{name}: innovations not judged, since the measurement is constant or missing."
    size = "as large as expected"
    if not residuals.consistent:
        larger = residuals.mean_nis > residuals.nis_band[1]
        size = f"{'larger' if larger else 'smaller'} than expected"
    if residuals.white is None:
        return f"{name}: innovations {size}; too few samples to test whether they are white."
    if not residuals.white:
        return (
            f"{name}: innovations {size} and NOT white (test at 1 %): the model or the noise does "
            "not explain the data."
        )
    if residuals.whiteness_p >= SIGNIFICANCE:
        return f"{name}: innovations {size} and white (test at 1 %)."
    return (
        f"{name}: innovations {size} and nearly white: their correlation is significant (test at "
        f"1 %), but below {MIN_CORRELATION:g}."
    )


def _disturbance_table(findings: Findings) -> TextTable:
    settings, rows = findings.plan.disturbance_settings, []
    slow = {"constant", "ramp"} & set(settings.models)
    for key, (name, unit, scale) in DISTURBANCES.items():
        if key not in findings.disturbances or not (slow or key.endswith(("wave", "wind"))):
            continue
        summary = findings.disturbances[key]
        values = (summary.mean, summary.rms, summary.at_end, summary.noise_std)
        cells = (f"{value * scale:.3g}" if isfinite(value) else "" for value in values)
        rows.append((f"{name} [{unit}]", *cells))
    smoothed = findings.plan.noise.further.yaw is not None
    std = "std" if smoothed else "std from\nsensor noise"
    columns = ("disturbance of", "mean", "rms", "at the end", std)
    models = [model for model in dict.fromkeys(settings.models) if model != "wave"]
    if "wave" in settings.models and settings.wave_frequency is not None:
        models.append(f"wave of {settings.wave_frequency:.3g} rad/s")
    explanation = (
        "Yaw, as rudder angle: the rudder that would have the same effect at the speed of that "
        "moment. Errors of the model count as disturbances."
    )
    method = ", states of the filter and smoothed with them" if smoothed else ""
    remarks = [f"Disturbance models: {', '.join(models)}{method}.", explanation]
    further = findings.plan.noise.further
    remarks += [
        f"{name}: no slow disturbance; Akaike's criterion of the innovations is "
        f"{force.reduction:.2g} lower without one."
        for name, force in (("yaw", further.yaw), ("surge", further.surge))
        if force is not None and force.reduction > 0
    ]
    if findings.plan.model_is_fitted:
        remarks.append("The model was fitted to this log: this is what it does not explain.")
    return TextTable("Disturbances", columns, tuple(rows), tuple(remarks))


def _coefficient_table(findings: Findings) -> TextTable:
    plan, rows = findings.plan, []
    model = plan.vessel.paper_coefficients._asdict()
    for fit in (findings.yaw, findings.surge):
        for name, coefficient in fit.coefficients.items():
            std = f"{coefficient.std:.2g}" if isfinite(coefficient.std) else ""
            value = f"{coefficient.value:.4g}" if coefficient.determined else "not determined"
            # beside the model fitted to the same log the value would only seem confirmed
            in_model = "" if plan.model_is_fitted else f"{model[name]:.4g}"
            rows.append((name, value, std, coefficient.unit, in_model))
    columns = ("coefficient", "from this log", "std", "unit", "in the model")
    return TextTable("Coefficients", columns, tuple(rows), tuple(_coefficient_remarks(findings)))


def _coefficient_remarks(findings: Findings) -> Iterator[str]:
    """Explain the table of coefficients."""
    yield (
        "Least squares over the whole trial; condition number of the scaled regressors: yaw "
        f"{findings.yaw.condition:.0f}, surge {findings.surge.condition:.0f}. Two standard "
        "deviations are about a 95 % interval, less where few seconds hold all the information. "
        "Not determined: the data do not separate it from the other coefficients, or not even its "
        "sign is certain. A bias of the gyro goes into b1, b2, b3 and e."
    )
    if any(residuals.rejected for residuals in findings.residuals):
        yield (
            "Samples rejected by the filter are used in this fit all the same: they distort b1, "
            "b2, b3 and e."
        )
    if findings.plan.model_is_fitted:
        yield (
            "Without a model the rudder is taken to act in proportion to the speed (α = 1, 0, 0): "
            "d and e cannot be compared with those of a vessel whose slipstream is known."
        )


def _change_tables(findings: Findings) -> tuple[TextTable, ...]:
    """Return a table of the coefficients that changed within the trial; none if none did."""
    if not findings.changes:
        return ()
    rows = tuple(
        (
            f"{change.name} [{change.unit}]",
            f"{change.at_secs:.0f} s",
            f"{change.before:.3g} ± {BAND_STDS * change.before_std:.2g}",
            f"{change.after:.3g} ± {BAND_STDS * change.after_std:.2g}",
            change.description.removeprefix("by ").replace(" %", "", 1)
            if isfinite(change.relative_change)
            else "",
        )
        for change in findings.changes
    )
    explanation = (
        "A coefficient differs before and after where the ship, its loading, the depth or the "
        "weather changed, or where the model does not hold for both parts; the value over the "
        "whole trial is then a mixture. Values ± 2σ, difference with its 95 % interval."
    )
    remarks = [explanation]
    remarks += [
        f"At {change.at_secs:.0f} s {' or '.join(change.alternatives)} may have changed instead of "
        f"{change.name}: the data do not show which."
        for change in findings.changes
        if change.alternatives
    ]
    columns = ("coefficient", "at", "before", "after", "difference")
    return (TextTable("Changes within the trial", columns, rows, tuple(remarks)),)


def _words(name: str) -> str:
    return name.replace("_", " ")

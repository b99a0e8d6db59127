"""The page of a report: complete, safe against what files contain, and readable without sight."""

import re
from collections import Counter
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest
from trial_reports import circle, reported_log, trial_report, zigzag

from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreSeries
from analysis.report.page.report_page import report_page
from analysis.trial.trial_analysis import TrialConditions

HOSTILE = '<script>alert("x")</script> \x1b[2J\u202e$x_1$ &amp; "><img src=x onerror=alert(1)>'


class Elements(HTMLParser):
    """The elements of a page, and the text of the elements that are open."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.headings: list[tuple[int, str]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if re.fullmatch("h[1-6]", tag):
            self.headings.append((int(tag[1]), ""))

    def handle_data(self, data: str) -> None:
        self.text += data
        tag = self.found[-1][0] if self.found else ""
        if re.fullmatch("h[1-6]", tag):
            level, text = self.headings[-1]
            self.headings[-1] = (level, text + data.strip())

    def attributes(self, name: str) -> list[str]:
        return [attrs[name] or "" for _, attrs in self.found if name in attrs]


@cache
def page() -> str:
    return report_page(trial_report())


@cache
def elements() -> Elements:
    return Elements(page())


def test_the_page_refers_to_nothing_outside_itself_and_has_no_script() -> None:
    links = [
        value for name in ("href", "src", "xlink:href") for value in elements().attributes(name)
    ]
    assert links
    assert all(link.startswith(("#", "data:")) for link in links), links
    assert not re.search(r"url\((?!#)|@import", page())
    assert "script" not in {tag for tag, _ in elements().found}
    assert "default-src 'none'" in page()


def test_the_same_report_gives_the_same_page() -> None:
    assert report_page(trial_report()) == page()


def test_every_id_occurs_once_and_every_reference_has_its_target() -> None:
    ids = Counter(elements().attributes("id"))
    assert [name for name, count in ids.items() if count > 1] == []
    references = [
        name for value in elements().attributes("aria-labelledby") for name in value.split()
    ]
    references += [
        value[1:]
        for name in ("href", "xlink:href")
        for value in elements().attributes(name)
        if value.startswith("#")
    ]
    references += re.findall(r"url\(#([^)]*)\)", page())
    assert [name for name in references if name not in ids] == []


def test_headings_descend_by_one_level_and_figures_have_titles_and_descriptions() -> None:
    levels = [level for level, _ in elements().headings]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    figures = page().split("<figure")[1:]
    assert len(figures) == 5 + 2  # a track and histories of each circle, the zig-zag's, both sides
    assert all("<title" in each and "<desc" in each and "figcaption" in each for each in figures)


def test_every_figure_fits_on_a_printed_page_and_is_not_divided() -> None:
    heights = [float(text) for text in re.findall(r'viewBox="0 0 504 ([\d.]+)"', page())]
    assert len(heights) == page().count("<svg")
    assert max(heights) < 11.69 * 72 - 2 * 72  # A4 without its margins and the section's head
    assert re.search(r"figure \{[^}]*break-inside: avoid", page())


def test_every_table_has_a_caption_and_headers_with_a_scope() -> None:
    tables = page().split("<table")[1:]
    assert all("<caption>" in each for each in tables)
    assert all(attrs.get("scope") for tag, attrs in elements().found if tag == "th")


def test_verdicts_stand_in_words_with_value_interval_limit_and_paragraph() -> None:
    glance = page().split("Verdict at a glance")[1].split("<h2")[0]
    for text in ("612.3 m", "596.6 to 628.0 m", "4.5 L", "5.3.1", "meets", "no verdict"):
        assert text in glance
    assert "no stopping test was sailed" in glance
    assert "not decided by this trial" in page().split('aria-labelledby="manoeuvre-3"')[1]


def test_what_was_not_recorded_is_a_blank_line_and_ratios_are_computed() -> None:
    form = page().split('id="conditions"')[1].split("<h2")[0]
    assert form.count("not recorded") > 10
    assert re.search(r"L/V</th><td>25\.0 s", form)
    assert re.search(r"Trim</th><td>0\.6 m by the stern", form)


def test_manoeuvres_to_both_sides_are_compared_with_port_mirrored() -> None:
    assert "Tracks aligned at the execute: Turning circle 35°; port mirrored" in page()
    assert "Zig-zag 10°/10°" not in page().split('id="comparisons"')[1].split("<h2")[0]


def test_many_manoeuvres_of_a_kind_stand_in_tables_that_fit_on_a_page() -> None:
    many = report_page(trial_report(reported_log(*[circle() for _ in range(6)])))
    titles = re.findall(r"<caption>(Indices side by side[^<]*)", many)
    assert [title.partition("manoeuvres ")[2] for title in titles] == ["1, 2, 3, 4", "5, 6"]


def test_what_could_not_be_computed_is_named_with_the_reason() -> None:
    assert "initial turning distance, track: the log has no positions" in page()
    assert "no channel &#39;yaw_rate&#39; in trial.mcap" in page()


def test_the_page_states_version_command_and_hash() -> None:
    origin = page().split('id="origin"')[1]
    for text in ("1.2.3", "shiplog report trial.mcap -o report.html", "ab" * 32):
        assert text in origin


def test_texts_of_a_file_are_shown_and_never_run() -> None:
    log = reported_log(replace(circle(), title=HOSTILE, notes=(HOSTILE,)), name=HOSTILE)
    stated = replace(log.trial.conditions, ship=HOSTILE, stated={"loading": HOSTILE})
    log = replace(log, trial=replace(log.trial, conditions=stated, warnings=(HOSTILE,)))
    hostile = Elements(report_page(trial_report(log)))
    assert {"script", "img"} & {tag for tag, _ in hostile.found} == set()
    assert not any("onerror" in attrs for _, attrs in hostile.found)
    assert "\x1b" not in hostile.text
    assert "\u202e" not in hostile.text
    assert r"\x1b[2J\u202e$x_1$" in hostile.text


@pytest.mark.parametrize(
    "manoeuvre",
    [
        replace(circle(), series=ManoeuvreSeries(np.arange(3.0))),
        replace(circle(), series=ManoeuvreSeries(np.empty(0))),
        replace(circle(), series=replace(circle().series, heading_change=np.empty(0))),
        replace(circle(), series=replace(circle().series, track=np.full((560, 2), np.nan))),
        replace(zigzag(), indices=(), execute_secs=np.nan),
    ],
    ids=["no channel", "no sample", "no heading", "no position", "no index"],
)
def test_a_manoeuvre_that_lacks_data_still_has_its_section(manoeuvre: object) -> None:
    log = reported_log(manoeuvre)  # type: ignore[arg-type]
    log = replace(log, trial=replace(log.trial, conditions=TrialConditions()))
    text = Elements(report_page(trial_report(log))).text
    assert "1. Turning circle" in text or "1. Zig-zag" in text
    assert "nan" not in text.lower().replace("administration", "")


def test_a_log_without_manoeuvres_gives_a_page_that_states_it() -> None:
    assert "No manoeuvre was found." in report_page(trial_report(reported_log()))


def test_logs_that_differ_have_their_conditions_side_by_side() -> None:
    first, second = reported_log(circle()), reported_log(zigzag(), name="second.mcap")
    faster = replace(second.trial.conditions, test_speed=10.0)
    second = replace(second, trial=replace(second.trial, conditions=faster))
    text = report_page(trial_report(first, second))
    assert re.search(r"L/V</th><td>25\.0 s \(log 1\); 20\.0 s \(log 2\)", text)
    assert "2. Zig-zag" in text

"""The page in a browser: accessible, silent, alone, and printed on A4."""

import json
import os
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from predicted_ships import ship_with_positions
from trial_reports import trial_report

from analysis.report.page.browser_pdf import OPTIONS, find_browser, print_pdf
from analysis.report.page.report_page import report_page
from shiplog.errors import ShiplogError

AXE_VARIABLE = "SHIPLOG_AXE"  # the path of axe.min.js
SECS = 300.0


@cache
def page() -> str:
    return report_page(replace(trial_report(), identified=ship_with_positions()))


@pytest.fixture
def browser() -> str:
    try:
        return find_browser()
    except ShiplogError as error:
        pytest.skip(f"no browser of the kind of Chromium is installed ({error})")


def axe_script() -> str:
    """Return the script of axe-core, installed by npm for all projects or named by a variable."""
    named = os.environ.get(AXE_VARIABLE)
    if named is None and shutil.which("npm"):
        root = subprocess.run(["npm", "root", "-g"], capture_output=True, text=True, check=False)
        named = f"{root.stdout.strip()}/axe-core/axe.min.js"
    if not named or not Path(named).is_file():
        pytest.skip(f"axe-core is not installed (npm install -g axe-core, or {AXE_VARIABLE})")
    return Path(named).read_text(encoding="utf-8")


def run_browser(browser: str, folder: Path, page: str, *options: str) -> tuple[str, str]:
    """Open a page without a window; return what is on stdout, and the messages."""
    path = folder / "page.html"
    path.write_text(page, encoding="utf-8")
    command = [browser, *OPTIONS, f"--user-data-dir={folder}/profile", *options, path.as_uri()]
    if os.geteuid() == 0:
        command.insert(1, "--no-sandbox")
    result = subprocess.run(
        command, capture_output=True, text=True, timeout=SECS, check=True, stdin=subprocess.DEVNULL
    )
    return result.stdout, result.stderr


@pytest.mark.parametrize("is_dark", [False, True], ids=["light", "dark"])
def test_axe_finds_no_fault_of_accessibility(browser: str, tmp_path: Path, is_dark: bool) -> None:
    script = axe_script()
    tested = re.sub("<meta http-equiv[^>]*>", "", page())
    if is_dark:
        assert "screen and (prefers-color-scheme: dark)" in tested
        tested = tested.replace("screen and (prefers-color-scheme: dark)", "screen")
    report = "document.body.replaceChildren(JSON.stringify(result.violations))"
    run = f"axe.run().then(result => {{ {report}; document.title = 'done' }})"
    tested += f"<script>{script}</script><script>{run}</script>"
    dom, _ = run_browser(browser, tmp_path, tested, "--virtual-time-budget=60000", "--dump-dom")
    assert "<title>done</title>" in dom
    body = dom[dom.index("<body>") + len("<body>") : dom.index("</body>")]
    found = json.loads(body.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
    assert [(each["id"], each["impact"], each["nodes"][0]["html"]) for each in found] == []


def test_the_console_stays_empty(browser: str, tmp_path: Path) -> None:
    dom, messages = run_browser(browser, tmp_path, page(), "--enable-logging=stderr", "--dump-dom")
    assert "Verdict at a glance" in dom
    assert "CONSOLE" not in messages


def test_the_page_requests_nothing(browser: str, tmp_path: Path) -> None:
    names = "performance.getEntriesByType('resource').map(entry => entry.name)"
    script = f"onload = () => document.body.replaceChildren(JSON.stringify({names}))"
    tested = re.sub("<meta http-equiv[^>]*>", "", page()) + f"<script>{script}</script>"
    dom, _ = run_browser(browser, tmp_path, tested, "--virtual-time-budget=5000", "--dump-dom")
    assert "<body>[]</body>" in dom


@pytest.mark.usefixtures("browser")
def test_the_printed_page_is_a_pdf_on_a4(tmp_path: Path) -> None:
    print_pdf(page(), tmp_path / "report.pdf")
    content = (tmp_path / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF")
    sizes = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)", content)
    assert sizes
    assert all(abs(float(w) - 595) < 2 and abs(float(h) - 842) < 2 for w, h in sizes)
    assert [path.name for path in tmp_path.iterdir()] == ["report.pdf"]


def test_without_a_browser_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("SHIPLOG_BROWSER", raising=False)
    with pytest.raises(ShiplogError, match="open the page and print it"):
        find_browser()


def test_a_browser_that_fails_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing = tmp_path / "browser"
    failing.write_text("#!/bin/sh\nexit 7\n", encoding="utf-8")
    failing.chmod(0o755)
    monkeypatch.setenv("SHIPLOG_BROWSER", str(failing))
    with pytest.raises(ShiplogError, match="exit code 7"):
        print_pdf("<p>", tmp_path / "report.pdf")
    assert [path.name for path in tmp_path.iterdir()] == ["browser"]

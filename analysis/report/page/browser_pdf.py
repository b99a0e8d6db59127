"""Printing of a page to PDF by a Chromium browser that is installed, without a window."""

import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from shiplog.errors import ShiplogError
from shiplog.files import atomic_write

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "microsoft-edge",
    "msedge",
    "chrome",
)
BROWSER_VARIABLE = "SHIPLOG_BROWSER"  # of the environment: the path of a browser of this kind
MAX_SECS = 300.0
OPTIONS = (
    "--headless",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND",  # nothing of the browser's own leaves, either
    "--no-pdf-header-footer",
)


def find_browser() -> str:
    """Return the path of an installed Chromium, Chrome or Edge.

    Raises
    ------
    ShiplogError
        None is on the search path, and `SHIPLOG_BROWSER` names none.
    """
    names = (os.environ.get(BROWSER_VARIABLE, ""), *BROWSERS)
    found = next(filter(None, (shutil.which(name) for name in names if name)), None)
    if found is None:
        raise ShiplogError(
            "a PDF is printed by Chromium, Chrome or Edge, and none was found; install one, name "
            f"it in the variable {BROWSER_VARIABLE}, or open the page and print it"
        )
    return found


def print_pdf(page: str, path: str | os.PathLike[str]) -> None:
    """Print a page to a PDF file on A4.

    Parameters
    ----------
    page
        The text of an HTML page.
    path
        The PDF file; it appears when it is complete.

    Raises
    ------
    ShiplogError
        There is no browser, it fails, or the file cannot be written.
    """
    browser = find_browser()
    with TemporaryDirectory(prefix="shiplog-") as folder, atomic_write(path) as part:
        source, printed = Path(folder, "report.html"), Path(folder, "report.pdf")
        source.write_text(page, encoding="utf-8")
        options = [*OPTIONS, f"--user-data-dir={folder}/profile", f"--print-to-pdf={printed}"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:  # its sandbox does not run as root
            options.append("--no-sandbox")
        _run([browser, *options, source.as_uri()], printed)
        part.write_bytes(printed.read_bytes())


def _run(command: list[str], printed: Path) -> None:
    """Run the browser; raise `ShiplogError` where it writes no file."""
    try:
        result = subprocess.run(  # noqa: S603 - a browser that the user installed
            command, capture_output=True, timeout=MAX_SECS, check=False, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        reason = f"no end after {MAX_SECS:.0f} s" if not isinstance(error, OSError) else str(error)
        raise ShiplogError(
            f"the browser printed no PDF ({reason}); open the page and print it: {command[0]}"
        ) from error
    if result.returncode or not printed.is_file():
        raise ShiplogError(
            f"the browser printed no PDF (exit code {result.returncode}); open the page and print "
            f"it: {command[0]}"
        )

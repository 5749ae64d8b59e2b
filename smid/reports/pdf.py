"""A page as PDF, printed by Chromium, which keeps figures as vectors and shows MathML."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import warnings
from pathlib import Path

from relaxations.writing import write_bytes

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
TIMEOUT = 60.0  # seconds
# The page asks nothing from a network; these options keep the browser itself from asking.
_OPTIONS = ("--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync")


class PdfWarning(UserWarning):
    """Warning that no PDF could be printed; the HTML page is written.

    Examples
    --------
    To make it an error:

    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", PdfWarning)
    """


def find_browser() -> str | None:
    """Return the path of the first of chromium, chromium-browser, google-chrome and chrome; None if there is none."""
    return next((path for path in map(shutil.which, BROWSERS) if path), None)


def print_pdf(page: Path, target: Path) -> bool:
    """Print an HTML page to a PDF file; return whether it was written, and warn with the cause if not."""
    browser = find_browser()
    if browser is None:
        _warn(page, "no Chromium was found: install one (Debian: apt install chromium), or print from your own browser")
        return False
    # A browser that was ended may still write to its profile.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        printed = Path(folder) / "printed.pdf"
        # As root, for example in a container, Chromium runs only without its sandbox. The page is our own.
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        command = [browser, *_OPTIONS, *(["--no-sandbox"] if root else []), f"--user-data-dir={folder}/profile"]
        command += ["--no-pdf-header-footer", f"--print-to-pdf={printed}", page.resolve().as_uri()]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
        except subprocess.TimeoutExpired:
            _warn(page, f"{browser} did not print within {TIMEOUT:g} s: try again, or print from your own browser")
            return False
        if not printed.is_file():
            last = (run.stderr.strip().splitlines() or [f"exit code {run.returncode}"])[-1]
            _warn(page, f"{browser} failed ({last}): print from your own browser")
            return False
        write_bytes(target, printed.read_bytes())
    return True


def _warn(page: Path, why: str) -> None:
    warnings.warn(f"no PDF: {why}; the page is in {page}", PdfWarning, stacklevel=3)

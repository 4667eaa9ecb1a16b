"""Debian's Chromium without a window, which notes what a page complains of and what it asks for."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

TIMEOUT = 120_000
"""Milliseconds after which an action counts as failed, on a machine that is busy with other tests."""


@dataclass
class Opened:
    """A page in the browser.

    Attributes:
        page: The page.
        complaints: Errors of its console, and exceptions.
        asked: Addresses outside the page that it asked for.
    """

    page: Page
    complaints: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser that the system has; `make test` installs it."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        try:
            yield browser
        finally:
            browser.close()


def opened(browser: Browser, path: Path, *, width: int = 1400, **context: object) -> Opened:
    """The file at `path` in a window of so many pixels; other arguments are those of `Browser.new_page`."""
    page = browser.new_page(viewport={"width": width, "height": 900}, **context)
    page.set_default_timeout(TIMEOUT)
    found = Opened(page)
    page.on("pageerror", lambda error: found.complaints.append(str(error)))
    page.on(
        "console", lambda message: found.complaints.append(message.text) if message.type == "error" else None
    )
    page.on(
        "request",
        lambda request: (
            found.asked.append(request.url)
            if not request.url.startswith(("file:", "data:", "blob:"))
            else None
        ),
    )
    page.goto(path.resolve().as_uri())
    return found

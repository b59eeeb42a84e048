"""A real headless Chromium for tests of pages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

DESKTOP, PHONE = (1280, 900), (390, 844)


@contextmanager
def chromium() -> Iterator[Browser]:
    """Start the system's Chromium; a test without it fails."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    assert path, "there is no Chromium: apt-get install chromium"
    with sync_playwright() as playwright:
        # root may start it in a container only without its sandbox
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@contextmanager
def opened(browser: Browser, path: Path, size: tuple[int, int] = DESKTOP) -> Iterator[Page]:
    """Open a page from a file; no request, no message on its console and no error may occur."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    trouble: list[str] = []
    page.on("console", lambda message: trouble.append(f"console: {message.text}"))
    page.on("pageerror", lambda error: trouble.append(f"error: {error}"))
    page.on(
        "request",
        lambda request: (
            trouble.append(f"request: {request.url[:100]}")
            if not request.url.startswith(("file:", "data:"))
            else None
        ),
    )
    page.goto(path.resolve().as_uri())
    yield page
    page.close()
    assert not trouble


def overflows(page: Page) -> bool:
    """Whether the page is wider than the window."""
    wide = page.evaluate("document.documentElement.scrollWidth > innerWidth")
    return bool(wide)


def until(page: Page, condition: str, seconds: float = 20.0) -> None:
    """Wait until a condition holds; by asking, for the page lets nobody put scripts into it."""
    for _ in range(int(10 * seconds)):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"not within {seconds:.0f} s: {condition}")

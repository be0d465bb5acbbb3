"""A real browser: Chromium, driven by Playwright. Without them these tests are skipped.

``make panel`` runs them, in a process of its own: what drives the browser keeps an event loop
running, beside which no other test can run one.
"""

import os
import shutil

import pytest

from tests.panel.browser.scripted import ScriptedPanel

INSTALL = "apt-get install --no-install-recommends chromium fonts-noto-cjk; make panel"
"""What brings both."""

SIZES = {"1280": (1280, 800), "1024": (1024, 600)}


def missing() -> str:
    """Return what is not here; empty where a browser can be driven."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        return f"no chromium here ({INSTALL})"
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return f"Playwright for Python is not installed ({INSTALL})"
    return ""


@pytest.fixture(scope="session")
def chromium():
    """The browser; without one the test is skipped, or fails where one is needed."""
    if why := missing():
        if os.environ.get("NEED_CHROMIUM"):
            pytest.fail(why, pytrace=False)
        pytest.skip(why)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("chromium-browser"),
            # Chromium refuses to start as root with its sandbox.
            args=["--no-sandbox"] if os.geteuid() == 0 else [],
        )
        yield browser
        browser.close()


@pytest.fixture
def tablet(chromium):
    """A tablet: its pages share cookies and connections."""
    context = chromium.new_context(viewport={"width": 1280, "height": 800}, has_touch=True)
    context.set_default_timeout(15_000)
    yield context
    context.close()


@pytest.fixture
def panel(chromium):
    """A panel that shows what a test wants, and notes what comes from the page."""
    with ScriptedPanel() as made:
        yield made

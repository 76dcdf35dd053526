"""Headless Chromium for tests of pages, where Playwright and a browser are installed."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium: apt-get install chromium, and these tests run"
)
ARGUMENTS = ("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync")  # fmt: skip
DRAWING = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@contextmanager
def chromium(width: int, height: int, *, draws: bool = True) -> Iterator[Any]:
    """A browser with a profile of its own; the processor draws what a page ``draws`` by OpenGL."""
    sync_api = pytest.importorskip(
        "playwright.sync_api", reason="Playwright is not installed: the extra 'browser' has it"
    )
    arguments = [*ARGUMENTS, *(DRAWING if draws else ("--disable-gpu",))]
    with tempfile.TemporaryDirectory() as profile, sync_api.sync_playwright() as program:
        browser = program.chromium.launch_persistent_context(
            profile, executable_path=CHROMIUM, args=arguments, viewport={"width": width, "height": height}
        )
        yield browser
        browser.close()

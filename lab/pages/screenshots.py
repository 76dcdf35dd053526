"""Pictures of the report for the documentation, taken in the system's Chromium.
``python -m lab.pages.screenshots REPORT FOLDER [ASSET_ID]`` takes them."""

import shutil
import sys
import tempfile
from io import BytesIO
from pathlib import Path

from PIL import Image

from asset2sim.report.page_files import page_path
from schemas.errors import UsageError, exit_code_of

WIDTH, HEIGHT = 1180, 1250
QUALITY = 88
ARGUMENTS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
)
SHOWN = "storage_sideboard"


def chromium() -> str:
    """The system's Chromium. Raises UsageError where there is none."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if found := shutil.which(name):
            return found
    raise UsageError("no Chromium here; install it (apt-get install chromium) and try again")


def take(report: Path, folder: Path, asset_id: str = SHOWN) -> list[Path]:
    """Take the index and an object's page as WebP pictures into a folder. Raises UsageError where there is no report,
    no browser or no Playwright."""
    if not (report / "index.html").is_file():
        raise UsageError(f"no report in {report}; make flow, then make report, write one")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        raise UsageError("Playwright is not installed; the extra 'browser' has it") from error
    pages = {"report_index.webp": "index.html", "report_object.webp": page_path(asset_id)}
    with tempfile.TemporaryDirectory() as profile, sync_playwright() as program:
        browser = program.chromium.launch_persistent_context(
            profile, executable_path=chromium(), args=list(ARGUMENTS), viewport={"width": WIDTH, "height": HEIGHT}
        )
        page = browser.new_page()
        for name, address in pages.items():
            page.goto(f"{report.resolve().as_uri()}/{address}")
            if name == "report_index.webp":
                page.evaluate("document.getElementById('figures').scrollIntoView()")
            page.wait_for_timeout(1000)  # smooth scrolling, and pictures that load as they are seen
            with Image.open(BytesIO(page.screenshot())) as image:
                image.save(folder / name, quality=QUALITY, method=6)
        browser.close()
    return [folder / name for name in pages]


if __name__ == "__main__":
    source, pictures, *chosen = sys.argv[1:]
    sys.exit(exit_code_of("screenshots", lambda: 0 if take(Path(source), Path(pictures), *chosen) else 1))

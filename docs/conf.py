"""How Sphinx builds these pages: ``make docs``. Where ASSET2SIM_REPORT names a run's report, the gallery shows it."""

import os
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from lab.pages.gallery import FOLDER, MARK, cards  # noqa: E402

REPORT = ROOT / os.environ.get("ASSET2SIM_REPORT", "no report")

project = "Asset2Sim"
author = "the Asset2Sim authors"
extensions = ["myst_nb"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
# A notebook shows what it printed when it was run last: python -m lab.pages.notebook docs/try.ipynb
nb_execution_mode = "off"
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "Asset2Sim"
# Guidance of assets and SQL in examples is no code of a lexer's.
suppress_warnings = ["misc.highlighting_failure"]


def show_report(app, page, source):
    """Put the report's objects into the gallery."""
    if page == "gallery":
        source[0] = source[0].replace(MARK, cards(REPORT))


def copy_report(app, error):
    """Put the report beside the pages."""
    if error is None and REPORT.is_dir():
        shutil.copytree(REPORT, Path(app.outdir) / FOLDER, dirs_exist_ok=True)


def setup(app):
    """Have Sphinx call both."""
    app.connect("source-read", show_report)
    app.connect("build-finished", copy_report)

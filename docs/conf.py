"""How Sphinx builds these pages: ``make docs``."""

project = "Asset2Sim"
author = "the Asset2Sim authors"
extensions = ["myst_parser"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "Asset2Sim"
# Guidance of assets and SQL in examples is no code of a lexer's.
suppress_warnings = ["misc.highlighting_failure"]

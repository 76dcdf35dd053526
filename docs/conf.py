"""How Sphinx builds these pages: ``make docs``."""

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

"""The documentation's gallery: cards of a run's report, which lies in the folder ``report`` beside the pages."""

import html
import json
import re
from pathlib import Path

from asset2sim.report.page_files import FOLDER, page_path

MARK = "<!-- gallery -->"
"""The line of the gallery's page that stands for the cards."""
NO_REPORT = "*These pages were built without a report: `make flow`, then `make docs`.*"
DATA = re.compile(r'<script id="data" type="application/json">(.*?)</script>', re.DOTALL)
PICTURES = {"before.webp": "as it came", "after.webp": "refined"}


def cards(report: Path) -> str:
    """A card for each object of the report, with its pictures and a link to its page, as HTML; a sentence where there
    is no report."""
    index = report / "index.html"
    found = DATA.search(index.read_text(encoding="utf-8")) if index.is_file() else None
    if found is None:
        return NO_REPORT
    names = sorted(json.loads(found[1])["id"], key=lambda name: (name.startswith("planted"), name))
    return '<div class="gallery">\n' + "\n".join(card(report, name) for name in names) + "\n</div>"


def card(report: Path, asset_id: str) -> str:
    """One object's pictures, where the run drew them, and its name, which lead to its page."""
    page, name = page_path(asset_id), html.escape(asset_id)
    folder = f"{FOLDER}/{page}".rpartition("/")[0]
    shown = "".join(
        f'<img src="{folder}/{file}" alt="{name}, {said}" width="150" loading="lazy">'
        for file, said in PICTURES.items()
        if (report / "objects" / asset_id / file).is_file()
    )
    return f'<a href="{FOLDER}/{page}" style="display: inline-block; margin: 0.4em">{shown}<br>{name}</a>'

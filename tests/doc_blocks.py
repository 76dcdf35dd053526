"""Commands of the documentation: its fenced blocks, and walks that run them in order as a user would."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from tests.assets import ROOT

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
RUN = ("sh", "python")
"""Languages of blocks that can be run."""
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINKED = (
    *(".venv", "asset2sim", "flows", "tasks", "schemas", "lab", "tests", "examples", "docs", "Makefile"),
    *("pyproject.toml", "constraints.txt", "catalog.yaml", "prefect.yaml"),
)
"""What a walk sees of the checkout beside the samples; it writes into its own folder."""


class Block(NamedTuple):
    """A fenced block: its page's name, its place among the page's blocks that can be run, its language and its text."""

    page: str
    number: int
    language: str
    text: str


def blocks(page: Path) -> list[Block]:
    """The blocks of a page that can be run, in order."""
    found = [item.groups() for item in _BLOCK.finditer(page.read_text(encoding="utf-8")) if item[1] in RUN]
    return [Block(page.name, number, language, text) for number, (language, text) in enumerate(found)]


def checkout(folder: Path, asset_ids: tuple[str, ...]) -> Path:
    """A folder that looks like a fresh checkout with some of the samples. Raises KeyError for one that is not there."""
    folder.mkdir()
    for name in LINKED:
        (folder / name).symlink_to(ROOT / name)
    lines = (ROOT / "data/raw/manifest.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    rows = {line.split(",")[0]: line for line in lines[1:]}
    for asset_id in asset_ids:
        path = rows[asset_id].split(",")[2]
        shutil.copytree(ROOT / "data/raw" / path, folder / "data/raw" / path)
    chosen = "".join([lines[0], *(rows[asset_id] for asset_id in asset_ids)])
    (folder / "data/raw/manifest.csv").write_text(chosen, encoding="utf-8")
    return folder


def run_block(block: Block, folder: Path, environment: dict[str, str], replaced: dict[str, str], limit_s: float) -> str:
    """Run a block in ``folder`` as a user would type it; what it printed. Raises AssertionError where it fails."""
    text = block.text
    for old, new in replaced.items():
        text = text.replace(old, new)
    shell = ["bash", "-euo", "pipefail", "-c", text]
    command = shell if block.language == "sh" else [sys.executable, "-c", text]
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, **environment}, text=True, capture_output=True,
        timeout=limit_s, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    said = f"{block.page}, block {block.number}:\n{text}\n{done.stdout[-3000:]}{done.stderr[-3000:]}"
    assert done.returncode == 0, said
    assert "Traceback" not in done.stdout + done.stderr, said
    return done.stdout

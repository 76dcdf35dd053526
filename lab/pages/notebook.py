"""Run a notebook of the documentation from top to bottom: ``python -m lab.pages.notebook docs/try.ipynb``."""

import os
import re
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

CELL_S = 300
"""Longest that one cell may take, s: refining one object on a busy machine."""
_STYLE = re.compile("\x1b\\[[0-9;]*m")


def run_notebook(page: Path, root: Path, *programs: Path) -> nbformat.NotebookNode:
    """The notebook with the outputs of its cells as they are now, run in ``root``, texts without colours and without
    that folder's own path. Commands are those of the folders ``programs``, then those beside this Python. Raises
    CellExecutionError where a cell fails."""
    found: nbformat.NotebookNode = nbformat.read(page, as_version=4)
    path = os.pathsep.join([*map(str, programs), str(Path(sys.executable).parent), os.environ["PATH"]])
    client = NotebookClient(found, timeout=CELL_S, resources={"metadata": {"path": str(root)}}, coalesce_streams=True)
    client.execute(env=os.environ | {"PATH": path, "PYTHONWARNINGS": "ignore", "COLUMNS": "110"})
    for cell in found.cells:
        cell.metadata.pop("execution", None)
        for output in cell.get("outputs", ()):
            if output.output_type == "stream":
                output.text = _STYLE.sub("", output.text).replace(f"{root.resolve()}{os.sep}", "")
    return found


if __name__ == "__main__":
    nbformat.write(run_notebook(Path(sys.argv[1]), Path()), sys.argv[1])

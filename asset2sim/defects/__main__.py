"""``python -m asset2sim.defects OUT [NAME …]``: the bench, or those of its defects whose name holds one of the words.

Everything is made anew under ``OUT/defects``, with ``defects.json``; the table goes to the console. Ends with 1 where
too little is caught or mended.
"""

import shutil
import sys
from pathlib import Path

from asset2sim.defects.bench import SETTINGS, run
from asset2sim.defects.defects import DEFECTS
from asset2sim.defects.score import passes
from asset2sim.defects.table import as_json, text

FOLDER = "defects"
"""Under the output folder: what the bench makes."""


def to_stderr(line: str) -> None:
    """A line of progress."""
    sys.stderr.write(f"{line}\n")


def main(words: list[str]) -> int:
    """Run the bench and print its table."""
    if not words:
        sys.stderr.write("usage: python -m asset2sim.defects OUT [NAME ...]\n")
        return 2
    out = Path(words[0]) / FOLDER
    chosen = [defect for defect in DEFECTS if not words[1:] or any(word in defect.name for word in words[1:])]
    shutil.rmtree(out, ignore_errors=True)
    rows, unclean = run(chosen, out, SETTINGS, to_stderr)
    (out / "defects.json").write_text(as_json(rows, unclean), encoding="utf-8")
    sys.stdout.write(text(rows, unclean) + "\n")
    return 0 if passes(rows) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

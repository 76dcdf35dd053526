"""``make bench-defects``: plant known defects in clean objects, see what is caught and mended: OUT [WORD ...].

A WORD chooses the defects whose name has it. Everything is made anew under ``OUT/defects``, with ``defects.json``; the
table goes to the console. Ends with 1 where too little is caught or mended.
"""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from asset2sim.runs.alert import DONE, FAILED, run_program
from asset2sim.studies.defects.defect_results import passes, results_json, results_text
from asset2sim.studies.defects.defects import DEFECTS
from asset2sim.studies.defects.try_defects import SETTINGS, DefectBench, try_defects
from flows import PIPELINE
from schemas.errors import UnknownChoiceError, UsageError

FOLDER = "defects"
"""Under the output folder: what the bench makes."""


def tell(line: str) -> None:
    """A line of progress."""
    sys.stderr.write(f"{line}\n")


def bench_defects(words: Sequence[str]) -> int:
    """Run the bench and print its table. Returns the exit code."""
    if not words or words[0].startswith("-"):
        raise UsageError("usage: python -m flows.bench_defects OUT [WORD ...]")
    chosen = [defect for defect in DEFECTS if not words[1:] or any(word in defect.name for word in words[1:])]
    if not chosen:
        raise UnknownChoiceError("defect", " ".join(words[1:]), [defect.name for defect in DEFECTS])
    out = Path(words[0]) / FOLDER
    shutil.rmtree(out, ignore_errors=True)
    bench = DefectBench(out, SETTINGS, PIPELINE)
    rows, unclean = try_defects(chosen, bench, tell)
    (out / "defects.json").write_text(results_json(rows, unclean), encoding="utf-8")
    sys.stdout.write(results_text(rows, unclean) + "\n")
    return DONE if passes(rows) else FAILED


if __name__ == "__main__":
    sys.exit(run_program("bench_defects", lambda: bench_defects(sys.argv[1:])))

"""``make bench-defects``: plant known defects in clean objects, see what is caught and mended: OUT [WORD ...]. A WORD
chooses the defects whose name has it. Everything is made anew under ``OUT/defects``, with ``defects.json``; the table
goes to the console. Ends with 1 where too little is caught or mended."""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.option_types import Listed
from flows import PIPELINE
from lab.defects.defect_results import passes, results_json, results_text
from lab.defects.defects import DEFECTS
from lab.defects.try_defects import SETTINGS, DefectBench, try_defects
from schemas.errors import DONE, FAILED, UnknownChoiceError, exit_code_of

PROGRAM = "python -m lab.flows.bench_defects"
FOLDER = "defects"
"""Under the output folder: what the bench makes."""


def tell(line: str) -> None:
    """A line of progress."""
    sys.stderr.write(f"{line}\n")


class DefectOptions(Options):
    """Plant known defects in clean objects: what share is caught, and what is mended."""

    out: CliPositionalArg[Path] = Field(description=f"everything is made anew under OUT/{FOLDER}")
    words: CliPositionalArg[Listed[tuple[str, ...]]] = Field((), description="only defects whose name has such a word")


def bench_defects(options: DefectOptions) -> int:
    """Run the bench and print its table. Returns the exit code."""
    words = options.words
    chosen = [defect for defect in DEFECTS if not words or any(word in defect.name for word in words)]
    if not chosen:
        raise UnknownChoiceError("defect", " ".join(words), [defect.name for defect in DEFECTS])
    out = options.out / FOLDER
    shutil.rmtree(out, ignore_errors=True)
    bench = DefectBench(out, SETTINGS, PIPELINE)
    rows, unclean = try_defects(chosen, bench, tell)
    (out / "defects.json").write_text(results_json(rows, unclean), encoding="utf-8")
    sys.stdout.write(results_text(rows, unclean) + "\n")
    return DONE if passes(rows) else FAILED


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    return exit_code_of("bench_defects", lambda: bench_defects(parse(DefectOptions, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Try hostile inputs on the real command line, and print what became of them, kind by kind.

python -m tests.hostile --kinds links names --folder /tmp/hostile
"""

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from schemas.errors import DONE, FAILED
from tests.hostile.try_cases import Outcome, cases_of, kind_names, try_kind
from tests.ready import ready_in


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the chosen kinds, print their figures and every case that was not handled; 0 if there is none."""
    options = _parser().parse_args(arguments)
    base = Path(options.folder or tempfile.mkdtemp(prefix="asset2sim-hostile-")).resolve()
    rows, bad = [], []
    for kind in options.kinds:
        start = time.monotonic()
        cases = cases_of(kind, options.every)
        with ready_in(base / "ready") as words:
            outcomes = try_kind(kind, cases, base / kind, words)
        wrong = [outcome for outcome in outcomes if outcome.problems]
        bad += wrong
        lines = sum(1 for case in cases if not case.modes)
        figures = (len(cases), lines, len(cases) - lines, len(wrong), f"{time.monotonic() - start:.0f}")
        rows.append((kind, *map(str, figures)))
        sys.stdout.write("".join(f"{kind}: {told(outcome)}\n" for outcome in wrong))
        sys.stdout.flush()
    rows.append(("all", *(str(sum(int(row[column]) for row in rows)) for column in range(1, 6))))
    sys.stdout.write(table(rows))
    if options.folder is None and not bad:
        shutil.rmtree(base, ignore_errors=True)
    else:
        sys.stdout.write(f"datasets and outputs: {base}\n")
    return FAILED if bad else DONE


def told(outcome: Outcome) -> str:
    """A case that was not handled, on one line."""
    return f"{outcome.name!a} ended with {outcome.ended}; {'; '.join(outcome.problems)}"


def table(rows: Sequence[Sequence[str]]) -> str:
    """The figures as a table in Markdown."""
    head = ("kind", "cases", "one line expected", "a row expected", "not handled", "seconds")
    lines = [f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *rows)]
    return "\n".join(lines) + "\n"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("--kinds", nargs="+", choices=kind_names(), default=kind_names(), help="which kinds (all)")
    parser.add_argument("--every", type=int, default=1, help="only one of every N cases of a kind")
    parser.add_argument("--folder", help="where datasets and outputs go, and stay")
    return parser


if __name__ == "__main__":
    sys.exit(main())

"""What ``make bench`` is asked to measure."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from schemas.base import Frozen

PARTS = ("rates", "unchanged", "synthetic", "history", "checker")


class BenchRequest(Frozen):
    """A dataset, a folder to work in, and how much to measure; the defaults are those of the acceptance."""

    data: Path
    work: Path
    limit: int | None = None
    entries: int = 10_000
    few: int = 1_000
    rows: int = 1_000_000
    objects: int = 20
    interact: bool = True
    parts: tuple[str, ...] = PARTS
    strict: bool = False


def parse_request(words: Sequence[str]) -> BenchRequest:
    """The request of a command line; leaves with 2 for one that cannot be read."""
    default = BenchRequest(data=Path(), work=Path())
    parser = argparse.ArgumentParser(prog="python -m flows.bench", description="how fast a night is")
    add = parser.add_argument
    add("data", type=Path, metavar="DATA", help="the dataset")
    add("work", type=Path, metavar="WORK", help="a folder for everything that is made; bench.md and bench.json in it")
    add("--limit", type=int, metavar="N", help="only the dataset's first N objects")
    add("--entries", type=int, default=default.entries, metavar="N", help="synthetic entries (%(default)s)")
    add("--few", type=int, default=default.few, metavar="N", help="... against so many, for the memory (%(default)s)")
    add("--rows", type=int, default=default.rows, metavar="N", help="rows of history (%(default)s)")
    add("--objects", type=int, default=default.objects, metavar="N", help="objects to check (%(default)s)")
    add("--no-interaction", action="store_true", help="without interaction tests, to try the bench out")
    add("--only", action="append", choices=PARTS, help="measure this part; may be repeated")
    add("--strict", action="store_true", help="exit with 1 where a target is not met")
    chosen = parser.parse_args(words)
    return BenchRequest(
        data=chosen.data,
        work=chosen.work,
        limit=chosen.limit,
        entries=chosen.entries,
        few=chosen.few,
        rows=chosen.rows,
        objects=chosen.objects,
        interact=not chosen.no_interaction,
        parts=tuple(part for part in PARTS if part in chosen.only) if chosen.only else PARTS,
        strict=chosen.strict,
    )

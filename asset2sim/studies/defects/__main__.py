"""``python -m asset2sim.studies.defects OUT [NAME …]``: all planted defects, or those named by a word.

Everything is made anew under ``OUT/defects``, with ``defects.json``; the table goes to the console. Ends with 1 where
too little is caught or mended.
"""

import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from asset2sim.studies.defects.defect_results import CAUGHT_SHARE, MENDED_SHARE, Row, passes, share
from asset2sim.studies.defects.defects import DEFECTS
from asset2sim.studies.defects.try_defects import SETTINGS, run

SHOWN = 2
"""Signs named in one cell; the rest are counted."""
WIDEST = 60
"""Widest cell of the last columns, characters."""


def text(rows: Sequence[Row], unclean: Mapping[str, str]) -> str:
    """The table, the totals with their shares, and the objects that were left out."""
    cells = [("defect", "object", "caught by", "mended by", "s")]
    cells += [
        (
            row.defect,
            row.asset_id,
            listed(row.caught) or "NOT CAUGHT",
            listed(row.mended) if row.is_mended else f"not: {row.left}"[:WIDEST],
            f"{row.seconds:.1f}",
        )
        for row in rows
    ]
    widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
    lines = ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip() for line in cells]
    lines.insert(1, "  ".join("-" * width for width in widths))
    every = list(rows)
    lines += [
        "",
        f"caught {sum(row.is_caught for row in rows)} of {len(every)} ({share(every, mended=False):.0%}, at least "
        f"{CAUGHT_SHARE:.0%} wanted)",
        f"mended {sum(row.is_mended for row in rows)} of {len(every)} ({share(every, mended=True):.0%}, at least "
        f"{MENDED_SHARE:.0%} wanted)",
    ]
    lines += [f"left out: {name}, which is not clean: {why}" for name, why in unclean.items()]
    return "\n".join(lines)


def listed(words: Sequence[str]) -> str:
    """The first few words, and how many more there are."""
    more = f" + {len(words) - SHOWN}" if len(words) > SHOWN else ""
    return ", ".join(words[:SHOWN]) + more


def as_json(rows: Sequence[Row], unclean: Mapping[str, str]) -> str:
    """The shares, rows and left-out objects as JSON."""
    every = list(rows)
    return json.dumps(
        {
            "caught_share": share(every, mended=False),
            "mended_share": share(every, mended=True),
            "rows": [asdict(row) for row in rows],
            "left_out": dict(unclean),
        },
        indent=1,
        ensure_ascii=False,
    )


FOLDER = "defects"
"""Under the output folder: what the bench makes."""


def to_stderr(line: str) -> None:
    """A line of progress."""
    sys.stderr.write(f"{line}\n")


def main(words: list[str]) -> int:
    """Run the bench and print its table."""
    if not words:
        sys.stderr.write("usage: python -m asset2sim.studies.defects OUT [NAME ...]\n")
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

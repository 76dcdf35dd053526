"""The README's summary table from a run's catalog: ``python -m asset2sim.studies.readme.blocks OUT README``."""

import math
import sys
from pathlib import Path

import pandas as pd

from asset2sim.catalog.read import latest_rows
from schemas.errors import UsageError

BEGIN = "<!-- summary: begin (make summary) -->"
END = "<!-- summary: end -->"


def summary_block(out: Path) -> str:
    """The Markdown between the markers: the latest run's assets, and a line of totals."""
    rows, measured = latest_rows(out, "assets", "measurements")
    engines = measured.groupby("asset_id")["passed"].agg(["sum", "count"])
    lines = [
        "| asset | category | verdict | scale | mass kg | Φ mm | drift mm | drift rad | engines | calls | s |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [asset_line(row, engines) for _, row in rows.iterrows()]
    good = int((rows["status"] == "ok").sum())
    total = f"{good} of {len(rows)} ok; the others are planted defects, each with its cause in `findings`."
    return "\n".join(["`make flow`, the sample dataset:", "", *lines, "", total])


def asset_line(row: "pd.Series[str]", engines: pd.DataFrame) -> str:
    """One asset as a row of the table; a dash where nothing was measured.

    ``engines`` holds, by asset, in how many engines it passed (``sum``) and was measured (``count``).
    """
    verdict = row["status"] if row["status"] == "ok" else row["failure_mode"]
    cells = [str(row["asset_id"]), str(row["category"]), str(verdict)]
    cells += [number(row["scale"], ".3f"), number(row["mass_kg"], ".2f"), number(row["penetration_mm"], ".2f")]
    cells += [number(row["drift_m"], ".3f", 1e3), number(row["drift_rad"], ".4f")]
    judged = row["asset_id"] in engines.index
    cells.append("{sum} of {count}".format(**engines.loc[row["asset_id"]]) if judged else "–")
    cells.append(number(row["queries"], ".0f"))
    cells += [number(row["seconds_total"], ".1f")]
    return "| " + " | ".join(cells) + " |"


def number(value: object, form: str, factor: float = 1.0) -> str:
    """A number in a format, or a dash for none."""
    parsed = float(str(value)) if str(value) not in ("None", "<NA>") else math.nan
    return "–" if math.isnan(parsed) else format(parsed * factor, form)


def with_summary(text: str, block: str) -> str:
    """The README's text with the block between its markers. Raises UsageError where they are not there."""
    return with_block(text, block, BEGIN, END)


def with_block(text: str, block: str, begin: str, end: str) -> str:
    """A text with the block between two markers. Raises UsageError where they are not there."""
    if begin not in text or end not in text:
        raise UsageError(f"the README lacks the lines '{begin}' and '{end}'; put them where the block belongs")
    before, rest = text.split(begin, 1)
    return f"{before}{begin}\n\n{block}\n\n{end}{rest.split(end, 1)[1]}"


if __name__ == "__main__":
    target = Path(sys.argv[2])
    target.write_text(
        with_summary(target.read_text(encoding="utf-8"), summary_block(Path(sys.argv[1]))), encoding="utf-8"
    )

"""The reports as files: ``OUT/reports/<date>.md``, one a day, with the day's last run on top."""

import re
from pathlib import Path
from urllib.parse import quote

from asset2sim.catalog.run import RunRow
from asset2sim.catalog.switch import replace_file

REPORTS_FOLDER = "reports"
SITE_FOLDER = "report"
"""Folder of the report for people, relative to OUT."""

_MARK = re.compile(r"^<!-- run (\S+) -->\n", re.MULTILINE)


def report_path(out: Path, run: RunRow) -> Path:
    """Report file of the day on which the run started, in this machine's time zone."""
    return out / REPORTS_FOLDER / f"{run.started_at.astimezone():%Y-%m-%d}.md"


def page_path(asset_id: str) -> str:
    """Address of an asset's page in the report for people, relative to its folder."""
    return f"objects/{quote(asset_id, safe='')}/index.html"


def write_report(out: Path, run: RunRow, text: str) -> Path:
    """Put a run's report above the day's earlier ones, or in the place of its own earlier text; returns the file. A
    reader never sees half of it. The caller holds ``lock_output(out)``."""
    path = report_path(out, run)
    path.parent.mkdir(parents=True, exist_ok=True)
    earlier = _parts(path.read_text(encoding="utf-8")) if path.is_file() else []
    kept = [(run_id, part) for run_id, part in earlier if run_id != run.run_id]
    parts = [(run.run_id, text), *kept]
    whole = "\n---\n\n".join(f"<!-- run {run_id} -->\n{part.rstrip()}\n" for run_id, part in parts)
    staged = path.with_name(f".{path.name}.{run.run_id}")
    staged.write_text(whole, encoding="utf-8")
    replace_file(staged, path)
    return path


def _parts(text: str) -> list[tuple[str, str]]:
    """(run id, its report) of each run that a file holds, in the file's order."""
    pieces = _MARK.split(text)
    return [
        (run_id, part.rstrip().removesuffix("\n---").rstrip() + "\n")
        for run_id, part in zip(pieces[1::2], pieces[2::2], strict=True)
    ]

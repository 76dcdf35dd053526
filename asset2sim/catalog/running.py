"""A mark in OUT for as long as a run is at work there: one that was killed leaves it, and the next run finds it."""

import json
from datetime import UTC, datetime
from pathlib import Path

from asset2sim.catalog.run import RunRow

MARK = Path(".cache") / "running.json"


def begin_run(out: Path, run: RunRow) -> str | None:
    """Mark ``run`` as at work on OUT, whose lock the caller holds. Returns what is to be said of the run before it, a
    sentence, where that one never came to its end."""
    path = out / MARK
    left = _read(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"run_id": run.run_id, "started_at": run.started_at.isoformat()}), encoding="utf-8")
    return left


def end_run(out: Path) -> None:
    """Take the mark away: the run is published."""
    (out / MARK).unlink(missing_ok=True)


def _read(path: Path) -> str | None:
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    try:
        content = json.loads(text)
        started = datetime.fromisoformat(content["started_at"]).astimezone(UTC)
        which = f"the run before ({content['run_id']}, from {started:%Y-%m-%d %H:%M} UTC)"
    except (ValueError, TypeError, KeyError):  # it was killed at its first write
        which = "the run before"
    return f"{which} ended without a report: it broke down, was killed, or the machine went down"

"""The record of one dataset run: what was run, with which settings and versions, from when to when."""

import hashlib
import json
import platform
import re
import subprocess
import uuid
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Literal

from pydantic import AwareDatetime, Field

from schemas.base import Frozen
from schemas.settings import Settings
from schemas.vocabulary import DECIDING_PACKAGES, Engine

Outcome = Literal["finished", "interrupted"]

RECORDED_PACKAGES = (
    *("asset2sim", *DECIDING_PACKAGES, *(engine.value for engine in Engine), "yourdfpy", "pydantic", "litellm"),
    *("prefect", "dask", "distributed", "pyarrow", "duckdb", "pandas", "mlflow"),
)
"""Packages whose version can change a result or how it is kept."""

UNRECORDED_SETTINGS = {"run": {"hook"}}
"""Settings that no table and no log keeps: a hook may hold the secret address of a chat room."""

MARK = Path(".cache") / "running.json"
"""Marker of a run that has not finished, relative to OUT."""

MAX_SELECTION = 200
"""Characters of the ids that ``RunRow.selection`` names."""

_CREDENTIALS_IN_URL = re.compile(r"://[^/@\s\"]+@")


class RunRow(Frozen):
    """One run over a dataset, or over the part of it that ``subset`` and ``selection`` say. ``finished_at`` equals
    ``started_at`` until ``finish_run``."""

    run_id: str
    started_at: AwareDatetime
    finished_at: AwareDatetime
    dataset: str
    subset: str | None = None
    selection: str | None = None
    settings: Settings = Settings()
    git_commit: str | None = None
    git_dirty: bool | None = None
    versions: dict[str, str] = Field(default_factory=dict)
    outcome: Outcome = "finished"


def selection_of(asset_ids: Sequence[str], limit: int | None) -> str | None:
    """Assets that ``--assets`` and ``--limit`` leave, as text; None for all. Runs of others cannot be compared."""
    digest = hashlib.sha256("\0".join(sorted(asset_ids)).encode(errors="surrogateescape")).hexdigest()
    listed = ",".join(sorted(asset_ids))
    shown = listed if len(listed) <= MAX_SELECTION else f"{listed[:MAX_SELECTION]}… ({len(asset_ids)}, {digest[:8]})"
    parts = [f"--assets {shown}"] if asset_ids else []
    return " ".join([*parts, *([f"--limit {limit}"] if limit is not None else [])]) or None


def start_run(settings: Settings, dataset: str, subset: str | None = None, selection: str | None = None) -> RunRow:
    """A run that starts now, with an id that sorts by time, and the commit and versions that it runs on."""
    now = datetime.now(UTC)
    commit, dirty = git_state(Path(__file__).resolve().parent)
    return RunRow(
        run_id=f"{now:%Y%m%dT%H%M%S}-{uuid.uuid4().hex[:8]}",
        started_at=now,
        finished_at=now,
        dataset=dataset,
        subset=subset,
        selection=selection,
        settings=settings,
        git_commit=commit,
        git_dirty=dirty,
        versions=versions(),
    )


def finish_run(run: RunRow, outcome: Outcome = "finished") -> RunRow:
    """The same run, ended now."""
    return run.model_copy(update={"finished_at": datetime.now(UTC), "outcome": outcome})


def versions() -> dict[str, str]:
    """Package → version of what is installed of ``RECORDED_PACKAGES``, and Python's own."""
    found = {"python": platform.python_version()}
    for package in RECORDED_PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def git_state(folder: Path) -> tuple[str | None, bool | None]:
    """(commit, whether tracked files differ from it) of the checkout around a folder; (None, None) outside one."""
    try:
        commit = _git(folder, "rev-parse", "HEAD").strip()
        changes = _git(folder, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return None, None
    return commit, bool(changes.strip())


def without_credentials(text: str) -> str:
    """The text with ``user:password@`` taken out of every URL, so that no table or log keeps one."""
    return _CREDENTIALS_IN_URL.sub("://", text)


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout


def write_run_marker(out: Path, run: RunRow) -> str | None:
    """Write the marker of ``run`` under OUT's lock; a sentence on the run before, if that did not finish."""
    path = out / MARK
    left = _read(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"run_id": run.run_id, "started_at": run.started_at.isoformat()}), encoding="utf-8")
    return left


def remove_run_marker(out: Path) -> None:
    """Remove the marker of a run that is published."""
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

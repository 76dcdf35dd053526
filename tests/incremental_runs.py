"""A dataset of asset folders with one small file each, and runs over it that refine without an engine."""

from collections.abc import Callable, Hashable
from pathlib import Path
from typing import Any

import pandas as pd

from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.plan.plan import Plan, make_plan, mark_published
from asset2sim.runs.plan.records import KeptRecord, keep_record
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import RunSettings, Settings, ViewSettings
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode, Redo
from tests.factories import make_failure, make_record

NAMES = ("a", "b", "c", "d")
NO_VIEWS = Settings(views=ViewSettings(write=False))
Make = Callable[[AssetRef], AssetRecord]


def dataset(folder: Path, names: tuple[str, ...] = NAMES) -> Path:
    for name in names:
        (folder / name).mkdir(parents=True)
        (folder / name / "mobility.urdf").write_text(f"<robot name='{name}'/>")
    manifest(folder, dict.fromkeys(names, ""))
    return folder


def manifest(folder: Path, prompts: dict[str, str]) -> None:
    rows = "".join(f"{name},{name},{prompt}\n" for name, prompt in prompts.items())
    (folder / "manifest.csv").write_text(f"asset_id,path,prompt\n{rows}")


def asking(redo: Redo) -> Settings:
    return NO_VIEWS.model_copy(update={"run": RunSettings(redo=redo)})


def good(ref: AssetRef) -> AssetRecord:
    return make_record(ref.asset_id, ref=ref)


def failing(modes: dict[str, FailureMode]) -> Make:
    """A pipeline in which these assets fail."""
    return lambda ref: make_failure(ref.asset_id, modes[ref.asset_id], ref=ref) if ref.asset_id in modes else good(ref)


def refined(out: Path, ref: AssetRef, make: Make) -> AssetRecord:
    record = make(ref)
    if record.overlay is not None:
        (out / "assets" / ref.asset_id).mkdir(parents=True, exist_ok=True)
    return record


def run(data: Path, out: Path, settings: Settings = NO_VIEWS, make: Make = good, *, whole: bool = True,
        only: tuple[str, ...] = (), pipeline: str = "p") -> Plan:  # fmt: skip
    """Run as the flow does, with ``make`` in place of the workers. Returns the plan."""
    out.mkdir(parents=True, exist_ok=True)
    refs = load_dataset(data, asset_ids=only)
    started = start_run(settings, str(data))
    plan = make_plan(refs, out, settings, pipeline)
    records = list(plan.finished)
    for record in records:
        keep_record(out, KeptRecord(run_id=started.run_id, redo=settings.run.redo, record=record))
    for ref in plan.todo:
        record = refined(out, ref, make).model_copy(update={"content_hash": plan.hashes[ref.asset_id]})
        keep_record(out, KeptRecord(run_id=started.run_id, redo=settings.run.redo, record=record))
        records.append(record)
    present = {ref.asset_id for ref in refs} if whole and not only else None
    write_run(out, finish_run(started), records, plan.unchanged, present)
    mark_published(out, records)
    return plan


def done(plan: Plan) -> str:
    """The ids of a plan's ``todo``, joined to one word."""
    return "".join(ref.asset_id for ref in plan.todo)


def runs(out: Path | str) -> pd.DataFrame:
    """The table of runs, in the order of their start."""
    return read_table(out, "runs").sort_values("started_at")


def timeless(out: Path | str) -> dict[str, list[dict[Hashable, Any]]]:
    """The rows of every per-asset table, without the ids of runs."""
    tables = {name: read_table(out, name) for name, table in TABLES.items() if table.per_asset}
    return {name: frame.drop(columns="run_id").astype(str).to_dict("records") for name, frame in tables.items()}

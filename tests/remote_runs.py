"""Runs over assets and into outputs behind URLs, as the flow does them, with a pipeline that takes no time."""

import shutil
from pathlib import Path

import pytest

from asset2sim.assets.urdf.references import find_mesh, outer_references
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.stored_tables import check_catalog
from asset2sim.catalog.write import write_run
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.locate import find_source
from asset2sim.runs import asking_attempt
from asset2sim.runs.asset_attempt import AssetAttempt, failed_record
from asset2sim.runs.plan.hand_changes import set_aside_stored
from asset2sim.runs.plan.plan import Plan, make_plan, mark_published
from asset2sim.runs.plan.records import read_record
from asset2sim.runs.remote.output import open_output, send_plan, send_rest, send_tables, stored_asset_ids
from asset2sim.runs.spread.job import Job
from asset2sim.runs.spread.worker import refine_on_worker
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.settings import Settings
from tests.factories import make_record
from tests.incremental_runs import NO_VIEWS
from tests.whole_records import refine_all

PIPELINE = "tests.remote_runs:brief"


def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have workers run ``brief`` themselves: a child process takes seconds to start."""

    def attempt(
        pipeline: str, ref: AssetRef, out: Path, settings: Settings, ask: object, owner: str, fresh: bool
    ) -> AssetAttempt:
        return AssetAttempt(brief(ref, out, settings, ask))

    monkeypatch.setattr(asking_attempt, "attempt_in_child", attempt)


def brief(ref: AssetRef, out: Path, settings: Settings, ask: object) -> AssetRecord:
    """A pipeline whose refined folder is the asset's URDF and the meshes that it takes from elsewhere."""
    try:
        urdf = find_source(Path(ref.path))
    except AssetError as error:
        return failed_record(ref, settings, error.mode, str(error))
    folder = out / "assets" / ref.asset_id
    (folder / "views").mkdir(parents=True, exist_ok=True)
    shutil.copy(urdf, folder / "refined.urdf")
    (folder / "views" / "one.png").write_text("picture")
    for reference in outer_references(urdf.read_text()):
        mesh = find_mesh(reference, urdf.parent)
        if mesh is not None:
            shutil.copy(mesh, folder / mesh.name)
    (out / "logs").mkdir(exist_ok=True)
    (out / "logs" / f"{ref.asset_id}.answers.txt").write_text(f"from {ref.path}")
    return make_record(ref.asset_id, ref=ref)


def night(data: Path | str, out: Path | str, settings: Settings = NO_VIEWS, *, dask: bool = False) -> Plan:
    """Run as the flow does, without Prefect and MLflow; without ``dask`` one asset at a time. Returns the plan."""
    refs = load_dataset(data)
    with open_output(out) as output:
        folder = output.folder
        check_catalog(folder)
        run = start_run(settings, str(data))
        there = stored_asset_ids(output, views=settings.views.write)
        plan = make_plan(refs, folder, settings, PIPELINE, there)
        send_plan(output, plan)
        if dask:
            records = list(refine_all(refs, folder, settings, PIPELINE, run.run_id, plan, output.url).records)
        else:
            records = [*plan.finished]
            for ref in plan.todo:
                job = Job(ref, plan.hashes[ref.asset_id])
                refine_on_worker(job, out, settings, PIPELINE, run.run_id)
                kept = read_record(folder, job.content_hash)
                assert kept is not None
                records.append(kept.record)
        if output.url is not None:
            records = [set_aside_stored(output.url, item, plan.owned.get(item.ref.asset_id)) for item in records]
        write_run(folder, finish_run(run), records, plan.unchanged, {ref.asset_id for ref in refs})
        send_tables(output)
        mark_published(folder, records)
        send_rest(output)
    return plan

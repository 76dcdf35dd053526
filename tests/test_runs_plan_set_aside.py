"""A failed ``--force`` leaves neither an old folder under a failed row nor nothing at all."""

import json
from pathlib import Path

from asset2sim.catalog.index import write_index
from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.plan.hand_changes import SET_ASIDE, set_aside
from asset2sim.runs.plan.plan import make_plan, mark_published
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Method, Redo
from tests.factories import make_record
from tests.incremental_runs import NO_VIEWS, Make, asking, dataset, failing, good


def night(data: Path, out: Path, settings: Settings = NO_VIEWS, make: Make = good, writes: str = "") -> None:
    """Run as the flow does; the assets in ``writes``, and those that pass, get a new folder."""
    out.mkdir(exist_ok=True)
    started, refs = start_run(settings, str(data)), load_dataset(data)
    plan = make_plan(refs, out, settings, "p")
    records = []
    for ref in plan.todo:
        record = make(ref).model_copy(update={"content_hash": plan.hashes[ref.asset_id], "method": settings.method})
        folder = out / "assets" / ref.asset_id
        if record.overlay is not None or ref.asset_id in writes:
            staged = out / "assets" / f".{ref.asset_id}"
            staged.mkdir(parents=True)
            for name in ("mobility.urdf", "overlay.json"):
                (staged / name).write_text(json.dumps({"run": started.run_id}))
            if folder.exists():
                folder.rename(out / "assets" / f".old-{ref.asset_id}-{started.run_id}")
            staged.rename(folder)
        records.append(record)
    kept = [set_aside(out, record, plan.owned.get(record.ref.asset_id)) for record in records]
    write_run(out, finish_run(started), kept, plan.unchanged)
    write_index(out)
    mark_published(out, kept)


def paths(out: Path) -> dict[str, str | None]:
    """Asset id → what the index names to load."""
    document = json.loads((out / "assets" / "index.json").read_text())
    return {item["asset_id"]: item["path"] for item in document["assets"]}


def test_an_old_folder_goes_aside_and_comes_to_an_end_with_the_next_success(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data", ("a", "b", "c")), tmp_path / "out"
    night(data, out)
    first = (out / "assets" / "a" / "overlay.json").read_text()
    modes = {"a": FailureMode.MODEL_ERROR, "b": FailureMode.PENETRATION}
    night(data, out, asking(Redo.ALL), failing(modes), writes="b")
    assert not (out / "assets" / "a").exists() and (out / SET_ASIDE / "a" / "overlay.json").read_text() == first
    assert (out / "assets" / "b").is_dir() and not (out / SET_ASIDE / "b").exists(), "what failed this night is its own"
    assert paths(out) == {"a": None, "b": "b", "c": "c"}
    found = read_table(out, "findings").query(f"code == '{SET_ASIDE}'")
    assert found["asset_id"].tolist() == ["a"] and f"{SET_ASIDE}/a" in found["message"].iloc[0]
    night(data, out, NO_VIEWS, failing({"a": FailureMode.MODEL_ERROR}))
    assert (out / SET_ASIDE / "a" / "overlay.json").read_text() == first, "a second failure keeps it"
    night(data, out)
    assert paths(out)["a"] == "a" and not (out / SET_ASIDE / "a").exists()


def test_a_folder_that_another_method_wrote_is_not_ours_to_move(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data", ("a",)), tmp_path / "out"
    direct = asking(Redo.ALL).model_copy(update={"method": Method.DIRECT})
    night(data, out, direct)
    night(data, out)
    night(data, out, direct, failing({"a": FailureMode.MODEL_ERROR}))
    assert (out / "assets" / "a").is_dir() and not (out / SET_ASIDE).exists()
    assert make_record().method is Method.ASSET2SIM

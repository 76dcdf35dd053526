"""A synthetic dataset whose entries all count as unchanged: small folders, and a catalog as real runs write it. Each
entry is a copy of one sample object under its own id: some of its files, and the record of its real refinement."""

import os
import shutil
import time
from collections.abc import Sequence
from pathlib import Path

from asset2sim.catalog.changes import Previous, find_changes
from asset2sim.catalog.mlflow_log import log_run
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.summarize import summarize_all
from asset2sim.catalog.write import write_run
from asset2sim.intake.dataset import COLUMNS, MANIFEST, load_dataset
from asset2sim.intake.locate import find_source
from asset2sim.runs.plan.plan import make_plan, mark_published
from asset2sim.runs.plan.state import SETTLED_NS
from asset2sim.storage.lock import lock_output
from lab.speed.process import BenchError
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import Settings

FILES = 8
"""Files of an entry: a real object has 70 on average, which cost 10,000 entries a bench minutes to make."""
BATCH = 1000
"""Entries that one run publishes; bounds the memory that their rows take as Python objects."""


def make_unchanged(
    record: AssetRecord, folder: Path, count: int, settings: Settings, pipeline: str
) -> tuple[Path, Path]:
    """Make a dataset of ``count`` entries and the output of the runs that refined them; (data, out) in ``folder``.
    ``record`` is the real record of the object whose files are taken. Raises BenchError where a run with these settings
    would refine any entry again."""
    data, out = folder / "data", folder / "out"
    refs = make_entries(Path(record.ref.path), data, count)
    # The next run reads a file again if it was just written: a later change might not show in its time stamp.
    time.sleep(SETTLED_NS / 1e9 + 0.1)
    publish_entries(record, refs, data, out, settings, pipeline)
    return data, out


def make_entries(source: Path, data: Path, count: int) -> list[AssetRef]:
    """Asset folders with ``FILES`` files of ``source`` each, linked where the disk allows, and their manifest."""
    data.mkdir(parents=True)
    urdf = find_source(source)
    meshes = sorted(path for path in source.rglob("*") if path.is_file() and path != urdf)
    kept = data / ".source"
    kept.mkdir()
    names = [urdf.name, *(f"{place}_{path.name}" for place, path in enumerate(meshes[: FILES - 1]))]
    for name, path in zip(names, [urdf, *meshes], strict=False):
        shutil.copyfile(path, kept / name)
    ids = [f"entry{number:05}" for number in range(count)]
    for asset_id in ids:
        (data / asset_id).mkdir()
        for name in names:
            try:
                os.link(kept / name, data / asset_id / name)
            except OSError:
                shutil.copyfile(kept / name, data / asset_id / name)
    rows = "".join(f"{asset_id},Box,{asset_id},synthetic,\n" for asset_id in ids)
    (data / MANIFEST).write_text(f"{','.join(COLUMNS)}\n{rows}", encoding="utf-8")
    return load_dataset(data)


def publish_entries(
    record: AssetRecord, refs: Sequence[AssetRef], data: Path, out: Path, settings: Settings, pipeline: str
) -> None:
    """Write every entry's record into the catalog, as the runs that refined them would have."""
    out.mkdir(parents=True)
    dataset = str(data.resolve())
    with lock_output(out):
        hashes = make_plan(refs, out, settings, pipeline).hashes
        for first in range(0, len(refs), BATCH):
            batch = [renamed(record, ref, hashes[ref.asset_id]) for ref in refs[first : first + BATCH]]
            for item in batch:
                (out / "assets" / item.ref.asset_id).mkdir(parents=True)
            run = finish_run(start_run(settings, dataset))
            write_run(out, run, batch)
            mark_published(out, batch)
        # MLflow makes its database in a first run, which takes it seconds.
        few = summarize_all(batch[:1])
        warning = log_run(out, run, few, find_changes(few, Previous()))
        left = make_plan(refs, out, settings, pipeline).todo
    if warning is not None:
        raise BenchError(warning)
    if left:
        raise BenchError(f"{len(left)} of {len(refs)} synthetic entries count as changed: {left[0].asset_id}, …")


def renamed(record: AssetRecord, ref: AssetRef, content_hash: str) -> AssetRecord:
    """A copy of the record under another asset's reference and content hash."""
    parts = {"overlay": record.overlay, "features": record.features}
    named = {key: part and part.model_copy(update={"asset_id": ref.asset_id}) for key, part in parts.items()}
    return record.model_copy(update={"ref": ref, "content_hash": content_hash, **named})

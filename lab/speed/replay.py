"""A night without its work: each entry of a synthetic dataset holds the record of a real refinement, which the pipeline
hands back under the entry's id. All else (processes, Dask, record files, tables, reports) is as in any night."""

import json
import os
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

from asset2sim.assets.folder import URDF_NAME
from asset2sim.intake.dataset import COLUMNS, MANIFEST, load_dataset
from asset2sim.runs.plan.plan import make_plan
from asset2sim.runs.plan.records import KeptRecord, write_record
from asset2sim.storage.lock import lock_output
from lab.speed.synthetic import renamed
from schemas.asset import AssetRecord, AssetRef
from schemas.request import ModelAsk
from schemas.settings import Settings

PIPELINE = f"{__name__}:replay"
RECORD = "record.json"
"""File of an entry: the record to hand back."""


def replay(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk | None) -> AssetRecord:
    """The record in an entry's folder, renamed after the entry; writes the entry's refined folder, if it got one."""
    record = read_sample(Path(ref.path) / RECORD)
    if record.overlay is not None:
        folder = out / "assets" / ref.asset_id
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(Path(ref.path) / URDF_NAME, folder / URDF_NAME)
        (folder / "overlay.json").write_text("{}", encoding="utf-8")
    return renamed(record, ref, "")


def write_samples(records: Iterable[AssetRecord], folder: Path) -> None:
    """Write records for ``read_samples``, a file each."""
    folder.mkdir(parents=True, exist_ok=True)
    for record in records:
        text = json.dumps(record.model_dump(mode="json"))
        (folder / f"{record.ref.asset_id}.json").write_text(text, encoding="utf-8", errors="surrogatepass")


def read_sample(file: Path) -> AssetRecord:
    """One record that ``write_samples`` wrote."""
    return AssetRecord.model_validate(json.loads(file.read_text(encoding="utf-8", errors="surrogatepass")))


def make_entries(samples: Path, data: Path, count: int) -> list[AssetRef]:
    """Make a dataset of ``count`` entries that take turns with the records in ``samples``, linked where possible."""
    shutil.rmtree(data, ignore_errors=True)
    data.mkdir(parents=True)
    urdf = data / ".urdf"
    urdf.write_text('<robot name="entry"><link name="base"/></robot>', encoding="utf-8")
    files = sorted(samples.glob("*.json"))
    ids = [f"entry{number:05}" for number in range(count)]
    for number, asset_id in enumerate(ids):
        (data / asset_id).mkdir()
        _link(files[number % len(files)], data / asset_id / RECORD)
        _link(urdf, data / asset_id / URDF_NAME)
    rows = "".join(f"{asset_id},,{asset_id},synthetic,\n" for asset_id in ids)
    (data / MANIFEST).write_text(f"{','.join(COLUMNS[:5])}\n{rows}", encoding="utf-8")
    return load_dataset(data)


def leave_records(refs: Sequence[AssetRef], out: Path, settings: Settings) -> None:
    """Leave the entries' records and folders in OUT as a night does that is killed when it has refined them all."""
    with lock_output(out):
        hashes = make_plan(refs, out, settings, PIPELINE).hashes
    for ref in refs:
        record = replay(ref, out, settings, None)
        kept = record.model_copy(update={"content_hash": hashes[ref.asset_id]})
        write_record(out, KeptRecord(run_id="killed", redo=settings.run.redo, record=kept))


def _link(source: Path, place: Path) -> None:
    try:
        os.link(source, place)
    except OSError:
        shutil.copyfile(source, place)

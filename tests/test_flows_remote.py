"""The whole of it, through Prefect and Dask, from a bucket into a bucket: the tables are those of a local run."""

import json
import shutil
import subprocess
from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.read import read_table
from schemas.tables import PUBLISHED
from tests.assets import RAW, ROOT
from tests.object_store import KEY, SECRET, Store
from tests.prefect_server import using

pytestmark = pytest.mark.system

IDS = ("planted_not_xml", "scissors_paper", "laptop_silver")
LIMIT_S = 900

SCRIPT = """
import json, os, sys
from asset2sim.runs.request import parse_request
from flows.command import check
from flows.show import print_summary
from asset2sim.experiments.isolation.children import warm_up
from flows.server.server import temporary_server
import flows

options = ["--engines", "pybullet", "--no-interaction", "--no-views", "--workers", "2"]

if __name__ == "__main__":
    with temporary_server() as address:
        warm_up(flows.PIPELINE)
        from flows.refine_dataset import refine_dataset
        from flows.server.client import use_server

        with use_server(address):
            for data, out, cache in json.loads(sys.argv[1]):
                os.environ["ASSET2SIM_CACHE"] = cache
                request = parse_request(["refine", data, "--out", out, *options])
                check(request)
                result = refine_dataset(request.data, request.out, request.settings)
                print_summary(result)
                print(json.dumps([[r.ref.asset_id for r in result.records], [u.asset_id for u in result.unchanged]]))
"""
"""A folder of this machine, a bucket, and the bucket once more from a machine that knows nothing yet."""

OF_THE_RUN = ["run_id", "started_at", "finished_at", "content_hash", "source_path", "dataset", "latency_s", "seconds"]
"""Columns of when and where, beside ``seconds_…`` and ``processor_s_…``."""


def comparable(out: Path | str, name: str) -> pd.DataFrame:
    table = read_table(out, name)
    if name in ("runs", "asset_history"):
        table = table[table["run_id"] == table["run_id"].min()].reset_index(drop=True)
    timed = table.columns.str.contains("seconds|^processor_s_", regex=True)
    return table.loc[:, ~(timed | table.columns.isin(OF_THE_RUN))]


def test_a_bucket_is_refined_into_a_bucket_as_a_folder_into_a_folder(
    store: Store, tmp_path: Path, prefect_server: str, ready: list[str]
) -> None:
    lines = (RAW / "manifest.csv").read_text(encoding="utf-8").splitlines()
    chosen = {line.split(",")[0]: line for line in lines}
    data, here, there = tmp_path / "data", tmp_path / "out", f"{store.url}/refined"
    for asset_id in IDS:
        folder = chosen[asset_id].split(",")[2]
        shutil.copytree(RAW / folder, data / folder)
    (data / "manifest.csv").write_text("\n".join([lines[0], *(chosen[asset_id] for asset_id in IDS)]) + "\n")
    store.put(data, f"{store.url}/raw")
    script = tmp_path / "runs.py"
    script.write_text(SCRIPT)
    caches = [str(tmp_path / name) for name in ("cache", "another machine's cache")]
    runs = [(str(data), str(here), caches[0]), *((f"{store.url}/raw", there, cache) for cache in caches)]
    ran = subprocess.run(
        [*ready, str(script), json.dumps(runs)], cwd=ROOT, env=using(prefect_server, tmp_path / "prefect"), text=True,
        capture_output=True, timeout=LIMIT_S,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    steps = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("[[")]
    assert steps == [[list(IDS), []], [list(IDS), []], [[], list(IDS)]]
    assert f"assets:  {there}/assets" in ran.stdout and f"report:  {there}/report/index.html" in ran.stdout

    for name in PUBLISHED:
        pd.testing.assert_frame_equal(comparable(there, name), comparable(here, name), obj=name)
    assert read_table(there, "runs")["dataset"].unique().tolist() == [f"{store.url}/raw"]
    assert read_table(there, "assets")["source_path"].str.startswith(f"{store.url}/raw/").all()
    files = {path.relative_to(here).as_posix() for path in here.glob("assets/**/*") if path.is_file()}
    kept = store.keys(there)
    assert {name for name in kept if name.startswith("assets/")} == files and len(files) > 10
    for name in files - {name for name in files if name.endswith((".json", ".png"))}:
        assert store.files.cat_file(f"{there}/{name}") == (here / name).read_bytes(), name
    assert {"report/index.html", "report/objects/planted_not_xml/index.html"} <= set(kept)
    assert sum(name.startswith("history/") for name in kept) == 2 and ".lock" not in kept

    written = {name: store.files.cat_file(f"{there}/{name}") for name in kept}
    written |= {str(path): path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    written |= {"the terminal": f"{ran.stdout}{ran.stderr}".encode()}
    told = [name for name, content in written.items() if KEY.encode() in content or SECRET.encode() in content]
    assert not told, "credentials were written"

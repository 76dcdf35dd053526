"""Assets over Dask workers: every one gets a record, whatever happens to its process, its worker or the cluster."""

import os
import socket
from collections.abc import Iterator
from pathlib import Path
from threading import Thread

import dask
import pytest
from distributed import LocalCluster

from asset2sim.experiments import cluster as existing
from asset2sim.runs.check_request import check_scheduler
from asset2sim.runs.spread import refine_all as refine
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.settings import RunSettings, Settings
from schemas.vocabulary import FailureMode, Status
from tests.dask_programs import await_workers, process_cluster, programs, start_scheduler, start_workers
from tests.faulty import processes
from tests.processes import alive, kill_marked, wait_until
from tests.whole_records import refine_all

pytestmark = pytest.mark.system


def refs(*ids: str) -> list[AssetRef]:
    return [AssetRef(asset_id=asset_id, path=f"/nowhere/{asset_id}") for asset_id in ids]


def settings(**run: object) -> Settings:
    return Settings(run=RunSettings.model_validate({"asset_time_limit_s": 2.0, "asset_memory_limit_mb": 600, **run}))


def test_records_come_back_in_the_datasets_order_and_a_crash_costs_one(tmp_path: Path) -> None:
    ids = ["a", "segfault-1", "b", "hang-1", *(f"c{number}" for number in range(12))]
    refined = refine_all(refs(*ids), tmp_path, settings(), "tests.crashers:crash_if_told")
    assert refined.stopped is None
    assert [record.ref.asset_id for record in refined.records] == ids
    failed = {record.ref.asset_id: record.failure_mode for record in refined.records if record.status is Status.FAILED}
    assert failed == {"segfault-1": FailureMode.ENGINE_CRASH, "hang-1": FailureMode.TIMEOUT}


def test_a_pipeline_that_cannot_be_imported_fails_assets_with_the_reason(tmp_path: Path) -> None:
    refined = refine_all(refs("a"), tmp_path, settings(), "tests.no_such_module:refine")
    assert refined.records[0].failure_mode is FailureMode.ENGINE_CRASH
    assert "tests.no_such_module" in refined.records[0].reason


@pytest.fixture
def tcp_cluster() -> Iterator[str]:
    """A cluster that was there before the run, its workers in this process."""
    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=False,
        protocol="tcp://",
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        silence_logs=50,
    ) as running:
        yield running.scheduler_address


def test_a_cluster_that_is_there_already_is_used(tmp_path: Path, tcp_cluster: str) -> None:
    refined = refine_all(refs("a", "b", "c"), tmp_path, settings(scheduler=tcp_cluster), "tests.crashers:no_pipeline")
    assert [record.status for record in refined.records] == [Status.OK] * 3


def test_an_absent_scheduler_is_the_users_mistake() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
    with pytest.raises(UsageError, match=f"no Dask scheduler listens at {address}"):
        check_scheduler(address)
    for malformed in ("127.0.0.1:8786", "http://127.0.0.1:8786", "tcp://127.0.0.1", "tcp://127.0.0.1:many"):
        with pytest.raises(UsageError, match="tcp://host:port"):
            check_scheduler(malformed)


def test_a_scheduler_that_does_not_come_back_ends_the_run_with_what_had_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(refine, "RETURN_LIMIT_S", 1.0)
    monkeypatch.setattr(existing, "CONNECT_LIMIT_S", 2.0)
    mark = f"asset2sim-fanout-{tmp_path.name}-{os.getpid()}"
    cluster = programs({**os.environ, "A_TEST": mark}, tmp_path)
    try:
        scheduler, workers = start_scheduler(cluster), start_workers(cluster, 1)
        await_workers(cluster.address, 1, 120.0)
        out = tmp_path / "out"
        out.mkdir()

        def kill_the_scheduler() -> None:
            wait_until(lambda: bool(processes(out, "sleepy")), 120.0)
            scheduler.kill()

        killer = Thread(target=kill_the_scheduler)
        killer.start()
        found = refine_all(refs("a", "b", "sleepy"), out, settings(scheduler=cluster.address,
                           asset_time_limit_s=300.0), "tests.faulty:refine")  # fmt: skip
        assert found.stopped is not None and "scheduler went away" in found.stopped
        assert [record.ref.asset_id for record in found.records] == ["a", "b"]
        killer.join()
        # The worker goes with its scheduler, and takes the child along that would sleep for minutes.
        assert workers.wait(120.0) is not None
        assert wait_until(lambda: not alive(mark), 60.0), alive(mark)
    finally:
        kill_marked(mark)


def test_workers_that_do_not_see_the_output_folder_are_refused(tmp_path: Path) -> None:
    sign = tmp_path / existing.SIGN
    with pytest.raises(UsageError, match="does not see the output folder"):
        existing.refuse_other_folder(str(sign), "here")
    sign.parent.mkdir()
    sign.write_text("here")
    existing.refuse_other_folder(str(sign), "here")


def test_workers_that_may_have_no_children_are_refused_with_the_remedy(tmp_path: Path) -> None:
    remedy = "DASK_DISTRIBUTED__WORKER__DAEMON=False"
    with process_cluster(daemon=True) as running, pytest.raises(UsageError, match=remedy):
        refine_all(refs("a"), tmp_path, settings(scheduler=running.scheduler_address), "tests.crashers:no_pipeline")


def test_a_lost_worker_costs_the_asset_that_it_is_lost_to(tmp_path: Path) -> None:
    with (
        dask.config.set({"distributed.worker.daemon": False, "distributed.scheduler.allowed-failures": 0}),
        process_cluster(daemon=False) as running,
    ):
        refined = refine_all(
            refs("murderous", "a", "b"),
            tmp_path,
            settings(scheduler=running.scheduler_address, asset_time_limit_s=300.0),
            "tests.crashers:kill_the_worker",
        )
    statuses = {record.ref.asset_id: record.status for record in refined.records}
    assert statuses == {"murderous": Status.FAILED, "a": Status.OK, "b": Status.OK}
    assert "died twice: its Dask worker was lost" in refined.records[0].reason

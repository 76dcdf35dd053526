"""The dead tried once more: which, how many, what their records say, what a killed run leaves; equal model errors."""

from functools import partial
from pathlib import Path

import pytest

from asset2sim.runs.asset_attempt import FirstAttempt, with_first_attempt, without_retry
from asset2sim.runs.plan import records
from asset2sim.runs.plan.plan import make_plan
from asset2sim.runs.plan.records import KeptRecord, call_writer, keep_record, kept_records, paid_calls
from asset2sim.runs.spread.harvest import Breaker, Harvest, finish_without_retry, second_attempt_jobs, take_result
from asset2sim.runs.spread.job import Job, JobResult, LostJob, jobs_of, last_seconds
from asset2sim.runs.spread.worker import refine_on_worker
from flows import PIPELINE
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import EngineSettings, ModelSettings, RunSettings, Settings
from schemas.vocabulary import Engine, FailureMode, Method, Redo, Severity, Status
from tests.assets import RAW
from tests.factories import make_call, make_failure, make_record
from tests.incremental_runs import NAMES, NO_VIEWS, dataset, done, run
from tests.model_server import Reply, serve
from tests.whole_records import refine_all

REF = AssetRef(asset_id="a", path="/nowhere/a")
HASH = "0" * 64
JOB = Job(REF, HASH)
FIRST = FirstAttempt("killed by SIGKILL (see logs/a.log)", (make_call(),))


def kept(attempt: int = 1, died: str = "", run_id: str = "r", **changes: object) -> KeptRecord:
    make = make_failure("a", FailureMode.ENGINE_CRASH) if died else make_record("a")
    record = make.model_copy(update={"ref": REF, "content_hash": HASH, **changes})
    return KeptRecord(run_id=run_id, redo=Redo.CHANGED, record=record, attempt=attempt, died=died)


def harvest(out: Path, **run_settings: object) -> Harvest[AssetRecord]:
    settings = Settings(run=RunSettings.model_validate(run_settings))
    return Harvest(out, "r", settings, lambda record: None, lambda record: record)


def taken(got: Harvest[AssetRecord], job: Job, end: JobResult | LostJob | None) -> AssetRecord | None:
    """The record that is reported."""
    reported: list[AssetRecord] = []
    got.report = reported.append
    take_result(got, job, end)
    assert len(reported) <= 1
    return reported[0] if reported else None


def test_a_second_attempt_keeps_what_the_first_one_cost_and_says_how_it_died() -> None:
    record = with_first_attempt(make_record("a"), FIRST, "")
    assert record.status is Status.OK and len(record.calls) == 1 + len(make_record("a").calls)
    assert record.calls[0] == FIRST.calls[0]
    said = record.findings[-1]
    assert (said.code, said.severity) == ("died_once", Severity.WARNING)
    assert "killed by SIGKILL (see logs/a.first.log)" in said.message
    failed = make_failure("a", FailureMode.TIMEOUT, "timeout")
    twice = with_first_attempt(failed, FIRST, "not done after 300 s (see logs/a.log)")
    assert twice.failure_mode is FailureMode.TIMEOUT and twice.calls == FIRST.calls
    assert twice.reason.startswith("died twice: not done after 300 s (see logs/a.log); the first time: killed by")
    assert [finding.message for finding in twice.findings] == [f"asset a: {twice.reason}"]


def test_those_without_a_record_go_first_and_no_more_than_so_many_are_tried() -> None:
    jobs = {name: Job(AssetRef(asset_id=name, path="/x"), name) for name in "abcd"}
    dead = {name: FirstAttempt(name) for name in "cba"}
    chosen = list(second_attempt_jobs(jobs, dead, {"c", "b"}.__contains__, 2))
    assert [(job.ref.asset_id, job.attempt) for job in chosen] == [("a", 2), ("c", 2)]
    assert list(second_attempt_jobs(jobs, dead, {"c"}.__contains__, 0)) == []
    (left,) = without_retry(make_failure("a", FailureMode.TIMEOUT), FIRST, 20).findings[1:]
    assert left.code == "not_tried_again" and "20 others" in left.message


def test_a_run_tries_no_more_of_the_dead_than_it_may(tmp_path: Path) -> None:
    refs = [AssetRef(asset_id=f"segfault-{number}", path="/nowhere") for number in range(3)]
    found = refine_all(refs, tmp_path, Settings(run=RunSettings(retries_alone=2)), "tests.crashers:crash_if_told")
    assert [record.failure_mode for record in found.records] == [FailureMode.ENGINE_CRASH] * 3
    assert sorted(record.reason.startswith("died twice") for record in found.records) == [False, True, True]
    codes = [[finding.code for finding in record.findings] for record in found.records]
    assert sorted(codes, key=len) == [["engine_crash"], ["engine_crash"], ["engine_crash", "not_tried_again"]]
    assert not list((tmp_path / records.RECORDS_FOLDER).iterdir())


def test_what_comes_in_is_handed_over_or_lies_in_the_output_folder(tmp_path: Path) -> None:
    got = harvest(tmp_path)
    assert taken(got, JOB, JobResult(kept())) == got.records["a"] == kept().record
    assert not list(kept_records(tmp_path)), "its worker has written it where it was"
    dead, died = harvest(tmp_path), kept(died="crashed")
    assert taken(dead, JOB, JobResult(died)) is None
    assert dead.dead == {"a": FirstAttempt("crashed", ())} and not dead.records and dead.first == {"a": died.record}
    keep_record(tmp_path, died)
    collected = harvest(tmp_path)
    assert taken(collected, JOB, None) is None and collected.dead == dead.dead and collected.first == dead.first
    second = Job(REF, HASH, dead.dead["a"])
    assert taken(dead, second, None) is None
    keep_record(tmp_path, kept(attempt=2))
    again = harvest(tmp_path)
    assert taken(dead, second, None) == taken(again, second, None) == dead.records["a"] == kept().record
    assert not dead.dead
    assert taken(dead, second, None) is None
    assert taken(harvest(tmp_path), Job(REF, "1" * 64), None) is None
    keep_record(tmp_path, kept(run_id="another"))
    assert taken(harvest(tmp_path), JOB, None) is None


def test_a_record_that_could_not_be_written_travels_and_is_kept_where_there_is_room(tmp_path: Path) -> None:
    got = harvest(tmp_path)
    assert taken(got, JOB, JobResult(kept(), written=False)) == kept().record
    assert [item.record for item in kept_records(tmp_path)] == [kept().record]


def test_what_is_done_is_not_done_again_where_only_the_answer_was_lost(tmp_path: Path) -> None:
    work = partial(refine_on_worker, out=tmp_path, settings=Settings(), pipeline="tests.crashers:no_pipeline")
    keep_record(tmp_path, kept(reason="kept"))
    assert work(JOB, run_id="r") == JobResult(kept(reason="kept")) == work(JOB, run_id="r")
    (same,) = kept_records(tmp_path)
    assert same.record.reason == "kept"
    done = work(Job(REF, HASH, FIRST), run_id="r")
    (second,) = kept_records(tmp_path)
    assert done == JobResult(second)
    assert second.attempt == 2 and second.record.calls == FIRST.calls


def test_what_a_lost_worker_had_paid_for_is_in_the_record(tmp_path: Path) -> None:
    keep = call_writer(tmp_path, HASH)
    keep([make_call(), make_call(cached=True)])
    keep([make_call(attempt=2)])
    assert [call.attempt for call in paid_calls(tmp_path, HASH)] == [1, 2]
    refine_on_worker(JOB, tmp_path, Settings(), "tests.crashers:no_pipeline", "r")
    (found,) = kept_records(tmp_path)
    assert [call.attempt for call in found.record.calls] == [1, 2] and paid_calls(tmp_path, HASH) == ()
    keep([make_call(attempt=3)])
    got = harvest(tmp_path)
    take_result(got, JOB, LostJob("gone"))
    finish_without_retry(got, JOB)
    assert [call.attempt for call in got.records["a"].calls] == [3] and paid_calls(tmp_path, HASH) == ()


def test_a_lost_worker_is_a_death_without_a_record_and_two_are_the_end(tmp_path: Path) -> None:
    got = harvest(tmp_path)
    assert taken(got, JOB, LostJob("KilledWorker: gone")) is None and not got.records
    record = taken(got, Job(REF, HASH, got.dead["a"]), LostJob("KilledWorker: again"))
    assert record is not None and record.failure_mode is FailureMode.ENGINE_CRASH and record.content_hash == HASH
    assert "died twice: its Dask worker was lost: KilledWorker: again" in record.reason
    one_too_many = harvest(tmp_path / "other")
    take_result(one_too_many, JOB, LostJob("gone"))
    finish_without_retry(one_too_many, JOB)
    assert one_too_many.records["a"].reason == "its Dask worker was lost: gone"
    assert not one_too_many.dead


def test_what_a_killed_run_had_still_to_try_again_is_refined_anew(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    hashes = run(data, tmp_path / "elsewhere").hashes
    for name, attempt in (("a", 1), ("b", 2)):
        failed = make_failure(name, FailureMode.ENGINE_CRASH, content_hash=hashes[name])
        keep_record(out, KeptRecord(run_id="killed", redo=Redo.CHANGED, record=failed, attempt=attempt, died="crashed"))
    plan = run(data, out)
    assert done(plan) == "acd" and [ref.asset_id for ref in plan.finished.refs] == ["b"]


def test_the_longest_of_last_time_go_first_and_the_unknown_before_them(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    assert last_seconds(out, Method.ASSET2SIM) == {}
    times = dict(zip(NAMES, (1.0, 3.0, 2.0, 4.0), strict=True))
    run(data, out, NO_VIEWS, lambda ref: make_record(ref.asset_id, ref=ref, seconds={"total": times[ref.asset_id]}))
    seconds = last_seconds(out, Method.ASSET2SIM)
    assert seconds == times and last_seconds(out, Method.RAW) == {}
    refs = [AssetRef(asset_id=name, path="/x") for name in ("new", *NAMES, "newer")]
    assert list(jobs_of(refs, "r", {}, seconds)) == ["new", "newer", "d", "b", "c", "a"]


def test_a_job_without_a_plan_has_a_name_of_its_own() -> None:
    assert jobs_of([REF], "r", {"a": HASH}, {}) == {"a": JOB}
    names = {jobs_of([REF], run_id, {}, {})["a"].content_hash for run_id in "rs"}
    assert len(names) == 2 and all(len(name) == 64 for name in names)


def test_equal_errors_in_a_row_break_it_and_an_answer_in_between_does_not() -> None:
    def failed(asset_id: str, why: str = "down after {} s") -> AssetRecord:
        reason = f"asset {asset_id}: {why.format(len(asset_id))}"
        return make_failure(asset_id, FailureMode.MODEL_ERROR, reason=reason)

    breaker = Breaker(3)
    for record in (failed("a"), failed("bb"), make_record("ok"), failed("c"), failed("d"), failed("e", "another")):
        breaker.see(record)
    assert breaker.broken is None and breaker.count == 1
    unreadable = make_failure("x", FailureMode.UNREADABLE_ASSET)
    for record in (failed("f"), unreadable, failed("gg"), failed("hhh")):
        breaker.see(record)
    assert breaker.broken is not None and "3 assets in a row" in breaker.broken and "asset hhh: down" in breaker.broken
    never = Breaker(0)
    for _ in range(9):
        never.see(failed("a"))
    assert never.broken is None


@pytest.mark.system
def test_a_refused_key_ends_the_asking_and_every_asset_has_a_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-wrong-key-of-a-test")
    folder = str(RAW / "Box" / "box_wooden")
    refs = [AssetRef(asset_id=f"box-{number}", path=folder, category="Box") for number in range(9)]
    with serve([Reply("Incorrect API key provided", status=401)]) as server:
        settings = Settings(
            model=ModelSettings(model="openai/scripted", api_base=server.api_base, image_side_px=64),
            engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
            run=RunSettings(workers=1, max_model_errors=3),
        )
        plan = make_plan(refs, tmp_path, settings, PIPELINE)
        refined = refine_all(refs, tmp_path, settings, PIPELINE, "one", plan)
        asked = len(server.requests)
    assert 3 <= asked <= 5, "what is in flight ends, and nothing else begins"
    assert [record.ref.asset_id for record in refined.records] == [ref.asset_id for ref in refs]
    assert {record.failure_mode for record in refined.records} == {FailureMode.MODEL_ERROR}
    assert all(record.status is Status.FAILED and record.content_hash for record in refined.records)
    assert refined.stopped is not None and "3 assets in a row" in refined.stopped and "401" in refined.stopped
    untried = [record for record in refined.records if record.reason.startswith("not tried")]
    assert len(untried) == 9 - asked and "the next run tries them" in untried[0].reason
    assert "sk-wrong-key-of-a-test" not in refined.stopped

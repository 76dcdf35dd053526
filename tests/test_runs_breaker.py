"""The circuit breaker: a wrong key costs a few assets, not the night."""

from pathlib import Path

import pytest

from asset2sim.runs.plan.plan import make_plan
from asset2sim.runs.spread.harvest import Breaker
from asset2sim.runs.spread.refine_all import refine_all
from flows import PIPELINE
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import EngineSettings, ModelSettings, RunSettings, Settings
from schemas.vocabulary import Engine, FailureMode, Status
from tests.assets import RAW
from tests.factories import make_failure, make_record
from tests.model_server import Reply, serve


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
            model=ModelSettings(model="openai/scripted", api_base=server.api_base),
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

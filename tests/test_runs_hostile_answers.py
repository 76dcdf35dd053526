"""Every fault that a model or its server can have, over real HTTP, end to end: each ends as one row with its cause.

All assets are refined in one run, copies of one small sample and of an object that no state parts; what is answered is
chosen by the asset id that stands in the request.
"""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

import pandas as pd
import pytest

from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.models.prior.answer import answer
from asset2sim.runs.asking_attempt import attempt_asset
from flows import PIPELINE
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import CollisionSettings, EngineSettings, ModelSettings, SearchSettings, Settings, ViewSettings
from schemas.vocabulary import CollisionMode, Engine, FailureMode, Status
from tests.assets import joint, link, robot, sample, shape, written
from tests.model_server import Reply
from tests.scripted_server import Asked, ScriptedServer, scripted

pytestmark = pytest.mark.system

TIMEOUT_S = 5.0
ATTEMPTS = 2
RUN_S = 600.0
"""The whole run may take no longer, s: a hang costs an asset its attempts and no more."""
NOW = {"Retry-After": "0"}
SAMPLE = "box_chest"
HINGE = "joint_0"

Say = Callable[[Asked], Reply]


def edited(change: Callable[[dict[str, Any]], object]) -> Say:
    """The competent answer with something done to it."""

    def say(asked: Asked) -> Reply:
        overlay = json.loads(answer(asked.text))
        change(overlay)
        return Reply(json.dumps(overlay))

    return say


def right(asked: Asked) -> Reply:
    return Reply(answer(asked.text))


def says(text: str) -> Say:
    return lambda asked: Reply(text)


def fails(status: int) -> Say:
    return lambda asked: Reply("out of order", status=status, headers=NOW)


def hangs(asked: Asked) -> Reply:
    return Reply(hang=True)


def cut_off(asked: Asked) -> Reply:
    text = answer(asked.text)
    return Reply(text[: len(text) // 2])


def wrapped(asked: Asked) -> Reply:
    return Reply(f"Sure! Here it is:\n\n```json\n{answer(asked.text)}\n```\n\nDo you want {{anything}} else?")


def ten_megabytes(asked: Asked) -> Reply:
    return Reply(json.dumps({"scale": 1.0, "notes": ["x" * 10_000_000]}))


def in_degrees(overlay: dict[str, Any]) -> None:
    overlay["initial_joint_positions"] = {
        name: math.degrees(value) for name, value in overlay["initial_joint_positions"].items()
    }


def stepping(deltas: Mapping[str, float], state_ok: bool = False, approved: bool = False) -> Say:
    return says(json.dumps({"state_ok": state_ok, "approved": approved, "deltas": deltas}))


@dataclass(frozen=True)
class Case:
    """What is answered, one after the other and the last for ever, and what must come of it."""

    synthesis: Sequence[Say]
    outcomes: Sequence[str]
    mode: FailureMode = FailureMode.NONE
    findings: Sequence[str] = ()
    refinement: Sequence[Say] = (right,)
    stuck: bool = False


OK, REFUSED, FAILED = "ok", "invalid_answer", "provider_error"
NO_ESTIMATE, MODEL_ERROR = FailureMode.NO_VALID_ESTIMATE, FailureMode.MODEL_ERROR


def stuck(*refinement: Say, outcomes: Sequence[str], findings: Sequence[str] = ()) -> Case:
    """An object whose parts overlap whatever is done: the model is asked, and cannot make it pass."""
    return Case((right,), (OK, *outcomes), FailureMode.PENETRATION, findings, refinement, True)


CASES: dict[str, Case] = {
    "competent": Case([right], [OK]),
    "rate-limited": Case([fails(429), right], [FAILED, OK]),
    "server-errors": Case([fails(500)], [FAILED] * ATTEMPTS, MODEL_ERROR, ["model_error"]),
    "hangs": Case([hangs], [FAILED] * ATTEMPTS, MODEL_ERROR, ["model_error"]),
    "hangs-once": Case([hangs, right], [FAILED, OK]),
    "key-refused": Case([fails(401)], [FAILED], MODEL_ERROR, ["model_error"]),
    "cut-off": Case([cut_off], [REFUSED, REFUSED], NO_ESTIMATE, ["invalid_answer"]),
    "cut-off-once": Case([cut_off, right], [REFUSED, OK], findings=["invalid_answer"]),
    "prose-around": Case([wrapped], [OK]),
    "prose-only": Case([says("I would say it is a chest.")], [REFUSED] * 2, NO_ESTIMATE, ["invalid_answer"]),
    "degrees": Case([edited(in_degrees)], [OK], findings=["position_in_degrees"]),
    "nan": Case([edited(lambda o: o.update(scale=math.nan))], [REFUSED] * 2, NO_ESTIMATE, ["invalid_answer"]),
    "negative-mass": Case(
        [edited(lambda o: o["links"][0].update(mass_kg=-1.0))], [REFUSED] * 2, NO_ESTIMATE, ["invalid_answer"]
    ),
    "unknown-link": Case(
        [edited(lambda o: o["links"].append({"name": "wheel", "mass_kg": 1.0})), right], [REFUSED, OK],
        findings=["invalid_answer"],
    ),
    "unknown-field": Case(
        [edited(lambda o: o.update(urdf="<robot/>"))], [REFUSED] * 2, NO_ESTIMATE, ["invalid_answer"]
    ),
    "missing-joint": Case(
        [edited(lambda o: o.update(joints=[], initial_joint_positions={}, asked=[]))], [OK, OK],
        findings=["asked_again"],
    ),
    "missing-links": Case([edited(lambda o: o.update(links=[]))], [OK]),
    "absurd-mass": Case([edited(lambda o: o["links"][0].update(mass_kg=1e300))], [OK]),
    "ten-megabytes": Case([ten_megabytes], [FAILED], MODEL_ERROR, ["model_error"]),
    "stuck-competent": stuck(right, outcomes=[OK, OK]),
    "stuck-prose": stuck(
        says("Open it a little."), outcomes=[REFUSED, REFUSED], findings=["invalid_answer", "refinement_unanswered"]
    ),
    "stuck-unknown-joint": stuck(
        stepping({"lid": 0.1}), right, outcomes=[REFUSED, OK], findings=["invalid_answer"]
    ),
    "stuck-nan": stuck(
        says('{"state_ok": false, "approved": false, "deltas": {"left_slide": NaN}}'), outcomes=[REFUSED, REFUSED],
        findings=["refinement_unanswered"],
    ),
    "stuck-hangs": stuck(hangs, outcomes=[FAILED] * ATTEMPTS, findings=["refinement_unanswered"]),
    "stuck-approves": stuck(stepping({}, state_ok=True, approved=True), outcomes=[OK]),
    "stuck-far": stuck(stepping({"left_slide": 1e308, "right_slide": -1e308}), outcomes=[OK, OK]),
}  # fmt: skip


@dataclass(frozen=True)
class Run:
    """One run of every case: records and tables, what the server saw, and how long it took (s)."""

    records: dict[str, AssetRecord]
    server: ScriptedServer
    assets: pd.DataFrame
    calls: pd.DataFrame
    seconds: float
    asked_first: int
    """Requests that the asset which is refined twice took the first time."""


def overlapping(folder: Path) -> Path:
    """Two blocks on short slides, 10 cm inside each other in every state."""
    sides = [("left", "-0.15", "-1 0 0"), ("right", "0.15", "1 0 0")]
    parts = [link("body", shape("1 1 0.2"))]
    for name, x, axis in sides:
        parts.append(link(name, shape("0.4 0.4 0.4")))
        parts.append(joint(f"{name}_slide", "prismatic", "body", name, xyz=f"{x} 0 0.5", axis=axis, limit="0 0.02"))
    return written(folder, robot(*parts))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    out = tmp_path_factory.mktemp("hostile")
    stuck_folder = overlapping(tmp_path_factory.mktemp("raw") / "stuck")
    seen: dict[tuple[str, str], int] = {}

    def script(asked: Asked) -> Reply:
        case = CASES[asked.asset_id]
        replies = case.synthesis if asked.purpose == "synthesis" else case.refinement
        key = (asked.asset_id, asked.purpose)
        seen[key] = seen.get(key, 0) + 1
        return replies[min(seen[key], len(replies)) - 1](asked)

    with pytest.MonkeyPatch.context() as patch, scripted(script) as server:
        for name in ("OPENAI_API_KEY", "OPENAI_API_BASE"):
            patch.delenv(name, raising=False)
        model = ModelSettings(
            # This model does not look at its pictures: small ones are made sooner.
            model="openai/scripted", api_base=server.api_base, timeout_s=TIMEOUT_S, max_attempts=ATTEMPTS,
            image_side_px=64,
        )  # fmt: skip
        settings = Settings(
            model=model,
            engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
            views=ViewSettings(width=48, height=48, write=False),
        )

        def refined(ref: AssetRef, chosen: Settings) -> AssetRecord:
            return attempt_asset(ref, out, chosen, PIPELINE, ref.asset_id, lambda calls: None, fresh=False).record

        def refine(name: str) -> AssetRecord:
            if not CASES[name].stuck:
                return refined(sample(SAMPLE).model_copy(update={"asset_id": name}), settings)
            kept = settings.model_copy(
                update={
                    "collision": CollisionSettings(mode=CollisionMode.KEEP),
                    "search": SearchSettings(mend_rounds=0),
                }
            )
            return refined(AssetRef(asset_id=name, path=str(stuck_folder), category="Box"), kept)

        refine("competent")  # LiteLLM and the engines take seconds to load, once; a slow machine may have to ask again
        asked_first = len(server.of("competent"))
        start = monotonic()
        with ThreadPoolExecutor(6) as pool:
            records = dict(zip(CASES, pool.map(refine, CASES), strict=True))
        seconds = monotonic() - start
    write_run(out, finish_run(start_run(settings, "hostile", None), "finished"), list(records.values()))
    assets = read_table(out, "assets").set_index("asset_id")
    return Run(records, server, assets, read_table(out, "model_calls"), seconds, asked_first)


def the_calls(run: Run, name: str) -> list[str]:
    """The outcomes of an asset's calls, in order."""
    rows = run.calls[run.calls["asset_id"] == name].sort_values("call_index")
    return list(rows["outcome"])


@pytest.mark.parametrize("name", CASES)
def test_a_fault_ends_in_its_row(run: Run, name: str) -> None:
    case, record, row = CASES[name], run.records[name], run.assets.loc[name]
    assert record.failure_mode is case.mode, record.reason
    assert row["failure_mode"] == case.mode.value and row["status"] == record.status.value
    assert (record.status is Status.OK) == (case.mode is FailureMode.NONE)
    codes = {finding.code for finding in record.findings}
    assert set(case.findings) <= codes, codes
    assert "Traceback" not in record.reason and "\n" not in record.reason


@pytest.mark.parametrize("name", [name for name in CASES if name != "competent"])
def test_every_request_is_a_call_and_every_call_a_row(run: Run, name: str) -> None:
    wanted = list(CASES[name].outcomes)
    assert [call.outcome for call in run.records[name].calls] == wanted == the_calls(run, name)
    assert len(run.server.of(name)) == len(wanted)


def test_the_first_run_of_an_answered_asset_is_not_paid_for_again(run: Run) -> None:
    assert len(run.server.of("competent")) == run.asked_first and the_calls(run, "competent") == ["cached"]


def test_no_fault_holds_the_others_up(run: Run) -> None:
    assert run.seconds < RUN_S
    for name in ("hangs", "stuck-hangs"):
        failed = [call for call in run.records[name].calls if call.outcome == FAILED]
        assert all(TIMEOUT_S * 0.9 <= call.latency_s < RUN_S for call in failed)


def test_the_second_question_tells_what_was_wrong_and_what_there_is(run: Run) -> None:
    first, second = run.server.of("unknown-link")
    assert "validation_errors" not in first.text and second.text.startswith(first.text.split("\n\n<")[0])
    (errors,) = re.findall(r"<validation_errors>\n(.*)\n</validation_errors>", second.text)
    assert "unknown link 'wheel'" in errors and "link_0" in errors
    _, first, second = run.server.of("stuck-unknown-joint")
    assert first.purpose == second.purpose == "refinement"
    (errors,) = re.findall(r"<validation_errors>\n(.*)\n</validation_errors>", second.text)
    assert "'lid' is not a focus joint" in errors and "left_slide, right_slide" in errors


def test_views_go_with_every_question(run: Run) -> None:
    for asked in run.server.asked:
        labels = [label for label, *_ in asked.images]
        if asked.purpose == "synthesis":
            assert labels[:4] == ["perspective", "front", "left", "back"] and "parts" in labels
            of_the_answer = [label for label in labels if label.startswith("the result of your answer")]
            assert bool(of_the_answer) == ("<consequences>" in asked.text)
        else:
            assert asked.purpose == "refinement" and labels == ["perspective", "front", "right", "top"]
        # The question's own pictures have their size; those of a state have that of the settings.
        assert {(width, height) for _, width, height, _ in asked.images} <= {(48, 48), (64, 64)}


def test_what_a_model_leaves_out_or_overstates_is_made_good(run: Run) -> None:
    whole = run.records["competent"].overlay
    assert whole is not None
    for name in ("missing-joint", "missing-links", "absurd-mass", "degrees"):
        overlay = run.records[name].overlay
        assert overlay is not None
        assert {item.name for item in overlay.joints} == {HINGE} and len(overlay.links) == len(whole.links)
        assert all(0.0 < item.mass_kg < 1e3 and math.isfinite(item.mass_kg) for item in overlay.links)
        (hinge,) = overlay.joints
        assert hinge.lower is not None and hinge.upper is not None
        assert hinge.lower <= hinge.initial_position <= hinge.upper


def test_a_models_word_passes_nothing(run: Run) -> None:
    for name in (name for name in CASES if CASES[name].stuck):
        record = run.records[name]
        assert record.overlay is not None and record.measurement is not None
        assert record.measurement.penetration_m > Settings().thresholds.penetration_m
        for item in record.overlay.joints:
            assert item.lower is not None and item.upper is not None
            assert item.lower <= item.initial_position <= item.upper
        steps = [step for step in record.trace if step.proposer == "model"]
        assert len(steps) <= Settings().search.max_model_calls
        assert all(step.phi_after_m < step.phi_before_m for step in steps if step.accepted)


def test_a_refused_proposal_is_told_in_the_next_question(run: Run) -> None:
    first, second = [asked for asked in run.server.of("stuck-competent") if asked.purpose == "refinement"]
    assert '"tried"' not in first.text
    assert '"tried":[{"positions":{"left_slide":' in second.text and '"phi_m":' in second.text

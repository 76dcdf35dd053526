"""The paper's loop: a model behind real HTTP proposes every step, and the simulator decides; one planted overlap."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from asset2sim.engines.static_object import contact_points, static_object
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.refinement.ask_model import AskedSoFar, QuestionContext
from asset2sim.refinement.model_loop import ModelWalk, refine_by_model
from asset2sim.refinement.position_bands import Evaluator, reachable_bands
from schemas.finding import TraceStep
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import ModelSettings, SearchSettings, Settings
from schemas.vocabulary import Proposer, Severity, Source, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, near, prior, read, robot, sample, shape, written
from tests.factories import make_joint
from tests.model_server import Reply
from tests.scripted_server import Asked, ScriptedServer, scripted

pytestmark = pytest.mark.system

ASKED = 0.2
"""Where the slide is asked to be, m: there the arm is 10 mm inside the post, and 4 contacts make Φ 40 mm."""
PHI_M = 0.04
BY_MODEL = SearchSettings(proposer=Proposer.MODEL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two cubes of 0.2 m whose centres are 0.19 m apart where the slide is as asked."""
    cube = shape("0.2 0.2 0.2")
    slide = joint("slide", "prismatic", "body", "arm", xyz="-0.01 0 0", axis="1 0 0", limit="0 0.4")
    fixed = joint("post_joint", "fixed", "body", "post")
    urdf = robot(link("body", shape("0.2 0.2 0.2", xyz="0 0 1")), link("post", cube), link("arm", cube), fixed, slide)
    return written(tmp_path_factory.mktemp("raw") / "two", urdf)


def step(delta: float, **changes: object) -> Reply:
    return Reply(json.dumps({"state_ok": True, "approved": False, "deltas": {"slide": delta}, **changes}))


@dataclass
class Walked:
    """How a loop went: its end, what was asked, and the findings and calls of the questions."""

    walk: ModelWalk
    server: ScriptedServer
    questions: AskedSoFar

    @property
    def rows(self) -> list[TraceStep]:
        """The model's rows."""
        return [item for item in self.walk.trace if item.proposer == "model"]

    def told(self, index: int) -> dict[str, Any]:
        """The structured information of a question."""
        text = self.server.asked[index].text.split("<structured_information>\n")[1].split("\n</structured")[0]
        found: dict[str, Any] = json.loads(text)
        return found


def walked(folder: Path, out: Path, *replies: Reply, search: SearchSettings = BY_MODEL, **model: Any) -> Walked:
    """The loop with these replies, the last for ever."""
    number = iter(range(10_000))

    def script(asked: Asked) -> Reply:
        return replies[min(next(number), len(replies) - 1)]

    with asking(script, out, **model) as (server, settings, asker):
        found = walk_with(folder, settings.model_copy(update={"search": search}), asker)
    return Walked(found[0], server, found[1])


@contextmanager
def asking(
    script: Callable[[Asked], Reply], out: Path, **model: Any
) -> Iterator[tuple[ScriptedServer, Settings, Callable[[ModelRequest], ModelAnswer]]]:
    with pytest.MonkeyPatch.context() as patch, scripted(script) as server:
        for name in ("OPENAI_API_KEY", "OPENAI_API_BASE"):
            patch.delenv(name, raising=False)
        chosen = ModelSettings(model="openai/scripted", api_base=server.api_base, max_attempts=1, **model)
        session = open_gateway_session(out, "run", "two", chosen)
        yield server, NO_VIEWS.model_copy(update={"model": chosen}), lambda request: ask(request, chosen, session)


def walk_with(
    folder: Path, settings: Settings, asker: Callable[[ModelRequest], ModelAnswer]
) -> tuple[ModelWalk, AskedSoFar]:
    slide = make_joint("slide", "prismatic", ASKED).model_copy(update={"upper": 0.4, "open": 0.4})
    overlay = PhysicsOverlay(
        asset_id="two", scale=1.0, scale_source=Source.RULE, contact_friction=0.5, links=(), joints=(slide,)
    )
    questions = AskedSoFar(asker, settings.search.max_iterations)
    urdf, reach = folder / "mobility.urdf", reachable_bands(overlay, settings.search)
    scene = QuestionContext(read(folder).features, overlay, settings, urdf, reach, questions, "half open")
    with static_object(urdf, settings.engine) as item:
        evaluator = Evaluator(lambda pose: contact_points(item, pose), settings.search.max_evaluations)
        return refine_by_model(scene, evaluator), questions


def test_it_stops_where_nothing_overlaps(folder: Path, tmp_path: Path) -> None:
    found = walked(folder, tmp_path, step(0.004), step(0.0065), step(0.01))
    assert near(found.walk.pose["slide"], ASKED + 0.0105) and found.walk.phi_m == 0.0
    assert len(found.server.asked) == found.walk.iterations == 2
    assert [(row.accepted, row.evaluations, row.reason) for row in found.rows] == [(True, 1, "Φ falls")] * 2
    assert near([row.phi_before_m for row in found.rows], [PHI_M, 0.024], 1e-5)
    assert near(found.rows[1].moved["slide"], ASKED + 0.0105)
    assert found.walk.good and found.walk.finding.severity is Severity.INFO
    assert "after 2 iterations at Φ = 0 mm" in found.walk.finding.message
    first, second = found.told(0), found.told(1)
    assert "tried" not in first and first["severity"] == "severe: 40 mm"
    assert second["tried"] == [{"positions": {"slide": 0.204}, "phi_m": 0.024, "accepted": True}]
    assert second["focus_joints"][0]["position"] == 0.204 and second["focus_joints"][0]["desired"] == ASKED
    assert near(second["collisions"][0]["parted_by"][0]["change"], 0.006, 1e-3)
    assert '<user_guidance>\n"half open"\n' in found.server.asked[0].text
    labels = [[label for label, *_ in asked.images] for asked in found.server.asked]
    assert labels == [["perspective", "front", "right", "top"]] * 2


def test_it_stops_after_25_iterations_each_of_which_is_a_row(folder: Path, tmp_path: Path) -> None:
    found = walked(folder, tmp_path, step(0.0003))
    assert len(found.server.asked) == len(found.rows) == found.walk.iterations == 25
    assert all(row.accepted and row.phi_after_m < row.phi_before_m for row in found.rows)
    assert near(found.walk.pose["slide"], ASKED + 25 * 0.0003) and near(found.walk.phi_m, 4 * 0.0025, 1e-3)
    assert not found.walk.good and found.walk.finding.severity is Severity.WARNING
    assert found.walk.finding.message.endswith("the limit of 25 iterations is reached")
    assert len(found.told(24)["tried"]) == 24


def test_it_stops_at_a_spent_budget_and_says_so_in_a_row(folder: Path, tmp_path: Path) -> None:
    found = walked(folder, tmp_path, step(0.001), asset_calls=3)
    assert len(found.server.asked) == 3 and [row.accepted for row in found.rows] == [True, True, True, False]
    assert "budget" in found.rows[-1].reason and found.rows[-1].evaluations == 0 and found.rows[-1].moved == {}
    assert [finding.code for finding in found.questions.findings] == ["budget_spent"]
    assert "budget" in found.walk.finding.message
    # What is left of the paper's loop without a model: the best pose is perturbed, and its focus joints are searched.
    assert found.walk.phi_m < found.rows[-1].phi_after_m and found.walk.trace[-1].proposer == "perturbation"


def test_worse_proposals_are_refused_and_told_and_on_stagnation_the_best_is_perturbed(
    folder: Path, tmp_path: Path
) -> None:
    found = walked(folder, tmp_path, step(-0.01))
    refused = found.rows[:3]
    assert [(row.accepted, row.moved, row.phi_after_m) for row in refused] == [(False, {}, refused[0].phi_before_m)] * 3
    assert refused[0].reason == "Φ would be 80 mm"
    assert found.told(1)["tried"] == [{"positions": {"slide": 0.19}, "phi_m": 0.08}]
    assert found.told(1)["focus_joints"][0]["position"] == ASKED, "a refused step leads nowhere"
    fourth = found.walk.trace[4]
    assert fourth.proposer == "perturbation" and fourth.accepted and fourth.phi_after_m < PHI_M
    assert found.walk.phi_m <= min(item.phi_after_m for item in found.walk.trace)


def test_no_step_leads_further_from_what_is_asked_than_the_state_bears(folder: Path, tmp_path: Path) -> None:
    found = walked(folder, tmp_path, step(9.0))
    assert near(found.walk.pose["slide"], ASKED + BY_MODEL.state_tolerance * 0.4) and found.walk.phi_m == 0.0
    assert len(found.server.asked) == 1


def test_a_model_that_fails_midway_ends_in_a_row_and_what_it_gained_stays(folder: Path, tmp_path: Path) -> None:
    found = walked(folder, tmp_path, step(0.004), Reply("out of order", status=500, headers={"Retry-After": "0"}))
    assert [row.accepted for row in found.rows] == [True, False]
    assert "openai/scripted" in found.rows[1].reason and "500" in found.rows[1].reason
    assert [finding.code for finding in found.questions.findings] == ["refinement_unanswered"]
    assert found.walk.phi_m <= found.rows[0].phi_after_m < PHI_M
    assert [call.outcome for call in found.questions.calls] == ["ok", "provider_error"]


def test_an_answer_that_does_not_fit_costs_a_call_and_no_iteration(folder: Path, tmp_path: Path) -> None:
    found = walked(folder, tmp_path, Reply("I would open it."), step(0.011))
    assert [call.outcome for call in found.questions.calls] == ["invalid_answer", "ok"]
    assert len(found.rows) == found.walk.iterations == 1 and found.walk.phi_m == 0.0


@pytest.mark.parametrize("delta", [0.0, 0.01])
def test_a_state_that_cannot_pass_is_not_approved(folder: Path, tmp_path: Path, delta: float) -> None:
    found = walked(folder, tmp_path, step(delta, approved=True), step(0.0, approved=True))
    assert not found.rows[0].accepted and found.rows[0].reason == "the model approves the state"
    assert found.walk.trace[2].proposer == "perturbation", "it is stuck with a model that is content"


def test_a_state_that_passes_may_be_approved(folder: Path, tmp_path: Path) -> None:
    found = walked(folder, tmp_path, step(0.0096), step(0.0, approved=True))
    assert len(found.rows) == 2 and 1e-4 < found.walk.phi_m <= 0.002 and found.walk.good
    assert found.walk.finding.message.endswith("the model approves the state")


def test_the_same_loop_again_asks_nothing_and_ends_the_same(folder: Path, tmp_path: Path) -> None:
    first = walked(folder, tmp_path, step(0.004), step(0.0065))
    # Its server is closed by now: an answer that is not in the cache would be an error.
    gone = ModelSettings(model="openai/scripted", api_base=first.server.api_base, max_attempts=1)
    session = open_gateway_session(tmp_path, "next", "two", gone)
    settings = NO_VIEWS.model_copy(update={"model": gone, "search": BY_MODEL})
    walk, questions = walk_with(folder, settings, lambda request: ask(request, gone, session))
    assert walk == first.walk and [call.outcome for call in questions.calls] == ["cached"] * 2


def test_recorded_answers_are_taken_in_their_order_and_one_that_is_missing_ends_the_loop(
    folder: Path, tmp_path: Path
) -> None:
    for number, delta in enumerate((0.004, 0.003), start=1):
        (tmp_path / f"two.refinement.{number}.json").write_text(str(step(delta).content), encoding="utf-8")
    recorded = ModelSettings(model=f"recorded/{tmp_path}")
    session = open_gateway_session(tmp_path / "out", "run", "two", recorded)
    settings = NO_VIEWS.model_copy(update={"model": recorded, "search": BY_MODEL})
    walk, questions = walk_with(folder, settings, lambda request: ask(request, recorded, session))
    rows = [row for row in walk.trace if row.proposer == "model"]
    assert [row.accepted for row in rows] == [True, True, False] and near(rows[1].moved["slide"], ASKED + 0.007)
    assert "two.refinement.3.json" in rows[2].reason
    assert [finding.code for finding in questions.findings] == ["refinement_unanswered"]


# The whole pipeline


def by_model(settings: Settings = NO_VIEWS) -> Settings:
    return settings.model_copy(update={"search": BY_MODEL})


def test_crossing_flaps_are_parted_by_the_offline_prior_alone(tmp_path: Path) -> None:
    record = refine_asset(sample("planted_crossed_flaps"), tmp_path, by_model(), prior)
    assert record.status is Status.OK and record.measurement is not None, record.reason
    rows = [item for item in record.trace if item.proposer == "model"]
    assert rows and any(row.accepted for row in rows)
    assert {item.proposer for item in record.trace} & {"line", "grid", "perturbation", "groups"} == set()
    (ended,) = [finding for finding in record.findings if finding.code == "model_loop"]
    assert f"after {len(rows)} iterations" in ended.message
    away: Mapping[str, float] = {
        item.name: abs(item.initial_position - item.closed) / (item.upper - item.lower)
        for item in record.overlay.joints if item.upper is not None and item.lower is not None
    } if record.overlay is not None else {}  # fmt: skip
    assert away and max(away.values()) <= 0.1 + 1e-9


def test_an_object_without_overlap_asks_nothing(tmp_path: Path) -> None:
    asked: list[str] = []

    def counting(request: ModelRequest) -> ModelAnswer:
        asked.append(request.purpose)
        return prior(request)

    record = refine_asset(sample("box_chest"), tmp_path, by_model(), counting)
    assert record.status is Status.OK and asked == ["synthesis"]
    assert [item.proposer for item in record.trace].count("model") == 0

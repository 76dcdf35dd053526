"""States that do not last: a lid without friction that falls, and what a model may do about it; a real simulation."""

import json
from pathlib import Path

import pytest

from asset2sim.assets.folder import Folder
from asset2sim.refinement.ask_model import AskedSoFar, QuestionContext
from asset2sim.refinement.ask_state import ask_lasting_state, joints_not_holding, measure_rest_from, nearer_to_request
from asset2sim.refinement.collision.part_links import CutAttempt
from asset2sim.refinement.context import Log, RefinementContext
from asset2sim.refinement.position_bands import reachable_bands
from schemas.interaction import Measurement
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import CollisionSettings, EngineSettings, Settings, Thresholds
from schemas.vocabulary import CollisionMode, Engine, Source, Status
from tasks.pipeline import refine_asset
from tests.assets import joint, link, near, prior, read, robot, sample, shape, written
from tests.builders import UrdfJoint, UrdfLink, box, write_urdf
from tests.factories import make_joint, make_measurement
from tests.marks import OBJECTS, needs_objects

UPRIGHT = 1.5708
STOP = 1.65
"""The lid's upper limit, rad: just past upright, so that a lid which leans on it stays."""
ASKED = 1.52
"""Where the lid was asked to be, rad: not quite upright, so that it falls shut."""
SETTINGS = Settings(engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False))


def chest(folder: Path) -> Path:
    """A heavy box of 0.4 m, and a lid that lies on it and turns up about its rear edge without friction."""
    folder.mkdir(parents=True)
    body = UrdfLink("body", mass=20.0, inertia=(0.5, 0, 0, 0.5, 0, 0.5), shapes=((box(0.4, 0.4, 0.4), (0, 0, 0.2)),))
    lid = UrdfLink("lid", mass=1.0, inertia=(0.02, 0, 0, 0.02, 0, 0.03), shapes=((box(0.4, 0.4, 0.02), (0.2, 0, 0)),))
    lid = UrdfLink("lid", lid.mass, (0.2, 0.0, 0.0), lid.inertia, lid.shapes)
    hinge = UrdfJoint(
        "hinge", "revolute", "body", "lid", axis=(0, -1, 0), xyz=(-0.2, 0, 0.42), lower=0.0, upper=STOP, damping=0.05
    )
    path = write_urdf(folder, [body, lid], [hinge])
    return path.rename(folder / "mobility.urdf")


def asking_for(position: float, **changes: object) -> PhysicsOverlay:
    fields = {"position_source": Source.USER, "holds": True, "upper": STOP, "open": STOP, **changes}
    hinge = make_joint("hinge", initial_position=position).model_copy(update=fields)
    return PhysicsOverlay(
        asset_id="chest", scale=1.0, scale_source=Source.RULE, contact_friction=0.5, links=(), joints=(hinge,)
    )


class Deltas:
    """A model that proposes these steps, one after the other, and what it was asked."""

    def __init__(self, *deltas: float) -> None:
        self.deltas, self.asked = deltas, list[ModelRequest]()

    def __call__(self, request: ModelRequest) -> ModelAnswer:
        delta = self.deltas[min(len(self.asked), len(self.deltas) - 1)]
        self.asked.append(request)
        step = {"state_ok": False, "approved": False, "deltas": {"hinge": delta}}
        return ModelAnswer(content=json.dumps(step), calls=())


def scene_of(urdf: Path, overlay: PhysicsOverlay, model: Deltas, settings: Settings = SETTINGS) -> QuestionContext:
    features = read(urdf.parent).features
    return QuestionContext(
        features, overlay, settings, urdf, reachable_bands(overlay, settings.search), AskedSoFar(model, 2)
    )


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return chest(tmp_path_factory.mktemp("raw") / "chest")


@pytest.fixture(scope="module")
def shut(urdf: Path) -> Measurement:
    """What becomes of the lid where it was asked to be."""
    measured = measure_rest_from(urdf, asking_for(ASKED), {"hinge": ASKED}, SETTINGS)
    assert measured is not None
    return measured


@pytest.mark.system
def test_a_lid_that_falls_is_seen(shut: Measurement) -> None:
    assert abs(shut.joints[0].final_position) < 0.05, "it does fall shut"
    assert joints_not_holding(asking_for(ASKED), shut, SETTINGS) == ("hinge",)


@pytest.mark.system
@pytest.mark.parametrize(
    "changes",
    [
        {"holds": False},
        {"position_source": Source.RULE},
        {"lower": None},
        {"initial_position": 0.01},
        {"name": "other"},
    ],
)
def test_what_may_swing_and_what_nobody_asked_for_and_what_stayed_have_not_fallen(
    shut: Measurement, changes: dict[str, object]
) -> None:
    assert joints_not_holding(asking_for(ASKED, **changes), shut, SETTINGS) == ()


def test_a_joint_with_next_to_no_range_has_not_fallen() -> None:
    tiny = asking_for(0.0, upper=0.01)
    measured = make_measurement(joints=(make_measurement().joints[0].model_copy(update={"final_position": 0.01}),))
    assert joints_not_holding(tiny, measured, SETTINGS) == ()
    strict = Settings(thresholds=Thresholds(hold_rad=1e-3))
    assert joints_not_holding(tiny, measured, strict) == ("hinge",)


@pytest.mark.system
def test_a_state_from_which_it_stays_is_found_by_the_simulator(urdf: Path, shut: Measurement) -> None:
    model = Deltas(0.02, 0.09)  # still short of upright; past it
    overlay = asking_for(ASKED)
    found = ask_lasting_state(scene_of(urdf, overlay, model), overlay, shut, ("hinge",))
    assert found.pose == pytest.approx({"hinge": ASKED + 0.09}) and ASKED + 0.09 > UPRIGHT
    assert [step.accepted for step in found.steps] == [False, True]
    assert found.steps[0].moved == {} and "'hinge' does not stay" in found.steps[0].reason
    assert found.steps[1].moved == pytest.approx({"hinge": ASKED + 0.09})
    first, second = (request.text for request in model.asked)
    assert '"problem":"fell"' in first and '"settled":' in first and '"tried"' not in first
    assert '"tried":[{"positions":{"hinge":1.54}' in second


@pytest.mark.system
def test_a_proposal_beyond_the_state_is_cut_off_and_one_that_helps_nothing_is_refused(
    urdf: Path, shut: Measurement
) -> None:
    model = Deltas(-9.0, -0.1)
    overlay = asking_for(ASKED)
    found = ask_lasting_state(scene_of(urdf, overlay, model), overlay, shut, ("hinge",))
    assert found.pose is None and [step.accepted for step in found.steps] == [False, False]
    least = ASKED - SETTINGS.search.state_tolerance * STOP
    assert f'"tried":[{{"positions":{{"hinge":{least:.5g}' in model.asked[1].text


# Where the search had to leave the state


def crowded(folder: Path) -> Path:
    """A post, and an arm on a slide that must be beyond 0.09 m to be clear of it."""
    return written(
        folder,
        robot(
            link("body", shape("0.2 0.2 0.2", xyz="0 0 1")),
            link("post", shape("0.2 0.2 0.2")),
            link("arm", shape("0.2 0.2 0.2")),
            joint("post_joint", "fixed", "body", "post", xyz="0 0 0"),
            joint("hinge", "prismatic", "body", "arm", xyz="0.11 0 0", axis="1 0 0", limit="0 1"),
        ),
    )


@pytest.mark.system
def test_a_state_that_was_left_is_brought_back_as_far_as_nothing_overlaps(tmp_path: Path) -> None:
    folder = crowded(tmp_path / "crowded")
    overlay = asking_for(0.0, type="prismatic", upper=1.0, open=1.0)
    urdf = folder / "mobility.urdf"
    model = Deltas(-0.1, -0.06)  # the first overlaps again, the second does not
    scene = scene_of(urdf, overlay, model, Settings(collision=CollisionSettings(mode=CollisionMode.KEEP)))
    extraction = read(folder)
    loop = RefinementContext(extraction, None, overlay, Source.USER, {}, scene.settings, Log())  # type: ignore[arg-type]
    best = CutAttempt({"hinge": 0.18}, {}, 0.0, 0.0)
    back = nearer_to_request(scene, loop, Folder(folder, {}, {}, CollisionMode.KEEP), best, 0.1)
    assert near(back.positions["hinge"], scene.settings.search.state_tolerance) and back.phi == 0.0, (
        "as near as its state's tolerance allows"
    )
    steps = loop.log.trace
    assert [(step.proposer, step.accepted) for step in steps] == [("model", False), ("model", True)]
    assert "Φ would be" in steps[0].reason and '"problem":"moved"' in model.asked[0].text
    assert '"desired_phi_m":0.1' in model.asked[0].text


@pytest.mark.system
@needs_objects
def test_a_real_suitcase_that_its_lid_pulls_over_is_laid_on_its_back_and_keeps_the_state_that_is_asked(
    tmp_path: Path,
) -> None:
    only = {"write": False}
    engine = SETTINGS.engine.model_copy(update={"interact": True, "verify": (Engine.PYBULLET,)})
    views = SETTINGS.views.model_copy(update=only)
    settings = SETTINGS.model_copy(update={"views": views, "engine": engine})
    record = refine_asset(sample("103755", OBJECTS), tmp_path, settings, prior)
    assert record.status is Status.OK and record.overlay is not None, record.reason
    assert [finding.code for finding in record.findings].count("laid_down") == 1
    lid = next(item for item in record.overlay.joints if item.name == "joint_1")
    (report,) = record.reports
    assert report.interaction is not None and lid.asked_position is not None
    (seen,) = [item for item in report.interaction.settled if item.joint == "joint_1"]
    assert seen.share <= settings.thresholds.state_share and seen.asked == lid.asked_position

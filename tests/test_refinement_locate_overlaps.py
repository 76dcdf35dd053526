"""Where two boxes overlap, on which side, and which joint parts them: worked out by hand."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from asset2sim.models.prompts import OverlapPlace, StateProblem
from asset2sim.refinement.ask_model import AskedSoFar, QuestionContext, propose_pose
from asset2sim.refinement.locate_overlaps import LocatedOverlaps, direction_words, locate_overlaps, side_of, side_rows
from asset2sim.refinement.model_loop import parted_pairs
from asset2sim.refinement.position_bands import reachable_bands
from schemas.interaction import ContactPair
from schemas.overlay import PhysicsOverlay
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import Source
from tests.assets import joint, link, near, read, robot, shape, written
from tests.factories import make_joint

np = pytest.importorskip("numpy")

ENGINE = EngineSettings()
CUBE = "0.2 0.2 0.2"


def crossing(folder: Path, arm: str, robot_name: str = "thing") -> Path:
    """A post at the origin and an arm, cubes of 0.2 m whose centres are 0.19 m apart along x: 10 mm in each other."""
    urdf = robot(
        link("body", shape(CUBE, xyz="0 0 1")),
        link("post", shape(CUBE)),
        link("arm", shape(CUBE, xyz="0 1 0" if "hinge" in arm else "0 0 0")),
        joint("post_joint", "fixed", "body", "post"),
        arm,
    )
    return written(folder, urdf.replace('name="thing"', f'name="{robot_name}"'))


SLIDE = joint("slide", "prismatic", "body", "arm", xyz="0.19 0 0", axis="1 0 0", limit="0 0.4")
BACKWARDS = joint("slide", "prismatic", "body", "arm", xyz="0.19 0 0", axis="-1 0 0", limit="0 0.4")
HINGE = joint("hinge", "revolute", "body", "arm", xyz="0.19 -1 0", axis="0 0 1", limit="-1 1")
PAST = joint("slide", "prismatic", "body", "arm", xyz="0.19 0 0", axis="0 0 1", limit="0 0.4")


def overlay_of(name: str, kind: str, **changes: object) -> PhysicsOverlay:
    part = make_joint(name, kind, 0.0).model_copy(update={"upper": 0.4, "open": 0.4, **changes})
    return PhysicsOverlay(
        asset_id="two", scale=1.0, scale_source=Source.RULE, contact_friction=0.5, links=(), joints=(part,)
    )


def located(folder: Path, overlay: PhysicsOverlay) -> LocatedOverlaps:
    return locate_overlaps(read(folder).features, overlay, folder / "mobility.urdf", overlay.initial_positions, ENGINE)


@pytest.mark.system
@pytest.mark.parametrize(("arm", "change"), [(SLIDE, 0.01), (BACKWARDS, -0.01)])
def test_two_boxes_that_overlap_by_10_mm_along_x_are_parted_by_10_mm_along_x(
    tmp_path: Path, arm: str, change: float
) -> None:
    found = located(crossing(tmp_path / "two", arm), overlay_of("slide", "prismatic"))
    (pair,) = found.pairs
    assert (pair.link_a, pair.link_b) == ("arm", "post") and near(pair.depth_m, 0.01, 1e-6)
    assert near(found.phi_m, 0.01 * pair.n_points, 1e-6)
    place = found.places["arm", "post"]
    # An object that is not PartNet-Mobility's faces +x, where the arm is.
    assert (place.at_a, place.at_b, place.a_leaves) == ("back", "front", "front")
    assert place.parted_by == pytest.approx({"slide": change}, abs=1e-6)


@pytest.mark.system
def test_the_sides_of_a_partnet_object_are_those_of_one_that_faces_minus_x(tmp_path: Path) -> None:
    folder = crossing(tmp_path / "two", SLIDE, "partnet_two")
    place = located(folder, overlay_of("slide", "prismatic")).places["arm", "post"]
    assert (place.at_a, place.at_b, place.a_leaves) == ("front", "back", "back")


@pytest.mark.system
def test_a_hinge_a_metre_away_parts_them_by_its_angle_on_that_lever(tmp_path: Path) -> None:
    overlay = overlay_of("hinge", "revolute", lower=-1.0, upper=1.0)
    place = located(crossing(tmp_path / "two", HINGE), overlay).places["arm", "post"]
    # Turning about z by dq moves the contact, 1 m along y from the hinge, by -dq metres along x.
    assert place.parted_by == pytest.approx({"hinge": -0.01}, abs=2e-4)


@pytest.mark.system
def test_a_joint_that_slides_them_past_each_other_does_not_part_them(tmp_path: Path) -> None:
    assert (
        located(crossing(tmp_path / "two", PAST), overlay_of("slide", "prismatic")).places["arm", "post"].parted_by
        == {}
    )


@pytest.mark.system
def test_the_prompt_of_two_boxes_holds_every_block(tmp_path: Path) -> None:
    folder, overlay, asked = crossing(tmp_path / "two", SLIDE), overlay_of("slide", "prismatic"), list[ModelRequest]()

    def ask(request: ModelRequest) -> ModelAnswer:
        asked.append(request)
        return ModelAnswer(content='{"state_ok": true, "approved": false, "deltas": {"slide": 0.5}}', calls=())

    settings = Settings().model_copy(update={"model": Settings().model.model_copy(update={"model": "openai/eyes"})})
    scene = QuestionContext(
        read(folder).features, overlay, settings, folder / "mobility.urdf", reachable_bands(overlay, settings.search),
        AskedSoFar(ask, 1), "a post and its arm, 'closed'",
    )  # fmt: skip
    problem = scene.overlap({"slide": 0.0}, (), (("arm", "body"),))
    assert isinstance(problem, StateProblem)
    proposed = propose_pose(scene, problem, ("slide",))
    reach = round(settings.search.state_tolerance * 0.4, 9)
    assert proposed.pose == pytest.approx({"slide": reach}), "no further than the band from what is asked"
    (request,) = asked
    assert [image.label for image in request.images] == ["perspective", "front", "right", "top"]
    assert all(image.png.startswith(b"\x89PNG") for image in request.images)
    assert len({image.png for image in request.images}) == 4
    blocks = dict(re.findall(r"<(\w+)>\n(.*)\n</\1>", request.text))
    assert json.loads(blocks["user_guidance"]) == "a post and its arm, 'closed'"
    told: dict[str, Any] = json.loads(blocks["structured_information"])
    assert told["severity"] == "severe: 40 mm" and told["solved_pairs"] == [["arm", "body"]]
    (collision,) = told["collisions"]
    assert near(collision.pop("depth_mm"), 10.0, 1e-3) and near(collision.pop("penetration_m"), 0.04, 1e-3)
    assert near(collision["parted_by"][0].pop("change"), 0.01, 1e-3)
    assert collision == {
        "link_a": "arm", "link_b": "post", "label_a": "", "label_b": "", "at_a": "back", "at_b": "front",
        "a_leaves": "front", "parted_by": [{"joint": "slide", "toward": "open"}],
    }  # fmt: skip
    (focus,) = told["focus_joints"]
    assert (focus["lower"], focus["upper"], focus["desired"], focus["reach"]) == (0.0, 0.4, 0.0, [0.0, reach])
    assert (focus["parent"], focus["child"], focus["asked"]) == ("body", "arm", True)


def test_sides_and_directions_have_words() -> None:
    sides = side_rows(np.array([-1.0, 0.0, 0.0]))
    box = (np.array([0.0, 0.0, 0.0]), np.array([2.0, 2.0, 2.0]))
    assert side_of(np.array([1.0, 1.2, 0.9]), box, sides) == "middle"
    assert side_of(np.array([0.1, 1.8, 2.0]), box, sides) == "top front left"
    assert direction_words(np.array([0.0, -1.0, 0.0]), sides) == "right"
    assert direction_words(np.array([0.7, 0.0, 0.7]), sides) == "back top"
    assert direction_words(np.array([0.1, 0.0, 0.1]), sides) == "unclear", "contacts that face each other cancel out"


def test_pairs_that_no_longer_overlap_are_solved() -> None:
    first, second = (ContactPair(link_a="a", link_b=b, depth_m=0.1, penetration_m=0.1, n_points=1) for b in ("b", "c"))
    assert parted_pairs((first, second), (second,)) == (("a", "b"),) and parted_pairs((first,), (first, second)) == ()
    assert OverlapPlace("", "", "", {}).parted_by == {}

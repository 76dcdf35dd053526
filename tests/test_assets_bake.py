"""Baking a state: joint q of the baked URDF is joint q + q₀ of the original, and unbaking restores every letter."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree
from scipy.spatial.transform import Rotation

from asset2sim.assets.folder import write_folder
from asset2sim.assets.hulls import collision_hulls
from asset2sim.assets.urdf.bake import RECORD_NAME, Bake, bake, bake_file, baked, roll_pitch_yaw, unbake
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.engines.contacts import penetration
from asset2sim.engines.static_object import contacts_at
from asset2sim.validation.validate import validate
from schemas.errors import UsageError
from schemas.overlay import JointProposal, Overlay, PhysicsOverlay
from schemas.vocabulary import Source
from tests.assets import NO_VIEWS, joint, link, near, read, robot, shape, written

STATE = {"hinge": 0.7, "slide": -0.03, "wheel": 2.5, "follower": -0.4}
CHAIN = robot(
    "<!-- asset2sim: scale 1; initial joint positions (rad, m): hinge = 0.7 -->",
    "<!-- a note that stays -->",
    *(link(name, shape("0.1 0.1 0.1")) for name in ("body", "door", "tray", "disc", "tip", "lid")),
    '<joint name="hinge" type="revolute"><origin xyz="0.3 -0.2 1" rpy="0.4 -0.9 2.1"/><parent link="body"/>'
    '<child link="door"/><axis xyz="0.6 0 0.8"/><limit lower="-0.1" upper="1.9" effort="1" velocity="1"/>'
    '<dynamics damping="0.1" spring_stiffness="2" spring_reference="0.25"/><calibration rising="0.125"/>'
    '<safety_controller k_velocity="5" soft_lower_limit="0" soft_upper_limit="1.5"/></joint>',
    '<joint name="slide" type="prismatic"><parent link="door"/><child link="tray"/><axis xyz="0 2 0"/>'
    '<limit lower="-0.03" upper="0.4" effort="1" velocity="1"/></joint>',
    '<joint name="wheel" type="continuous"><origin rpy="0 1.5707963267948966 0"/><parent link="tray"/>'
    '<child link="disc"/><axis xyz="0 1 0"/><limit effort="1" velocity="1"/></joint>',
    '<joint name="weld" type="fixed"><origin xyz="0 0 0.2"/><parent link="disc"/><child link="tip"/></joint>',
    '<joint name="follower" type="revolute"><origin xyz="1 0 0"/><parent link="body"/><child link="lid"/>'
    '<limit lower="-3" upper="3" effort="1" velocity="1"/><mimic joint="hinge" multiplier="-2" offset="1"/></joint>',
).encode()  # fmt: skip
POSITION = st.floats(-3.0, 3.0)


def link_poses(document: bytes, positions: dict[str, float]) -> dict[str, np.ndarray]:
    """Every link's pose in the root, worked out from the URDF's words with scipy alone."""
    poses = {"body": np.eye(4)}
    for element in etree.fromstring(document).findall("joint"):
        name, kind, child, parent = (
            str(element.get("name")), str(element.get("type")), part(element, "child")["link"],
            part(element, "parent")["link"],
        )  # fmt: skip
        step = np.eye(4)
        step[:3, 3] = words(part(element, "origin").get("xyz", "0 0 0"))
        turn = Rotation.from_euler("xyz", words(part(element, "origin").get("rpy", "0 0 0")))
        axis = words(part(element, "axis").get("xyz", "1 0 0"))
        along = axis / np.linalg.norm(axis) * positions.get(name, 0.0)
        if kind == "prismatic":
            step[:3, 3] += turn.apply(along)
        elif kind != "fixed":
            turn = turn * Rotation.from_rotvec(along)
        step[:3, :3] = turn.as_matrix()
        poses[child] = poses[parent] @ step
    return poses


def part(joint_element: etree._Element, tag: str) -> dict[str, str]:
    found = joint_element.find(tag)
    return {} if found is None else {str(key): str(value) for key, value in found.items()}


def words(text: str) -> np.ndarray:
    return np.array([float(word) for word in text.split()])


def attribute(document: bytes, name: str, path: str) -> float:
    tag, key = path.split("/")
    element = etree.fromstring(document).find(f"joint[@name='{name}']/{tag}")
    assert element is not None
    return float(str(element.get(key)))


def comments(document: bytes) -> list[str]:
    return [str(node.text) for node in etree.fromstring(document) if isinstance(node, etree._Comment)]


def elements(document: bytes) -> list[tuple[str, dict[str, str]]]:
    """Every element's tag and attributes, in order, comments left out."""
    nodes = etree.fromstring(document).iter()
    return [(str(n.tag), {str(k): str(v) for k, v in n.items()}) for n in nodes if not isinstance(n, etree._Comment)]


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.fixed_dictionaries(dict.fromkeys(STATE, POSITION)), st.fixed_dictionaries(dict.fromkeys(STATE, POSITION)))
def test_a_baked_pose_is_the_original_pose_shifted(zero: dict[str, float], pose: dict[str, float]) -> None:
    document, _ = bake(CHAIN, zero)
    found = link_poses(document, {name: pose[name] - zero[name] for name in pose})
    for name, wanted in link_poses(CHAIN, pose).items():
        np.testing.assert_allclose(found[name], wanted, atol=1e-9, err_msg=name)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.dictionaries(st.sampled_from(sorted(STATE)), POSITION))
def test_unbaking_restores_the_document(zero: dict[str, float]) -> None:
    plain = unbake(bake(CHAIN, {})[0])
    document, record = bake(CHAIN, zero)
    assert unbake(document) == unbake(document, record) == plain
    assert elements(plain) == elements(CHAIN) and comments(plain) == comments(CHAIN)


def test_what_is_measured_from_zero_is_shifted() -> None:
    document, record = bake(CHAIN, STATE)
    wanted = {
        "limit/lower": -0.8, "limit/upper": 1.2, "dynamics/spring_reference": -0.45, "calibration/rising": -0.575,
        "safety_controller/soft_lower_limit": -0.7, "safety_controller/soft_upper_limit": 0.8,
    }  # fmt: skip
    assert {path: attribute(document, "hinge", path) for path in wanted} == pytest.approx(wanted)
    assert attribute(document, "hinge", "dynamics/spring_stiffness") == 2.0
    assert attribute(document, "slide", "limit/lower") == 0.0
    assert attribute(document, "slide", "limit/upper") == pytest.approx(0.43)
    assert record.positions == STATE
    # follower = -2 hinge + 1 in the old positions: at hinge' = 0.3, hinge = 1 and follower = -1, so follower' = -0.6.
    assert -2.0 * 0.3 + attribute(document, "follower", "mimic/offset") == pytest.approx(-0.6)


def test_a_follower_that_stays_is_still_told_where_its_leader_starts() -> None:
    document, _ = bake(CHAIN, {"hinge": 0.7})
    assert attribute(document, "follower", "mimic/offset") == pytest.approx(1.0 - 2.0 * 0.7)
    assert attribute(document, "follower", "limit/lower") == -3.0


def test_the_comment_says_so_and_the_old_one_returns() -> None:
    document, _ = bake(CHAIN, STATE)
    assert [text[:16] for text in comments(document)] == [" asset2sim bake:", " a note that sta"]
    assert b"initial joint positions" in unbake(document)


def test_baking_twice_is_baking_once() -> None:
    once, _ = bake(CHAIN, STATE)
    assert bake(once, STATE)[0] == once
    assert bake(once, {"hinge": 0.1})[0] == bake(CHAIN, {"hinge": 0.1})[0]


def test_an_unknown_or_fixed_joint_is_refused() -> None:
    with pytest.raises(UsageError, match="weld"):
        bake(CHAIN, {"weld": 0.1})
    with pytest.raises(UsageError, match=r"bake\.json"):
        unbake(CHAIN)


def test_names_with_two_hyphens_survive_the_comment() -> None:
    named = CHAIN.replace(b'"hinge"', b'"a--b"')
    document, _ = bake(named, {"a--b": 0.5})
    assert unbake(document) == unbake(bake(named, {})[0])


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-8, np.pi / 2 - 1e-5])
def test_angles_hold_their_digits_where_roll_and_yaw_run_together(pitch: float) -> None:
    wanted = Rotation.from_euler("xyz", [0.3, pitch, -1.1])
    found = Rotation.from_euler("xyz", roll_pitch_yaw(wanted.as_matrix()))
    assert (found * wanted.inv()).magnitude() < 1e-9


PRESS = robot(
    link("body", shape("0.4 0.4 0.1")),
    link("lid", shape("0.4 0.4 0.05", xyz="0.2 0 0")),
    link("pin", shape("0.05 0.05 0.3")),
    joint("pin_slide", "prismatic", "body", "pin", xyz="0 0 0.1", axis="0 0 1", limit="0 0.3"),
    joint("lid_hinge", "revolute", "body", "lid", xyz="-0.2 0 0.2", axis="0 -1 0", limit="0 1.5"),
)
PROPOSAL = Overlay(
    scale=0.5, joints=(JointProposal(name="lid_hinge", spring_hz=2.0, spring_rest=0.1),),
    initial_joint_positions={"lid_hinge": 0.3, "pin_slide": 0.2}, asked=("lid_hinge", "pin_slide"),
)  # fmt: skip


def refined(folder: Path) -> tuple[Path, PhysicsOverlay]:
    item = read(written(folder / "in", PRESS))
    overlay, _ = validate(item, PROPOSAL, Source.MODEL, 0.5, NO_VIEWS.physics)
    return write_folder(item, overlay, collision_hulls(item, 0.5), folder / "out", NO_VIEWS.physics).urdf, overlay


def test_a_refined_file_and_its_overlay_are_baked_alike(tmp_path: Path) -> None:
    urdf, overlay = refined(tmp_path)
    target = tmp_path / "baked" / "mobility.urdf"
    target.parent.mkdir()
    record = bake_file(urdf, overlay.initial_positions, target)
    assert Bake.model_validate_json((target.parent / RECORD_NAME).read_text()) == record
    shifted = baked(overlay)
    assert shifted.initial_positions == {"lid_hinge": 0.0, "pin_slide": 0.0}
    model = {item.name: item for item in read_urdf(target).joints}
    for part in shifted.joints:
        assert near((model[part.name].limit.lower, model[part.name].limit.upper), (part.lower, part.upper), 1e-8)
        assert near(attribute(target.read_bytes(), part.name, "dynamics/spring_reference"), part.spring_reference, 1e-8)
    assert unbake(target.read_bytes(), record) == urdf.read_bytes()


@pytest.mark.system
def test_a_baked_zero_overlaps_as_the_state_does(tmp_path: Path) -> None:
    urdf, overlay = refined(tmp_path)
    # The pin, 10 cm out, stands in the lid that is opened by 0.3 rad.
    state = penetration(contacts_at(urdf, overlay.initial_positions, NO_VIEWS.engine))
    target = urdf.parent / "baked.urdf"
    bake_file(urdf, overlay.initial_positions, target)
    assert state > 1e-3
    assert near(penetration(contacts_at(target, {}, NO_VIEWS.engine)), state, 1e-5)
    assert not near(penetration(contacts_at(urdf, {}, NO_VIEWS.engine)), state, 1e-3)

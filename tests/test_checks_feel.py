"""Parts of nobody's list take what a hand feels, by the rules and in engines, and springs of a URDF bear plain use."""

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest
from lxml import etree

from asset2sim.assets.folder import write_folder
from asset2sim.assets.hulls import collision_hulls
from asset2sim.checks.declared_check import check_of
from asset2sim.checks.effort import effort_verdict
from asset2sim.checks.plain import MODE
from asset2sim.checks.verify import verify
from asset2sim.validation.validate import validate
from schemas.interaction import Effort
from schemas.overlay import JointProposal, LinkProposal, Overlay, PhysicsOverlay
from schemas.verdict import CheckVerdict
from schemas.vocabulary import Engine, FailureMode, OverlapCause, Source
from tests.assets import NO_VIEWS, joint, link, read, robot, written

pytestmark = pytest.mark.system

SHAPE = '<{0}><origin xyz="0 0 {2}"/><geometry>{1}</geometry></{0}>'
DISC = '<cylinder radius="0.012" length="0.02"/>'
TURNS, PRESSED = {"holds": True}, {"press_start": 1.0, "press_end": 1.5}


def shape(kind: str, height: float) -> str:
    return SHAPE.format("visual", kind, height) + SHAPE.format("collision", kind, height)


def thing(
    folder: Path, part: str, kind: str, motion: str, feel: Mapping[str, object], limit: str
) -> tuple[Path, PhysicsOverlay]:
    """An object of no listed category whose one part stands on top of it."""
    axis = "0 0 1" if motion != "prismatic" else "1 0 0"
    body = link("body", shape('<box size="0.1 0.1 0.2"/>', 0.0))
    made = robot(
        body,
        link(f"{part}_1", shape(kind, 0.0)),
        joint(part, motion, "body", f"{part}_1", xyz="0 0 0.115", axis=axis, limit=limit),
    )
    item = read(written(folder / "in", made))
    links = tuple(LinkProposal(name=name, mass_kg=mass) for name, mass in (("body", 6.0), (f"{part}_1", 0.002)))
    asked = Overlay(scale=1.0, links=links, joints=(JointProposal.model_validate({"name": part, **feel}),))
    overlay, _ = validate(item, asked, Source.MODEL, 0.5, NO_VIEWS.physics)
    return write_folder(item, overlay, collision_hulls(item, 1.0), folder / "out", NO_VIEWS.physics).urdf, overlay


def found(engine: Engine, urdf: Path, overlay: PhysicsOverlay, mode: FailureMode) -> list[CheckVerdict]:
    """The verdicts of one check in one engine."""
    (report,) = verify([engine], urdf, overlay, lambda *_: OverlapCause.AUTHORED, NO_VIEWS, mode)
    assert report.problem is None and report.interaction is not None
    joints, limits = {joint.name: joint for joint in overlay.joints}, NO_VIEWS.thresholds
    check = check_of(mode)
    assert check is not None and check.judge is not None
    verdicts = list(check.judge(report.interaction, joints, limits))
    assert verdicts
    return verdicts


@pytest.mark.parametrize(
    ("part", "kind", "motion", "least", "name"),
    [
        ("cap", DISC, "continuous", 35.0, "screw cap"),
        ("knob", DISC, "continuous", 0.2, "knob"),
        ("wheel", DISC, "continuous", 1.7, "thumbwheel"),
        ("clip", '<box size="0.03 0.004 0.002"/>', "revolute", 0.25, "part moved by a fingertip"),
        ("visor", '<box size="0.2 0.1 0.002"/>', "revolute", 0.5, "part moved by one hand"),
    ],
)
def test_a_part_of_no_listed_object_takes_what_a_hand_feels(
    tmp_path: Path, part: str, kind: str, motion: str, least: float, name: str
) -> None:
    urdf, overlay = thing(tmp_path, part, kind, motion, TURNS, "-1 1")
    (made,) = overlay.joints
    assert made.effort_range is not None and made.effort_range.kind == name
    assert made.effort_range.least_n == pytest.approx(least, rel=0.5) and made.effort_range.source
    for engine in (Engine.PYBULLET, Engine.MUJOCO):
        assert not [item.reason for item in found(engine, urdf, overlay, FailureMode.EFFORT) if not item.passed]
    record = {"joint": part, "way": "opening", "lever_m": 1.0, "tips_at_n": None, "slides_at_n": None}
    half = Effort.model_validate({**record, "effort": 0.5 * made.effort_range.least_n})
    assert not effort_verdict([half], made, "any").passed


def test_a_spring_relaxed_within_the_range_is_felt_at_its_end(tmp_path: Path) -> None:
    # 0.5 N·m/rad over 1 rad at 0.1 m: 5 N at the end, none at the start; at 0.2 m 2.5 N.
    _, overlay = thing(tmp_path, "visor", '<box size="0.2 0.1 0.002"/>', "revolute", TURNS, "-1 1")
    (made,) = overlay.joints
    assert made.effort_range is not None
    asked = made.effort_range.model_copy(update={"least_n": 4.0, "most_n": 22.0})
    spring = {"stiffness": 0.5, "spring_reference": 0.0, "holds": False, "effort_range": asked}
    lever = made.model_copy(update=spring)
    record = {"joint": "visor", "effort": 0.001, "tips_at_n": None, "slides_at_n": None}
    near, far = (
        [Effort.model_validate({**record, "way": way, "lever_m": reach}) for way in ("opening", "closing")]
        for reach in (0.1, 0.2)
    )
    assert effort_verdict(near, lever, "any").passed and not effort_verdict(far, lever, "any").passed
    at_a_stop = lever.model_copy(update={"lower": 0.0})
    assert not effort_verdict(near, at_a_stop, "any").passed, "one that can be preloaded is felt where it starts"


def test_a_light_button_keeps_its_spring_and_its_urdf_has_one_that_plain_use_bears(tmp_path: Path) -> None:
    urdf, overlay = thing(tmp_path, "button", DISC, "prismatic", PRESSED, "0 0.001")
    (made,) = overlay.joints
    at_rest = made.stiffness * (made.initial_position - made.spring_reference)
    assert at_rest == pytest.approx(1.0, rel=0.1) and made.armature > 0.0
    assert all(item.passed for item in found(Engine.PYBULLET, urdf, overlay, MODE))
    assert rests_in_plain_mujoco(urdf), "at MuJoCo's own soft limits"
    text = urdf.read_text(encoding="utf-8")
    urdf.write_text(text.replace("spring_stiffness", "lighter").replace("geared_stiffness", "spring_stiffness"))
    assert not all(item.passed for item in found(Engine.PYBULLET, urdf, overlay, MODE)), (
        "the whole spring, without its armature"
    )
    assert not rests_in_plain_mujoco(urdf)


def rests_in_plain_mujoco(urdf: Path) -> bool:
    """Whether parts that springs bring back rest at their limits after a second at 240 Hz, each spring set as a
    torque, limits as MuJoCo has them."""
    root = etree.parse(str(urdf)).getroot()
    for shape in (*root.iterfind(".//visual"), *root.iterfind(".//collision")):
        shape.getparent().remove(shape)
    options = {"fusestatic": "false", "balanceinertia": "false"}
    etree.SubElement(etree.SubElement(root, "mujoco"), "compiler", options)
    model = mujoco.MjModel.from_xml_string(etree.tostring(root).decode())
    model.opt.timestep = 1.0 / 240.0
    data, joints = (
        mujoco.MjData(model),
        [model.joint(str(item.get("name"))) for item in root.iterfind("joint[dynamics]")],
    )
    terms = [[float(item.get(key, 0.0)) for key in ("spring_stiffness", "spring_reference")]
             for item in root.iterfind("joint/dynamics")]  # fmt: skip
    for item, (_, rest) in zip(joints, terms, strict=True):
        data.qpos[item.qposadr] = item.range[int(np.argmax(np.abs(item.range - rest)))]
    for _ in range(240):
        for item, (stiffness, rest) in zip(joints, terms, strict=True):
            data.qfrc_applied[item.dofadr] = stiffness * (rest - data.qpos[item.qposadr])
        mujoco.mj_step(model, data)
    beyond = [max(np.array([i.range[0], -i.range[1]]) + data.qpos[i.qposadr] * [-1.0, 1.0]) for i in joints]
    spans = [item.range[1] - item.range[0] for item in joints]
    return bool(np.abs(data.qvel).max() < 1e-3 and np.all(np.array(beyond) < 0.5 * np.array(spans)))

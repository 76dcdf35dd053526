"""The grippers that the arm may have: their lengths, what their servos and joints are at an opening, and the Robotiq
2F-85 from robosuite's package, found without being imported: links for the arm's URDF, and what closes its linkage."""

import importlib.util
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.physics.arrays import Array
from schemas.errors import UnknownChoiceError, UsageError


@dataclass(frozen=True, eq=False)
class Gripper:
    """A gripper whose two fingers open along y of the hand's frame. Lengths in m: ``tip_m`` of the point between the
    finger pads from the hand's frame, along its z axis; ``opening_m`` between open pads; ``finger_m`` and ``pad_m``
    half the thickness of its closed tips and half the width of one; ``lowest_m`` the least height of the point over a
    floor. ``tips`` are the bodies that are meant to touch. ``servos`` makes (n, k) commands of (n,) openings, m,
    ``opened`` an opening of its joints' positions; (joints, k) ``ratios`` times the commands are the positions to which
    these lead."""

    name: str
    tip_m: float
    opening_m: float
    finger_m: float
    pad_m: float
    lowest_m: float
    tips: tuple[str, ...]
    servos: Callable[[Array], Array]
    opened: Callable[[Array], float]
    ratios: Array

    def opening_of(self, commands: Array) -> float:
        """The opening to which (k,) commands lead, m."""
        return self.opened(self.ratios @ commands)


PIVOT_M = 0.0306011
"""Of the Robotiq: half the distance between the knuckles' pivots; all of it as robosuite's MJCF has it."""
CRANK_M = (0.0376, 0.043)
"""From there to the finger's pivot when open, y and z: the two sides of its parallelograms turn, the fingers do not."""
PAD_FACE_M = 0.0255203
"""From the finger's pivot inwards to the face of its pad."""
CLOSED_RAD = 0.8
"""Angle of the closed knuckles; the pads are then 0.9 mm apart."""
RADIUS_M, ANGLE_RAD = float(np.hypot(*CRANK_M)), float(np.arctan2(CRANK_M[1], CRANK_M[0]))


def knuckle_of(opening: Array) -> Array:
    """(n, 1) angle of the Robotiq's knuckles, rad, at (n,) openings, m."""
    across = (np.atleast_1d(opening) / 2.0 - PIVOT_M + PAD_FACE_M) / RADIUS_M
    found: Array = np.clip(np.arccos(across) - ANGLE_RAD, 0.0, CLOSED_RAD)[:, None]
    return found


def opening_at(joints: Array) -> float:
    """The Robotiq's opening, m, at (6,) joint positions, rad."""
    return float((PIVOT_M - PAD_FACE_M + RADIUS_M * np.cos(joints[[0, 3]] + ANGLE_RAD)).sum())


PANDA = Gripper(
    "panda", tip_m=0.1034, opening_m=0.08, finger_m=0.011, pad_m=0.008, lowest_m=0.008,
    tips=("panda_leftfinger", "panda_rightfinger"),
    servos=lambda opening: np.repeat(np.atleast_1d(opening)[:, None] / 2.0, 2, axis=1),
    opened=lambda joints: float(joints.sum()), ratios=np.eye(2),
)  # fmt: skip
"""The arm's own: two sliding fingers with a servo each."""
ROBOTIQ = Gripper(
    "robotiq", tip_m=0.15, opening_m=0.085, finger_m=0.011, pad_m=0.011, lowest_m=0.015,
    tips=("left_inner_finger", "right_inner_finger"), servos=knuckle_of, opened=opening_at,
    ratios=np.array([[1.0], [-1.0], [1.0], [1.0], [-1.0], [1.0]]),
)  # fmt: skip
"""Robotiq 2F-85: two fingers on parallelograms, one servo. Its joints are, left then right, the outer knuckle, the
finger and the inner knuckle. Closing moves the tips 14 mm away from the hand; ``tip_m`` is within the pads wherever
something of up to 73 mm is held."""
GRIPPERS = MappingProxyType({gripper.name: gripper for gripper in (PANDA, ROBOTIQ)})


def gripper_of(name: str) -> Gripper:
    """The gripper of this name. Raises UnknownChoiceError where there is none."""
    if name not in GRIPPERS:
        raise UnknownChoiceError("gripper", name, GRIPPERS)
    return GRIPPERS[name]


MODEL = Path("models", "assets", "grippers", "robotiq_gripper_85.xml")
REMEDY = (
    "the gripper 'robotiq' needs robosuite's model of it, which pip cannot install beside this NumPy with its "
    "dependencies: pip install --no-deps robosuite==1.5.2 (157 MB, 530 MB unpacked; nothing of it is run)"
)
SIDES = ("left", "right")
DRIVERS = ("finger_joint", "right_outer_knuckle_joint")
JOINTS = tuple(
    name for side, driver in zip(SIDES, DRIVERS, strict=True)
    for name in (driver, f"{side}_inner_finger_joint", f"{side}_inner_knuckle_joint")
)  # fmt: skip
"""In the order of ``Gripper.ratios``."""
SERVO = "grip"
STIFFNESS, DAMPING = 100.0, 4.0
"""Of the servo, N·m/rad and N·m·s/rad."""
TORQUE = 4.5
"""Of the servo, N·m: pads press with 40 N each closed, as the arm's own, and 52 N open; the gripper can do 235 N."""
ARMATURE, FOLLOWED = 0.005, 5e-4
"""Reflected inertia of the motor at a knuckle, and what the other joints are given, kg·m²."""
COUPLED_S = 0.004
"""Time constant of what couples the joints, s: four time steps."""


def robotiq_file() -> Path:
    """The MJCF of the gripper. Raises UsageError with the remedy where robosuite is not installed, or lacks it."""
    spec = importlib.util.find_spec("robosuite")
    file = Path(spec.origin or "").parent / MODEL if spec else Path()
    if not file.is_file():
        raise UsageError(REMEDY)
    return file


def add_robotiq(tree: ET.Element, hand: str) -> None:
    """Add the gripper's links and joints to a URDF, on the link ``hand``; meshes by their absolute paths."""
    file = robotiq_file()
    root = ET.parse(file).getroot()
    meshes: dict[str, ET.Element] = {}
    for mesh in root.iter("mesh"):  # the base is there twice, and the second file does not exist
        meshes.setdefault(str(mesh.get("name")), mesh)
    body = root.find("worldbody/body")
    assert body is not None
    _add_body(tree, body, hand, {name: (file.parent / str(mesh.get("file")), str(mesh.get("scale", "1 1 1")))
                                 for name, mesh in meshes.items()})  # fmt: skip


def _add_body(tree: ET.Element, body: ET.Element, parent: str, meshes: dict[str, tuple[Path, str]]) -> None:
    name, moving, inertial = str(body.get("name")), body.find("joint"), body.find("inertial")
    if inertial is None:  # a frame of robosuite's
        return
    joint = ET.SubElement(tree, "joint", name=f"{name}_fixed", type="fixed")
    _add_origin(joint, body)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=name)
    if moving is not None:
        joint.attrib.update(name=str(moving.get("name")), type="revolute")
        ET.SubElement(joint, "axis", xyz=str(moving.get("axis")))
        lower, upper = str(moving.get("range")).split()
        ET.SubElement(joint, "limit", lower=lower, upper=upper, effort=str(TORQUE), velocity="2")
    link = ET.SubElement(tree, "link", name=name)
    mass = ET.SubElement(link, "inertial")
    _add_origin(mass, inertial)
    ET.SubElement(mass, "mass", value=str(inertial.get("mass")))
    moments = dict(zip(("ixx", "iyy", "izz"), str(inertial.get("diaginertia")).split(), strict=True))
    ET.SubElement(mass, "inertia", {**moments, "ixy": "0", "ixz": "0", "iyz": "0"})
    for geom in body.findall("geom"):
        made = ET.SubElement(link, "visual" if geom.get("group") == "1" else "collision")
        _add_origin(made, geom)
        shape = ET.SubElement(made, "geometry")
        if geom.get("type") == "mesh":
            path, scale = meshes[str(geom.get("mesh"))]
            ET.SubElement(shape, "mesh", filename=str(path), scale=scale)
        else:
            size = " ".join(str(2.0 * float(half)) for half in str(geom.get("size")).split())
            ET.SubElement(shape, "box", size=size)
        if made.tag == "visual":
            material = ET.SubElement(made, "material", name=str(geom.get("name")))
            ET.SubElement(material, "color", rgba=str(geom.get("rgba")))
    for child in body.findall("body"):
        _add_body(tree, child, name, meshes)


def _add_origin(to: ET.Element, of: ET.Element) -> None:
    w, x, y, z = (float(value) for value in str(of.get("quat", "1 0 0 0")).split())
    turn = Rotation.from_quat([x, y, z, w]).as_euler("xyz")
    ET.SubElement(to, "origin", xyz=str(of.get("pos", "0 0 0")), rpy=" ".join(str(float(angle)) for angle in turn))


def drive(spec: mujoco.MjSpec) -> None:
    """Close the linkage and give it its one servo. The sides of its parallelograms turn alike and its fingers against
    them, so that they stay upright; both knuckles turn alike. Robosuite's model has springs instead, which let fingers
    tilt, and two servos."""
    for name, (ratio,) in zip(JOINTS, ROBOTIQ.ratios, strict=True):
        spec.joint(name).armature = ARMATURE if name in DRIVERS else FOLLOWED
        if name == DRIVERS[0]:
            continue
        tied = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT)
        tied.name1, tied.name2 = name, DRIVERS[0]
        tied.data[:5] = (0.0, ratio, 0.0, 0.0, 0.0)
        tied.solref, tied.solimp = (COUPLED_S, 1.0), (0.99, 0.999, 0.001, 0.5, 2.0)
    tendon = spec.add_tendon(name=SERVO)
    for name in DRIVERS:
        tendon.wrap_joint(name, 0.5)
    made = spec.add_actuator(name=SERVO, target=SERVO, trntype=mujoco.mjtTrn.mjTRN_TENDON)
    made.gaintype, made.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    made.gainprm[0], made.biasprm[1], made.biasprm[2] = STIFFNESS, -STIFFNESS, -DAMPING
    made.forcelimited, made.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, np.array([-TORQUE, TORQUE])

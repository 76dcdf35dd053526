"""The Robotiq 2F-85 from robosuite's package, which is found without being imported: links for the arm's URDF, and what
closes its linkage in MuJoCo."""

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from asset2sim.gym.arm.gripper import ROBOTIQ
from schemas.errors import UsageError

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
"""Of the servo, N·m: pads press with 40 N each closed, as the arm's own fingers, and 52 N open; the gripper can do
235 N."""
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

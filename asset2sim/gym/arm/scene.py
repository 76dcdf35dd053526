"""The world of a trial in MuJoCo: an object on a floor, the arm beside it, and a bowl where the task needs one."""

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.arm.franka import servo
from asset2sim.gym.arm.gripper import GRIPPERS, PANDA, Gripper
from asset2sim.load import GAP_M, Description, load, mesh_points
from asset2sim.load.in_mujoco import MuJoCoObject
from asset2sim.physics.arrays import Array

TIMESTEP_S = 1e-3
"""Time step of a trial, s: a quarter of the checks', so that what is seen is not the integrator's."""
TOOL = "tool/"
"""What the names of the arm's bodies, or the pusher's, begin with."""
PUSHER_M, PUSHER_KG, PUSHER_N = 0.011, 0.3, 40.0
"""Radius and mass of the spherical pusher, and the force of each of its servos."""
PUSHER = ("x", "y", "z")
BOWL_SIDES, BOWL_WALL_M = 16, 0.006
BOWL_RADIUS_M, BOWL_HIGH_M = 0.12, 0.05
"""Inner radius at the bottom, and height, of a bowl: a salad bowl's, whatever is to be put into it."""
THIN_M = 0.0005
"""Thickness that flat meshes are given, m."""
FLAT = 1e-5
"""Share of its extent below which a mesh's thickness is none."""
SLANT_RAD = math.radians(20.0)
"""How far a bowl's side leans outwards."""
CONTACT_TIME_S = 0.004
"""Time constant of contacts, s, of whatever way an object was written: four time steps."""


@dataclass(frozen=True, eq=False)
class Bowl:
    """A bowl on the floor: its middle (x, y), m, its inner radius, and its height, m."""

    at: tuple[float, float]
    radius_m: float
    height_m: float

    @property
    def rim_m(self) -> float:
        """Its radius at the top, m."""
        return self.radius_m + self.height_m * math.tan(SLANT_RAD)


@dataclass(frozen=True, eq=False)
class CompiledScene:
    """A compiled world. ``base`` is the (4, 4) pose of the arm's base; ``object_dofs`` is a mask of velocities,
    ``object_geoms``, ``tool_geoms`` and ``tip_geoms`` are masks of geoms: the object's, the tool's, and those of it
    that are meant to touch; ``tool_places`` are the places of the tool's joints among positions, (joints, k) ``ratios``
    times its servos' commands is where these lead them."""

    about: Description
    prefix: str
    model: mujoco.MjModel
    data: mujoco.MjData
    base: Array
    object_dofs: Array
    object_geoms: Array
    tool_geoms: Array
    tip_geoms: Array
    tool_places: Array
    ratios: Array
    gripper: Gripper
    bowl: Bowl | None

    @property
    def about_positions(self) -> dict[str, float]:
        """Joint → position in which the object was written, rad or m."""
        return {joint.name: joint.initial_position for joint in self.about.joints}

    @property
    def moving_kg(self) -> float:
        """Mass of the object, kg, but for what is fixed to the world."""
        names = (self.model.body(index).name for index in range(self.model.nbody))
        mine = np.array([name.startswith(self.prefix) for name in names])
        return float(self.model.body_mass[mine & (self.model.body_weldid != 0)].sum())

    def joint(self, name: str) -> int:
        """The place of an object's joint among positions."""
        return int(self.model.joint(self.prefix + name).qposadr[0])

    def positions(self) -> dict[str, float]:
        """Joint → position, rad or m."""
        return {joint.name: float(self.data.qpos[self.joint(joint.name)]) for joint in self.about.joints}


def object_world(folder: Path, timestep_s: float, fixed: bool | None = None) -> tuple[mujoco.MjSpec, MuJoCoObject]:
    """A world with a floor and a refined object at the origin in its initial state, to be compiled and finished; its
    root is held or free as ``load`` has it. Raises LoadError as ``load`` does."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = timestep_s, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100.0
    spec.option.iterations, spec.option.tolerance = 100, 1e-10
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 0.05))
    loaded = load(folder, engine="mujoco", into=spec, position=(0.0, 0.0), timestep_s=timestep_s, fixed=fixed)
    leave_out_looks(spec)
    thicken_flat(spec)
    for geom in spec.geoms:
        geom.solref = (CONTACT_TIME_S, 1.0)
    return spec, loaded


def build_stage(
    folder: Path, tool: mujoco.MjSpec | None, base: Array, bowl: Bowl | None = None, gripper: Gripper = PANDA
) -> CompiledScene:
    """The world with a refined object at the origin in its initial state, and a tool, the arm with this gripper or the
    pusher, with its base at this (4, 4) pose. Raises LoadError as ``load`` does, ValueError where MuJoCo refuses the
    model."""
    spec, loaded = object_world(folder, TIMESTEP_S)
    about, prefix = loaded.about, loaded.prefix
    joints: list[str] = []
    ratios = np.zeros((0, 0))
    if tool is not None:
        joints = [joint.name for joint in tool.joints]
        ratios = np.eye(len(joints), len(tool.actuators))
        if len(joints) > len(tool.actuators):  # some joints follow a servo's
            ratios[-len(gripper.ratios) :, -gripper.ratios.shape[1] :] = gripper.ratios
        spec.attach(tool, prefix=TOOL, frame=spec.worldbody.add_frame(pos=base[:3, 3], quat=quaternion(base)))
    if bowl is not None:
        add_bowl(spec, bowl)
    with warnings.catch_warnings(action="ignore"):  # of texture coordinates, which are not used
        model = spec.compile()
    data = mujoco.MjData(model)
    names = [model.body(int(body)).name for body in model.geom_bodyid]
    mine = np.array([name.startswith(prefix) for name in names])
    tools = np.array([name.startswith(TOOL) for name in names])
    all_tips = [tip for known in GRIPPERS.values() for tip in known.tips]
    tips = np.array([name in (f"{TOOL}{tip}" for tip in ("pusher", *all_tips)) for name in names])
    dofs = np.array([model.body(int(body)).name.startswith(prefix) for body in model.dof_bodyid])
    places = np.array([int(model.joint(TOOL + name).qposadr[0]) for name in joints], dtype=int)
    loaded.finish(model, data)
    return CompiledScene(
        about, prefix, model, data, base.copy(), dofs, mine, tools, tips, places, ratios, gripper, bowl
    )


def leave_out_looks(spec: mujoco.MjSpec) -> None:
    """Remove what an exported object shows and nothing touches: the scene is the same as without the export."""
    for geom in [one for one in spec.geoms if not one.contype and not one.conaffinity]:
        spec.delete(geom)
    shown = {geom.meshname for geom in spec.geoms}
    for mesh in [one for one in spec.meshes if one.name not in shown]:
        spec.delete(mesh)


def thicken_flat(spec: mujoco.MjSpec) -> None:
    """Give flat meshes a thickness of ``THIN_M``: MuJoCo refuses them, and refined objects alone have none."""
    for mesh in spec.meshes:
        if not mesh.file.lower().endswith(".obj"):
            continue
        points = mesh_points(Path(mesh.file), True)
        _, sizes, directions = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
        if sizes[2] > FLAT * sizes[0]:
            continue
        half = directions[2] * THIN_M / 2.0 / float(np.abs(mesh.scale).max())
        mesh.file, mesh.content_type = "", ""
        mesh.uservert = np.concatenate([points + half, points - half]).ravel().tolist()


def pusher_spec() -> mujoco.MjSpec:
    """A sphere that three servos move along x, y and z, whose weight nothing bears."""
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="pusher", gravcomp=1.0)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(PUSHER_M, 0.0, 0.0), mass=PUSHER_KG, contype=2, conaffinity=1, condim=4
    )
    for name, axis in zip(PUSHER, np.eye(3), strict=True):
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        servo(spec, name, 2000.0, 2.0 * math.sqrt(2000.0 * PUSHER_KG), PUSHER_N)
    return spec


def quaternion(pose: Array) -> Array:
    """(4,) wxyz quaternion of a (4, 4) pose."""
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, pose[:3, :3].ravel())
    return found


def base_at(azimuth: float, distance_m: float, about: Description | None = None) -> Array:
    """(4, 4) pose of a base that faces the origin, at this azimuth (rad) and distance, on the floor, or as high over it
    as this object: what is fixed clears it."""
    pose, facing = np.eye(4), azimuth + math.pi
    pose[:2, 3] = distance_m * math.cos(azimuth), distance_m * math.sin(azimuth)
    pose[2, 3] = GAP_M if about is not None and about.support == "fixed" else 0.0
    pose[:2, :2] = [[math.cos(facing), -math.sin(facing)], [math.sin(facing), math.cos(facing)]]
    return pose


def add_bowl(spec: mujoco.MjSpec, bowl: Bowl) -> None:
    """A round bowl of flat pieces, which slants outwards, fixed to the floor."""
    body = spec.worldbody.add_body(name="bowl", pos=(*bowl.at, 0.0))
    body.add_geom(
        name="bowl_bottom", type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=(bowl.radius_m, BOWL_WALL_M / 2.0, 0.0),
        pos=(0.0, 0.0, BOWL_WALL_M / 2.0), solref=(CONTACT_TIME_S, 1.0),
    )  # fmt: skip
    half = bowl.height_m / 2.0
    for side in range(BOWL_SIDES):
        turn = 2.0 * math.pi * side / BOWL_SIDES
        out = (bowl.radius_m + bowl.rim_m) / 2.0
        body.add_geom(
            name=f"bowl_{side}", type=mujoco.mjtGeom.mjGEOM_BOX, solref=(CONTACT_TIME_S, 1.0),
            size=(BOWL_WALL_M / 2.0, 1.1 * math.pi * bowl.rim_m / BOWL_SIDES, half),
            pos=(out * math.cos(turn), out * math.sin(turn), half), quat=yaw_tilt(turn, SLANT_RAD),
        )  # fmt: skip


def yaw_tilt(yaw: float, tilt: float) -> Array:
    """(4,) wxyz quaternion of a tilt about y, then a turn about z, rad."""
    turned, first, second = np.zeros(4), np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(first, np.array([0.0, 0.0, 1.0]), yaw)
    mujoco.mju_axisAngle2Quat(second, np.array([0.0, 1.0, 0.0]), tilt)
    mujoco.mju_mulQuat(turned, first, second)
    return turned


def place_joints(stage: CompiledScene, positions: Mapping[str, float], tool: Array | None = None) -> None:
    """Set joints of the object (rad or m) and, if given, the tool's to where these commands lead them, and what follows
    from that: poses and contacts."""
    for name, value in positions.items():
        stage.data.qpos[stage.joint(name)] = value
    if tool is not None:
        stage.data.qpos[stage.tool_places] = stage.ratios @ tool
    mujoco.mj_kinematics(stage.model, stage.data)
    mujoco.mj_comPos(stage.model, stage.data)
    mujoco.mj_collision(stage.model, stage.data)

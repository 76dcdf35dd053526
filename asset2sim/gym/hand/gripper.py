"""The hand: two fingers on a palm that floats, led by a spring and a damper of limited force, with an object in MuJoCo.

Its frame is between the pads: z to where the fingers point, y along which they close.
"""

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from asset2sim.gym.world import CONTACT_TIME_S, TOOL, ObjectWorld, compiled_object, object_spec
from asset2sim.load import Joint
from asset2sim.physics.arrays import Array
from schemas.hand_settings import FINGERTIP_M, HandSettings

FINGER = np.array([FINGERTIP_M / 2.0, 0.004, 0.025])
"""Half the size of a finger, m."""
TIP_M, PALM = 0.01, np.array([0.015, 0.05, 0.015])
"""How far the fingers reach beyond the middle of their pads, and half the size of the palm, m."""
FLAT = np.array([0.04, 0.012, 0.09])
"""Half the size of a hand laid flat against what two hands carry, m: a grown-up's."""
FLAT_TIP_M, FLAT_ROOM_M = 0.05, 0.02
"""How far it reaches beyond its middle finger's, where it presses, and the room beside each before they close, m."""
HAND_KG, HAND_INERTIA = 1.0, 0.02
"""Mass and inertia (kg·m²) of the hand with what moves along of its arm."""
SPRING_N_M, TURN_SPRING = 4000.0, 150.0
"""A hand's stiffness, N/m and N·m/rad: a centimetre behind, it pulls with nearly all its force."""
LINEAR_DAMPING = 2.0 * math.sqrt(SPRING_N_M * HAND_KG)
TURN_DAMPING = 2.0 * math.sqrt(TURN_SPRING * HAND_INERTIA)
"""Critical damping of both, N·s/m and N·m·s/rad."""
FINGER_KG, FLAT_KG, FINGER_DAMPING = 0.1, 0.42, 250.0
"""Mass of a finger and of a flat hand, kg, which is 0.6 % of a body of 70 kg (Dempster 1955): a lighter one chatters on
what it presses, which creeps out of it; and damping, N·s/m: it closes at 0.3 m/s."""
ROOM_M = 0.004
"""Room beside each open finger, m."""
HELD_M = 0.3
"""How high the other hand holds an object, m."""
PARKED_M = 20.0
"""Height at which the hand is out of the way, m."""
SUBSTEPS = 2
"""Steps of the engine for each of the hand, which is led at 250 Hz: half the time of a step is the hand's."""
CALM = 2e-3
"""Largest motion of another joint that counts as standing still: a share of its range, or rad or m without one."""
FINGERS = ("left", "right")
STAND = "stand"
"""Name of the round stand under an object that juts out over it."""


@dataclass(frozen=True, eq=False)
class Tool:
    """One hand's two fingers, or two flat hands, which press from two sides. Half the size of a finger, m, its mass,
    kg, and half the size of the palm between both, m; how far fingers reach beyond the middle of their pads, how
    wide they open and the room beside each, m; with what force each presses, N."""

    finger: Array
    finger_kg: float
    palm: Array
    tip_m: float
    opening_m: float
    room_m: float
    grip_n: float
    hands: int

    @property
    def behind_m(self) -> float:
        """Where the palm's middle is in front of the middle of the pads, m; negative."""
        return float(self.tip_m - 2.0 * self.finger[2] - self.palm[2])


def tool_of(settings: HandSettings, scale: float, hands: int) -> Tool:
    """One hand's two fingers, at a scale, or two flat hands that come from both sides."""
    if hands == 2:
        return Tool(FLAT, FLAT_KG, np.zeros(3), FLAT_TIP_M, settings.between_m, FLAT_ROOM_M, settings.grip_n, hands)
    sizes = FINGER * scale, FINGER_KG, PALM * scale, TIP_M * scale, settings.opening_m * scale
    return Tool(*sizes, ROOM_M * scale, settings.grip_n * scale, hands)


def hand_spec(tool: Tool, settings: HandSettings) -> mujoco.MjSpec:
    """The hand as a body of its own whose weight nothing bears."""
    spec = mujoco.MjSpec()
    hand = spec.worldbody.add_body(
        name="hand", gravcomp=1.0, mass=HAND_KG * tool.hands, inertia=[HAND_INERTIA * tool.hands] * 3,
        explicitinertial=True,
    )  # fmt: skip
    hand.add_freejoint(name="free")
    looks: dict[str, Any] = {"contype": 2, "conaffinity": 1, "condim": 4, "priority": 1, "mass": 0.0}
    looks |= {"friction": (settings.pad_friction, 0.02, 0.0001), "solref": (CONTACT_TIME_S, 1.0)}
    if tool.palm.any():
        hand.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=tool.palm, pos=(0.0, 0.0, tool.behind_m), **looks)
    for name, side in zip(FINGERS, (1.0, -1.0), strict=True):
        finger = hand.add_body(
            name=name, gravcomp=1.0, mass=tool.finger_kg, inertia=[1e-5] * 3, explicitinertial=True,
            pos=(0.0, side * tool.finger[1], tool.tip_m - tool.finger[2]),
        )  # fmt: skip
        finger.add_joint(
            name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0.0, side, 0.0), damping=[FINGER_DAMPING, 0.0, 0.0],
            range=(0.0, tool.opening_m / 2.0), limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            solref_limit=(CONTACT_TIME_S, 1.0),  # at MuJoCo's own, light fingers go 15 mm through each other
        )  # fmt: skip
        finger.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=tool.finger, **looks)
    # As in a gripper, both fingers move alike: what pulls along the direction in which they close, pulls the hand.
    both = spec.add_equality(
        type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=FINGERS[0], name2=FINGERS[1],
        solref=(CONTACT_TIME_S, 1.0),
    )  # fmt: skip
    both.data[:2] = 0.0, 1.0
    return spec


@dataclass(eq=False)
class HandWorld(ObjectWorld):
    """An object, a hand (``tool``) of a ``scale`` and what lies in it, compiled. ``probe`` is the model in which the
    hand alone collides with the object, to look where it fits; ``calm`` is by how much each velocity may change a
    position that stays. ``watch`` is called after each step."""

    scale: float
    tool: Tool
    settings: HandSettings
    probe: mujoco.MjModel
    spare: mujoco.MjData
    calm: Array
    watch: Callable[[], None] = field(default=lambda: None)
    target: Array = field(default_factory=lambda: np.eye(4))
    speed: Array = field(default_factory=lambda: np.zeros(6))
    most_n: float = 0.0
    """Most force that it may use, N."""
    force: float = 1.0
    """Share of its force that it uses."""
    grip: float = 0.0
    """Half the opening that the fingers are led to, m; negative: closed with all their force."""
    free_place: int = 0
    dof: int = 0
    body: int = 0
    fingers: tuple[int, int] = (0, 0)
    finger_dofs: tuple[int, int] = (0, 0)
    kept: dict[int, float] = field(default_factory=dict)
    """Velocities of joints that the other hand keeps where they are, and these joints' own friction, N·m or N."""
    touched: set[int] = field(default_factory=set)
    """Bodies that it touched in its last step."""
    biased: list[tuple[Joint, int, int]] = field(default_factory=list)
    """Joints with a mechanism besides a spring, and their places among positions and velocities."""

    def touches(self, bodies: frozenset[int]) -> bool:
        """Whether the hand touched one of these bodies in its last step."""
        return not bodies.isdisjoint(self.touched)

    def touching(self) -> list[int]:
        """The bodies that the hand touches now."""
        if not self.data.ncon:
            return []
        geoms = self.data.contact.geom
        hand = self.tool_geoms[geoms]
        found: list[int] = self.model.geom_bodyid[geoms[:, ::-1][hand]].tolist() if hand.any() else []
        return found

    def stays(self, seconds: float) -> bool:
        """Whether, at its speed and acceleration, nothing moves by more than ``calm`` in a time, s."""
        ahead = np.abs(self.data.qvel) * seconds + np.abs(self.data.qacc) * seconds**2 / 2.0
        return bool((ahead <= self.calm).all())

    def put(self, data: mujoco.MjData, pose: Array, half_open: float) -> None:
        """Put the hand somewhere, its fingers open, at rest."""
        data.qpos[self.free_place : self.free_place + 3] = pose[:3, 3]
        mujoco.mju_mat2Quat(data.qpos[self.free_place + 3 : self.free_place + 7], pose[:3, :3].ravel())
        data.qpos[list(self.fingers)] = half_open
        data.qvel[self.dof : self.dof + 8] = 0.0

    def keep(self, name: str, effort: float) -> None:
        """Let the other hand keep a joint where it is until ``reset``, with that effort at most, N·m or N."""
        dof = int(self.model.jnt_dofadr[self.joint(name)])
        self.kept[dof] = float(self.model.dof_frictionloss[dof])
        self.model.dof_frictionloss[dof] += effort

    def reset(self, positions: Mapping[str, float] | None = None) -> None:
        """All as written, joints elsewhere (rad or m) where stated, the hand out of the way, and nothing kept."""
        while self.kept:
            dof, friction = self.kept.popitem()
            self.model.dof_frictionloss[dof] = friction
        mujoco.mj_resetData(self.model, self.data)
        for name, position in (self.about.positions_at() | dict(positions or {})).items():
            self.data.qpos[self.place(name)] = position
        self.target = np.eye(4)
        self.target[2, 3], self.speed, self.grip, self.force = PARKED_M, np.zeros(6), 0.0, 1.0
        self.most_n = self.settings.force_n * self.tool.hands
        self.put(self.data, self.target, 0.0)
        mujoco.mj_forward(self.model, self.data)

    def step(self) -> float:
        """One step of the hand under its forces; the power of its wrench, W."""
        data, settings, tool = self.data, self.settings, self.tool
        turned = data.xmat[self.body].reshape(3, 3)
        linear, angular = data.qvel[self.dof : self.dof + 3], turned @ data.qvel[self.dof + 3 : self.dof + 6]
        force = SPRING_N_M * (self.target[:3, 3] - data.xpos[self.body])
        force += LINEAR_DAMPING * (self.speed[:3] - linear)
        torque = TURN_SPRING * rotation_vector(self.target[:3, :3] @ turned.T)
        torque += TURN_DAMPING * (self.speed[3:] - angular)
        force = capped_vector(tool.hands * force, self.force * self.most_n)
        torque = capped_vector(tool.hands * torque, tool.hands * settings.torque_n_m)
        data.xfrc_applied[self.body, :3], data.xfrc_applied[self.body, 3:] = force, torque
        for place, dof in zip(self.fingers, self.finger_dofs, strict=True):
            data.qfrc_applied[dof] = tool.grip_n * min(max((self.grip - float(data.qpos[place])) / 0.002, -1.0), 1.0)
        self.touched.clear()
        for _ in range(SUBSTEPS):
            for joint, place, dof in self.biased:
                data.qfrc_applied[dof] = joint.exerted(float(data.qpos[place]))
            mujoco.mj_step(self.model, data)
            self.touched.update(self.touching())  # a blow may be over before the next
        self.watch()
        return float(force @ linear + torque @ angular)

    @property
    def dt(self) -> float:
        """Time of a step of the hand, s."""
        return SUBSTEPS * self.settings.timestep_s

    def steps(self, seconds: float) -> int:
        """Steps of a time, s."""
        return max(1, round(seconds / self.dt))


def open_world(
    folder: Path, settings: HandSettings, scale: float = 1.0, *,
    held: bool = False, stand_m: float = 0.0, hands: int = 1,
) -> HandWorld:  # fmt: skip
    """The world of a refined object and a hand, or both ``hands``; ``held`` says that another hand holds it, off the
    floor, ``stand_m`` is the radius of a stand on which it is. Raises LoadError as ``load`` does, ValueError where
    MuJoCo refuses the model."""
    tool = tool_of(settings, scale, hands)
    spec, loaded = object_spec(folder, settings.timestep_s, fixed=True if held else None)
    if held or stand_m:
        spec.body(loaded.prefix + loaded.top).pos[2] += HELD_M
    if stand_m:
        below = spec.worldbody.add_body(name=STAND, mocap=True, pos=(0.0, 0.0, HELD_M / 2.0))
        size = (stand_m, HELD_M / 2.0, 0.0)
        below.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size, solref=(CONTACT_TIME_S, 1.0))
    spec.attach(hand_spec(tool, settings), prefix=TOOL, frame=spec.worldbody.add_frame(pos=(0.0, 0.0, 20.0)))
    about, prefix, model, data = compiled_object(spec, loaded)
    world = ObjectWorld(about, prefix, model, data)
    hand = world.tool_geoms
    probe = copy.copy(model)
    probe.geom_contype[:], probe.geom_conaffinity[:] = np.where(hand, 2, 0), np.where(hand, 0, 2)
    probe.body_contype[:], probe.body_conaffinity[:] = 2, 2
    free = model.joint(f"{TOOL}free")
    ends = [model.joint(TOOL + name) for name in FINGERS]
    acted = [joint for joint in about.joints if joint.bias]
    biased = [(one, world.place(one.name), int(model.jnt_dofadr[world.joint(one.name)])) for one in acted]
    calm, limited = np.full(model.nv, CALM), model.jnt_limited != 0
    calm[model.jnt_dofadr[limited]] *= np.ptp(model.jnt_range[limited], axis=1)
    return HandWorld(
        about, prefix, model, data, scale, tool, settings, probe, mujoco.MjData(probe), calm,
        free_place=int(free.qposadr[0]), dof=int(free.dofadr[0]), body=int(model.body(f"{TOOL}hand").id),
        fingers=(int(ends[0].qposadr[0]), int(ends[1].qposadr[0])),
        finger_dofs=(int(ends[0].dofadr[0]), int(ends[1].dofadr[0])), biased=biased,
    )  # fmt: skip


def capped_vector(vector: Array, most: float) -> Array:
    """A vector, shortened to a length."""
    length = math.sqrt(vector @ vector)
    return vector if length <= most else vector * (most / length)


def rotation_vector(rotation: Array) -> Array:
    """(3,) rotation vector of a (3, 3) rotation, rad."""
    quaternion, vector = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    mujoco.mju_quat2Vel(vector, quaternion, 1.0)
    return vector

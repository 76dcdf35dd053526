"""Samples of a way of a joint: where the part and the object are, and how the hand presses on them."""

import math
from dataclasses import dataclass, field
from typing import Protocol

import mujoco
import numpy as np

from asset2sim.checks.mechanism import span_of
from asset2sim.gym.contacts import pressures
from asset2sim.gym.guards import Guards, Moment, guard, rollout_of, sample_of
from asset2sim.gym.hand.gripper import HandWorld
from asset2sim.gym.hand.surfaces import surface_places
from asset2sim.physics.arrays import Array
from schemas.learning_settings import GuardSettings
from schemas.overlay import JointPhysics

PLACES = 9
"""Places of a way at which it is looked whether a part stays: a catch pulls at its ends alone."""
SAMPLE_STEPS = 3
"""Steps between two samples, 12 ms."""
GUARDS = GuardSettings(away_samples=8)
"""Bounds of the guards: what is away for a tenth of a second, as in the environment."""


class Stepped(Protocol):
    """A world that is led step by step, and what is seen of it."""

    world: HandWorld

    def step(self) -> None:
        """A step of the world."""


@dataclass(eq=False)
class Recorder:
    """Samples of a way: positions, whether the hand touched the part, its work, and how the object stands; ``most_n``
    is the largest force on the object of a finger or of the palm, N, ``missed`` how many grasps closed on nothing."""

    world: HandWorld
    joint: JointPhysics
    bodies: frozenset[int]
    work_j: float = 0.0
    most_n: float = 0.0
    touched: bool = False
    count: int = 0
    missed: int = 0
    samples: list[Moment] = field(default_factory=list)

    def step(self) -> None:
        """A step of the world, and now and then a sample."""
        self.work_j += self.world.step() * self.world.dt
        self.touched = self.touched or self.world.touches(self.bodies)  # a blow may be over before the sample
        self.count += 1
        if self.count % SAMPLE_STEPS == 0:
            self.sample()

    def sample(self) -> None:
        """A sample of this moment."""
        world, place = self.world, self.world.place(self.joint.name)
        self.most_n = max(self.most_n, pressed_n(world))
        seen = sample_of(world.data, place, min(self.bodies), world.root, touched=self.touched, work_j=self.work_j)
        self.samples.append(seen)
        self.work_j, self.touched = 0.0, False

    def guards(self, target: float) -> Guards:
        """Findings of the environment's guards in it."""
        ends, name = span_of(self.joint), self.joint.name
        holds = self.joint.holds and bears(self.world, name, ends)
        edge_m = self.world.edge_m(name, surface_places(self.world, self.bodies)[0])
        sample_s = SAMPLE_STEPS * self.world.dt
        return guard(rollout_of(self.samples, self.joint, ends, target, edge_m, sample_s, holds=holds), GUARDS)


def pressed_n(world: HandWorld) -> float:
    """The largest force on the object of a finger, the palm or a flat hand at this moment, N."""
    pressed: dict[int, Array] = {}
    for _, tool, _, force in pressures(world):
        pressed[tool] = pressed.get(tool, np.zeros(3)) + force
    return max((float(np.linalg.norm(force)) for force in pressed.values()), default=0.0)


def bears(world: HandWorld, name: str, ends: tuple[float, float]) -> bool:
    """Whether a joint's friction bears its part anywhere between these ends, rad or m, the object as written: one that
    stays where it was left may fall from elsewhere, as a lid that leans back."""
    model, about = world.model, next(one for one in world.about.joints if one.name == name)
    place, dof = world.place(name), int(model.jnt_dofadr[world.joint(name)])
    data, weight = mujoco.MjData(model), np.zeros(model.nv)
    for one, position in world.about.positions_at().items():
        data.qpos[world.place(one)] = position
    for position in np.linspace(*ends, PLACES + 2)[1:-1]:
        data.qpos[place] = position
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_passive(model, data)
        mujoco.mj_rne(model, data, 0, weight)
        pull = data.qfrc_passive[dof] + about.exerted(float(position)) - weight[dof]
        if abs(pull) > model.dof_frictionloss[dof]:
            return False
    return True


def is_displaced(recorder: Recorder) -> bool:
    """Whether the object lies or stands elsewhere by now."""
    first, last = recorder.samples[0], recorder.samples[-1]
    tilted, off = float(last.up @ first.up) < math.cos(GUARDS.tilt_rad), last.center - first.center
    return tilted or math.sqrt(off @ off) > GUARDS.travel_m


def presses_elsewhere(recorder: Recorder) -> bool:
    """Whether the hand presses more on other parts of the object than on the one that it moves."""
    world, bodies, pressed = recorder.world, recorder.bodies, {True: 0.0, False: 0.0}
    for _, _, geom, force in pressures(world):
        pressed[int(world.model.geom_bodyid[geom]) in bodies] += math.sqrt(force @ force)
    return pressed[False] > pressed[True]


def move_hand(recorder: Stepped, first: Array, last: Array, speed_m_s: float) -> None:
    """Lead the hand straight from one pose to another."""
    world = recorder.world
    path = last[:3, 3] - first[:3, 3]
    length = float(np.linalg.norm(path))
    count = world.steps(max(length / speed_m_s, 0.02))
    world.speed = np.concatenate([path / (count * world.dt), np.zeros(3)])
    for step in range(1, count + 1):
        world.target = last.copy()
        world.target[:3, 3] = first[:3, 3] + path * step / count
        recorder.step()
    world.speed = np.zeros(6)


def wait(recorder: Stepped, seconds: float) -> None:
    """Let the hand keep its target for a time."""
    for _ in range(recorder.world.steps(seconds)):
        recorder.step()

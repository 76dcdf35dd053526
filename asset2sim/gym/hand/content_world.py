"""A world for what lies in an object: it is held by its root, three bodies are in it, and a hand leads its joints."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.hand.used import hand_force, no_task
from asset2sim.gym.world import CONTACT_TIME_S, ObjectWorld, body_pose, compiled_object, object_spec
from asset2sim.physics.arrays import Array
from schemas.hand_settings import ContentSettings, HandSettings
from schemas.overlay import JointPhysics, PhysicsOverlay

CONTENT, ROOT3, ROOT2 = "content/", math.sqrt(1.0 / 3.0), math.sqrt(0.5)
"""Beginning of the bodies' names, and the factors that make a cube and a cylinder fit into a ball of radius 1."""
GEOM = mujoco.mjtGeom
BODIES = {
    "ball": (GEOM.mjGEOM_SPHERE, np.array([1.0, 0.0, 0.0])), "box": (GEOM.mjGEOM_BOX, np.full(3, ROOT3)),
    "cylinder": (GEOM.mjGEOM_CYLINDER, np.array([ROOT2, ROOT2, 0.0])),
}  # fmt: skip
HALF_HIGH = {"ball": 1.0, "box": ROOT3, "cylinder": ROOT2}
PARKED_M = 30.0
"""How far away bodies lie that are not used, m."""
SERVO_RAD_S, EASED, BEHIND, LEAST_LEVER_M = 50.0, 8.0, 0.01, 0.01
"""Rate at which the hand follows its course, bearing the part's weight; how much slower it comes to bear what lies in
it; how far behind, rad or m, it pulls with all of a joint's friction beside; and its least lever at a hinge."""


@dataclass(eq=False)
class ContentWorld(ObjectWorld):
    """An object held by its root, and three bodies of a radius, m, compiled."""

    overlay: PhysicsOverlay
    radius_m: float
    hand: HandSettings
    settings: ContentSettings
    led: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Joint → where a hand leads it, and how fast, rad or m and a second."""
    borne: dict[str, float] = field(default_factory=dict)
    """Joint → what the hand bears there beside, N or N·m: what lies in the part."""

    def reset(self, positions: Mapping[str, float], radius: float) -> None:
        """The joints at these positions, everything at rest, the bodies of this size and out of the way."""
        factor, self.radius_m = radius / self.radius_m, radius
        for name in BODIES:
            geom, body = self.model.geom(CONTENT + name), self.model.body(CONTENT + name)
            geom.size *= factor
            geom.rbound *= factor
            body.mass *= factor**3
            body.inertia *= factor**5
        mujoco.mj_setConst(self.model, self.data)
        mujoco.mj_resetData(self.model, self.data)
        self.led.clear()
        for index, name in enumerate(BODIES):
            self.put(name, np.array([PARKED_M + index, 0.0, radius]))
        for name, position in positions.items():
            self.data.qpos[self.place(name)] = position
        mujoco.mj_forward(self.model, self.data)

    def put(self, body: str, at: Array) -> None:
        """Put a body somewhere, upright."""
        self.data.joint(CONTENT + body).qpos[:] = (*at, 1.0, 0.0, 0.0, 0.0)

    @cached_property
    def operated(self) -> dict[str, JointPhysics]:
        """The joints with limits that a hand operates, by name."""
        limited = [joint for joint in self.overlay.joints if joint.lower is not None and joint.upper is not None]
        return {joint.name: joint for joint in limited if not no_task(joint)}

    def steps(self, seconds: float) -> int:
        """Steps of a time, s."""
        return max(1, round(seconds / self.hand.timestep_s))

    def run(self, seconds: float) -> None:
        """Let time pass, the hand on the joints that are ``led``."""
        about = {joint.name: joint for joint in self.about.joints}
        owned = {joint.name: joint for joint in self.overlay.joints}
        for _ in range(self.steps(seconds)):
            for name, joint in about.items():
                held = self.led.get(name)
                if held is None and joint.bias is None:
                    continue
                here = self.data.joint(self.prefix + name)
                force = joint.exerted(float(here.qpos[0]))
                if held is not None:
                    inertia = max(owned[name].effective_inertia, 1e-6) + owned[name].armature
                    off = held[0] - float(here.qpos[0])
                    wanted = inertia * SERVO_RAD_S * (SERVO_RAD_S * off + 2.0 * (held[1] - float(here.qvel[0])))
                    wanted += joint.friction * float(np.clip(off / BEHIND, -1.0, 1.0)) + float(here.qfrc_bias[0])
                    most = hand_force(owned[name], self.hand) * self.lever(name)
                    eased = self.borne[name] + inertia * SERVO_RAD_S**3 / EASED * off * self.hand.timestep_s
                    self.borne[name] = float(np.clip(eased, -most, most))
                    force += float(np.clip(wanted + self.borne[name], -most, most))
                here.qfrc_applied[0] = force
            mujoco.mj_step(self.model, self.data)

    def lever(self, joint: str) -> float:
        """Distance from a hinge at which a hand takes its part, m; 1 of a slider."""
        about = next(item for item in self.about.joints if item.name == joint)
        if about.type == "prismatic":
            return 1.0
        if about.pull is None:
            return LEAST_LEVER_M
        here = self.data.joint(self.prefix + joint)
        body = self.model.body(self.prefix + about.link).id
        off = (body_pose(self.data, body) @ np.array([*about.pull, 1.0]))[:3] - here.xanchor
        return max(float(np.linalg.norm(np.cross(here.xaxis, off))), LEAST_LEVER_M)

    def lead(self, joint: JointPhysics, target: float) -> None:
        """A joint led to a target and held there: in a straight line with least jerk, as arms move (Flash and Hogan
        1985), at the hand's mean speed."""
        if joint.name not in self.led:
            self.borne[joint.name] = 0.0
        start = self.position(joint.name)
        length = abs(target - start)
        seconds = length * self.lever(joint.name) / self.hand.speed_m_s
        if joint.type != "prismatic":
            seconds = max(seconds, length / self.hand.turn_rad_s)
        seconds = min(max(seconds, self.settings.least_way_s), self.hand.way_s)
        count = self.steps(seconds)
        for step in range(1, count + 1):
            t = step / count
            gone, rate = t**3 * (10.0 + t * (6.0 * t - 15.0)), 30.0 * t**2 * (1.0 - t) ** 2
            self.led[joint.name] = start + (target - start) * gone, (target - start) * rate / seconds
            self.run(self.hand.timestep_s)
        self.led[joint.name] = target, 0.0
        self.run(self.settings.wait_s)


def open_contents(folder: Path, overlay: PhysicsOverlay, hand: HandSettings, settings: ContentSettings) -> ContentWorld:
    """The world of a refined object, and three bodies of the largest size."""
    spec, loaded = object_spec(folder, hand.timestep_s, fixed=True)
    radius = settings.most_m / 2.0
    for name, (kind, size) in BODIES.items():
        body = spec.worldbody.add_body(name=CONTENT + name, pos=(PARKED_M, 0.0, radius))
        body.add_freejoint(name=CONTENT + name)
        body.add_geom(
            name=CONTENT + name, type=kind, size=size * radius, density=settings.density_kg_m3, condim=6,
            friction=(settings.friction, 0.005, settings.rolling_m), solref=(CONTACT_TIME_S, 1.0),
        )  # fmt: skip
    return ContentWorld(*compiled_object(spec, loaded), overlay, radius, hand, settings)


def joints_to_root(world: ContentWorld, link: str) -> list[str]:
    """The joints between the root and a link, by name."""
    model, found = world.model, []
    body = int(model.body(world.prefix + link).id)
    while body:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        found += [model.joint(number).name.removeprefix(world.prefix) for number in range(first, first + count)]
        body = int(model.body_parentid[body])
    return found


def lead_joints(
    world: ContentWorld, joints: Sequence[JointPhysics], to: Mapping[str, float], within: float
) -> tuple[list[JointPhysics], list[JointPhysics]]:
    """Lead the joints to positions (rad or m), to ``within`` this share of their range, one after another, what others
    cover after these: in the order in which they got there, and those that did not."""
    done, left = list[JointPhysics](), list(joints)
    while left:
        for joint in left:
            world.lead(joint, to[joint.name])
            if abs(world.position(joint.name) - to[joint.name]) <= within * abs(joint.open - joint.closed):
                break
            world.led.pop(joint.name)
        else:
            break
        done.append(joint)
        left.remove(joint)
    return done, left


def open_joints(world: ContentWorld, joints: Sequence[JointPhysics]) -> tuple[list[JointPhysics], list[JointPhysics]]:
    """The joints led as far open as they go: in the order in which they got there, and those that did not."""
    within = 1.0 - world.hand.opened_share + world.hand.closed_share
    return lead_joints(world, joints, {joint.name: joint.open for joint in joints}, within)


def orders_of_use(
    world: ContentWorld, joints: Sequence[JointPhysics]
) -> tuple[list[JointPhysics], list[JointPhysics], str]:
    """The orders in which a hand opens these joints of the empty object and closes them, and one that does not go."""
    shut = {joint.name: world.position(joint.name) for joint in joints}
    opened, left = open_joints(world, joints)
    closing = opened[::-1]
    if left:
        return opened, closing, left[0].name
    for _ in opened:
        closed, left = lead_joints(world, closing, shut, world.hand.closed_share)
        if not left:
            return opened, closed, ""
        open_joints(world, [*left, *closed])  # a flap that lies on others was shut first
        closing = [*left, *closed]
    return opened, closing, left[0].name if left else ""


def open_and_close(
    world: ContentWorld, joints: Sequence[JointPhysics], back: Sequence[JointPhysics], left: Callable[[str], str]
) -> tuple[str, str]:
    """The joints opened, and closed in the order ``back``, or where that is none in reverse, to where they were: what
    ``left`` says on the way, and the name of one that did not get there; empty where all is well."""
    world.run(world.settings.wait_s)
    reason = left("at rest")
    if reason:
        return reason, ""
    shut = {joint.name: world.position(joint.name) for joint in joints}
    opened, stuck = open_joints(world, joints)
    reason = left("on opening")
    if not (stuck or reason):
        _, stuck = lead_joints(world, back or opened[::-1], shut, world.hand.closed_share)
        reason = left("on closing")
    return reason, stuck[0].name if stuck else ""

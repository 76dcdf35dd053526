"""One way of a joint, led by the hand: to a hold, along with the part's measured motion, and off again."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from asset2sim.gym.contact import pressures
from asset2sim.gym.guards import Guards, Rollout, guard
from asset2sim.gym.hand.gripper import PARKED_M, HandWorld
from asset2sim.gym.hand.holds import CLEAR_M, RUB_M, Hold, Way, cross, frame, holds, motion, way_of
from asset2sim.gym.hand.poses import Kind
from asset2sim.gym.hand.surfaces import is_covered
from asset2sim.physics.arrays import Array
from schemas.learning_settings import GuardSettings
from schemas.overlay import JointPhysics

SAMPLE_STEPS = 5
"""Steps between two samples."""
PAUSE_S, GRIP_S, RELEASE_S, REST_S = 0.1, 0.25, 0.15, 0.6
"""Time that the hand waits at the end, in which the fingers close and open, and for which the object is watched once it
was let go of."""
BACK_M = 0.006
"""How far a hand that pushes backs off before it goes, m."""
PROGRESS = 0.005
"""Share of the way that is progress."""
ARRIVED = 0.97
"""Share of the way from which the part is where it should be; the hand leads it on to its stop."""
SATURATED = 0.95
"""Share of a hand's force from which a part that does not move is too hard to move."""
EASY_STEPS = 20
"""Steps without progress after which it does."""
COAST, SLOW_S = 0.2, 8.0
"""Share of its way that a part may coast that is pushed and not held, and the longest time that such a way takes, s."""
PAST = 0.1
"""Share of its way by which a part without limits is led beyond it, as its friction holds it back."""
UPRIGHT = 0.7
"""Least cosine between up and a way that leads straight up: what goes there falls back once it is let go of."""
GUARDS = GuardSettings()
GENTLE, HARDER = 0.15, 1.012
"""Share of its force with which a hand begins, and factor by which it grows in each step without progress: to all of it
in a third of a second."""


class Stepped(Protocol):
    """A world that is led step by step, and what is seen of it."""

    world: HandWorld

    def step(self) -> None:
        """A step of the world."""


@dataclass(eq=False)
class Recorder:
    """Samples of a way: positions, whether the hand touched the part, its work, and how the object stands; ``most_n``
    is the largest force on the object of a finger or of the palm, N."""

    world: HandWorld
    joint: JointPhysics
    bodies: frozenset[int]
    root: int
    work_j: float = 0.0
    most_n: float = 0.0
    touched: bool = False
    count: int = 0
    rows: list[tuple[float, bool, float, float]] = field(default_factory=list)
    roots: list[tuple[Array, Array]] = field(default_factory=list)
    states: list[Array] | None = None
    """(n,) positions of everything, where a film is wanted."""

    def step(self) -> None:
        """A step of the world, and now and then a sample."""
        self.work_j += self.world.step() * self.world.settings.timestep_s
        self.touched = self.touched or self.world.touches(self.bodies)  # a blow may be over before the sample
        self.count += 1
        if self.count % SAMPLE_STEPS == 0:
            self.sample()

    def sample(self) -> None:
        """A sample of this moment."""
        world, data = self.world, self.world.data
        height = float(data.subtree_com[min(self.bodies), 2])
        pressed: dict[int, Array] = {}
        for _, tool, _, force in pressures(world.model, data, world.hand_geoms, world.object_geoms):
            pressed[tool] = pressed.get(tool, np.zeros(3)) + force
        self.most_n = max([self.most_n, *(float(np.linalg.norm(force)) for force in pressed.values())])
        self.rows.append((world.position(self.joint.name), self.touched, self.work_j, height))
        self.roots.append((data.xipos[self.root].copy(), data.xmat[self.root].reshape(3, 3)[2].copy()))
        self.work_j, self.touched = 0.0, False
        if self.states is not None:
            self.states.append(data.qpos.copy())

    def guards(self, target: float) -> Guards:
        """Findings of the environment's guards in it."""
        positions, touched, work, heights = (np.array(column) for column in zip(*self.rows, strict=True))
        centers, ups = (np.array(column) for column in zip(*self.roots, strict=True))
        joint = self.joint
        lower, upper = span(joint)
        spring = joint.stiffness, joint.spring_reference
        rollout = Rollout(positions, touched, work, heights, centers, ups, lower, upper, target, *spring)
        return guard(rollout, GUARDS)


def span(joint: JointPhysics) -> tuple[float, float]:
    """The joint's range, or for what has no limits a turn either way, rad or m."""
    if joint.lower is None or joint.upper is None:
        return joint.initial_position - math.pi, joint.initial_position + math.pi
    return joint.lower, joint.upper


@dataclass(frozen=True)
class Led:
    """A way that a hand led a part: the share of it gone while the hand had the part, and when the part rested; by
    which kind of hold; the largest share of its force that a hand used which did not slip off; how many ``holds`` were
    tried, and what the guards found; the largest force, N, of a finger or the palm on the object; whether the part is
    lifted straight ``up``, and whether it is ``covered``, so that no hand gets to it."""

    reached: float
    rested: float
    kind: Kind | None
    effort: float
    holds: int
    guards: Guards | None
    contact_n: float
    up: bool
    covered: bool = False


def lead(
    world: HandWorld, joint: JointPhysics, target: float, near: Array | None, states: list[Array] | None = None
) -> Led:
    """The joint led to its target (rad or m) from where it is, by up to ``tries`` holds one after the other, and left
    there."""
    way = way_of(world, joint.name, target)
    whole, up = target - way.start, way.slides and way.sign * float(way.axis[2]) > UPRIGHT
    root = int(world.model.body(world.prefix + world.about.root).id)
    recorder = Recorder(world, joint, way.bodies, root, states=states)
    recorder.sample()
    reached, effort, tried = 0.0, 0.0, 0
    kind: Kind | None = None
    avoid: list[Array] = []
    for _ in range(world.settings.tries):
        way = way_of(world, joint.name, target)
        found = holds(world, way, near, avoid)
        if not found:
            break
        tried += 1
        avoid.append(found[0].pose[:3, 3])
        share, force, slipped = taken(recorder, way, found[0], whole)
        effort = max(effort, 0.0 if slipped else force)
        if share > reached:
            reached, kind = share, found[0].kind
        if not np.isfinite(world.data.qpos).all():
            return Led(reached, reached, kind, effort, tried, None, recorder.most_n, up)
        if reached >= ARRIVED or abs(world.position(joint.name) - target) < (1.0 - ARRIVED) * abs(whole):
            break
        if displaced(recorder):
            break
    rested = 1.0 - (target - world.position(joint.name)) / whole
    covered = not tried and is_covered(world, way.bodies)
    return Led(reached, rested, kind, effort, tried, recorder.guards(target), recorder.most_n, up, covered)


def displaced(recorder: Recorder) -> bool:
    """Whether the object lies or stands elsewhere by now."""
    (center, up), (first, upright), limits = recorder.roots[-1], recorder.roots[0], GUARDS
    tilted, off = float(up @ upright) < math.cos(limits.tilt_rad), center - first
    return tilted or math.sqrt(off @ off) > limits.travel_m


def taken(recorder: Recorder, way: Way, hold: Hold, whole: float) -> tuple[float, float, bool]:
    """Share of the ``whole`` way that is gone while the hand has the part by this hold, the largest share of its force,
    and whether it slipped off. The hand is out of the way afterwards."""
    world, settings = recorder.world, recorder.world.settings
    pose = frame(world.data, hold.body) @ hold.pose
    before = pose.copy()
    before[:3, 3] -= CLEAR_M * world.scale * pose[:3, 2]
    world.put(world.data, before, hold.half_open_m)
    world.grip = hold.half_open_m
    glide(recorder, before, pose, settings.speed_m_s)
    local = hold.pose
    if hold.kind == "grasp":
        world.grip = -1.0
        wait(recorder, GRIP_S)
        local = np.linalg.inv(frame(world.data, hold.body)) @ frame(world.data, world.body)
    elif hold.kind == "rub":
        local = local.copy()
        local[:3, 3] += hold.into
    start = recorder.rows[0][0]
    share, force, slipped = follow(recorder, way, hold, local, lambda position: (position - start) / whole)
    wait(recorder, PAUSE_S)
    share = max(share, (world.position(way.joint) - start) / whole)
    world.grip = max(hold.half_open_m, world.settings.opening_m / 2.0 * world.scale if hold.kind == "grasp" else 0.0)
    here = frame(world.data, world.body)
    if hold.kind == "grasp":
        world.target, world.speed = here, np.zeros(6)
        wait(recorder, RELEASE_S)
    else:
        off, pressed = here.copy(), way_of(world, way.joint, way.target).velocity(here[None, :3, 3])[0]
        if hold.kind == "rub":
            pressed = frame(world.data, hold.body)[:3, :3] @ hold.into
        off[:3, 3] -= BACK_M * pressed / max(float(np.linalg.norm(pressed)), 1e-9)
        glide(recorder, here, off, settings.speed_m_s)
        here = off
    after = here.copy()
    after[:3, 3] -= CLEAR_M * world.scale * here[:3, 2]
    glide(recorder, here, after, settings.speed_m_s)
    parked = np.eye(4)
    parked[2, 3] = PARKED_M
    world.put(world.data, parked, 0.0)
    world.target, world.speed, world.grip = parked, np.zeros(6), 0.0
    wait(recorder, REST_S)
    return share, force, slipped


def follow(
    recorder: Recorder, way: Way, hold: Hold, local: Array, gone: Callable[[float], float]
) -> tuple[float, float, bool]:
    """Lead the part along its measured motion until it is there or stalls: the share gone, the largest share of the
    hand's force while it stalled, and whether the hand slipped off."""
    world, settings, body = recorder.world, recorder.world.settings, hold.body
    data, number = world.data, world.joint(way.joint)
    lever = 1.0
    if not way.slides:
        lever = max(float(np.linalg.norm(way.velocity((frame(data, body) @ local)[None, :3, 3])[0])), 0.004)
    rate = settings.speed_m_s / lever if way.slides else min(settings.turn_rad_s, settings.speed_m_s / lever)
    rate = max(rate, abs(way.target - way.start) / settings.way_s)
    if hold.kind != "grasp" and recorder.joint.stiffness == 0.0:
        rate = min(rate, stopping(world, number, COAST * abs(way.target - way.start), rate))
    ahead = settings.lead_m / lever if way.slides else max(settings.lead_m / lever, 0.05)
    if hold.kind == "rub":
        ahead = RUB_M / 2.0 / lever
    reference, best, idle, slipped = world.position(way.joint), gone(world.position(way.joint)), 0, False
    most, effort, dt = abs(way.target - way.start) / rate + 4.0, 0.0, settings.timestep_s
    free = not world.model.jnt_limited[number]
    end = way.target + way.sign * (min(ahead, PAST * abs(way.target - way.start)) if free else ahead)
    world.force = GENTLE
    for _ in range(world.steps(most)):
        position = world.position(way.joint)
        reference = way.sign * min(way.sign * reference + rate * dt, way.sign * position + ahead, way.sign * end)
        axis, anchor = data.xaxis[number], data.xanchor[number]
        held = frame(data, body) @ local
        world.target = motion(way.slides, axis, anchor, reference - position) @ held
        spin = way.sign * rate * axis
        going = spin if way.slides else cross(spin, world.target[:3, 3] - anchor)
        moving = way.sign * (reference - position) < 0.9 * ahead
        world.speed = np.concatenate([going, np.zeros(3) if way.slides else spin]) * float(moving)
        recorder.step()
        share = gone(world.position(way.joint))
        if share > best + PROGRESS:
            best, idle = share, 0
        else:
            idle += 1
            if idle > EASY_STEPS and best < ARRIVED:
                world.force = min(world.force * HARDER, 1.0)
            pulls = data.xfrc_applied[world.body, :3]
            effort = max(effort, math.sqrt(pulls @ pulls) / world.most_n)
        stalled = idle > world.steps(settings.stalled_s) + EASY_STEPS and world.force >= 1.0
        if not math.isfinite(share) or stalled or (share >= ARRIVED and idle > EASY_STEPS) or displaced(recorder):
            break
        off = data.xpos[world.body] - (frame(data, body) @ local)[:3, 3]
        if math.sqrt(off @ off) > 0.05 * world.scale + settings.lead_m:
            slipped = True
            break
    world.speed, world.force = np.zeros(6), 1.0
    return max(best, gone(world.position(way.joint))), effort, slipped


def stopping(world: HandWorld, number: int, most: float, rate: float) -> float:
    """The speed from which a part's friction and damping stop it within ``most``, rad or m, and at least that at which
    the whole way takes ``SLOW_S``."""
    model, dof = world.model, int(world.model.jnt_dofadr[number])
    resists = float(model.dof_frictionloss[dof] + model.dof_damping[dof] * rate / 2.0)
    return max(math.sqrt(2.0 * most * resists / float(model.dof_M0[dof])), most / COAST / SLOW_S)


def glide(recorder: Stepped, first: Array, last: Array, speed_m_s: float) -> None:
    """Lead the hand straight from one pose to another."""
    world = recorder.world
    path = last[:3, 3] - first[:3, 3]
    length = float(np.linalg.norm(path))
    count = world.steps(max(length / speed_m_s, 0.02))
    world.speed = np.concatenate([path / (count * world.settings.timestep_s), np.zeros(3)])
    for step in range(1, count + 1):
        world.target = last.copy()
        world.target[:3, 3] = first[:3, 3] + path * step / count
        recorder.step()
    world.speed = np.zeros(6)


def wait(recorder: Stepped, seconds: float) -> None:
    """Let the hand keep its target for a time."""
    for _ in range(recorder.world.steps(seconds)):
        recorder.step()

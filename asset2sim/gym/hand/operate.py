"""One way of a joint, led by the hand: to a hold, along with the part's measured motion, and off again."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from asset2sim.gym.guards import Guards, Rollout, guard
from asset2sim.gym.hand.gripper import PARKED_M, HandWorld
from asset2sim.gym.hand.holds import CLEAR_M, Hold, Kind, Way, cross, frame, holds, motion, way_of
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
GENTLE, HARDER = 0.15, 1.012
"""Share of its force with which a hand begins, and factor by which it grows in each step without progress: to all of it
in a third of a second."""


@dataclass(eq=False)
class Recorder:
    """Samples of a way: positions, whether the hand touched the part, its work, and how the object stands."""

    world: HandWorld
    joint: JointPhysics
    bodies: frozenset[int]
    root: int
    work_j: float = 0.0
    count: int = 0
    rows: list[tuple[float, bool, float, float]] = field(default_factory=list)
    roots: list[tuple[Array, Array]] = field(default_factory=list)
    states: list[Array] | None = None
    """(n,) positions of everything, where a film is wanted."""

    def step(self) -> None:
        """A step of the world, and now and then a sample."""
        self.work_j += self.world.step() * self.world.settings.timestep_s
        self.count += 1
        if self.count % SAMPLE_STEPS == 0:
            self.sample()

    def sample(self) -> None:
        """A sample of this moment."""
        world, data = self.world, self.world.data
        part = min(self.bodies)
        touched, height = touches(world, self.bodies), float(data.subtree_com[part, 2])
        self.rows.append((world.position(self.joint.name), touched, self.work_j, height))
        self.roots.append((data.xipos[self.root].copy(), data.xmat[self.root].reshape(3, 3)[2].copy()))
        self.work_j = 0.0
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
        return guard(rollout, GuardSettings())


def span(joint: JointPhysics) -> tuple[float, float]:
    """The joint's range, or for what has no limits a turn either way, rad or m."""
    if joint.lower is None or joint.upper is None:
        return joint.initial_position - math.pi, joint.initial_position + math.pi
    return joint.lower, joint.upper


@dataclass(frozen=True)
class Led:
    """A way that a hand led a part: the share of it gone while the hand had the part, and when the part rested; by
    which kind of hold; the largest share of its force that a hand used which did not slip off; how many ``holds`` were
    tried, and what the guards found."""

    reached: float
    rested: float
    kind: Kind | None
    effort: float
    holds: int
    guards: Guards | None
    finite: bool = True


def lead(
    world: HandWorld, joint: JointPhysics, target: float, near: Array | None, states: list[Array] | None = None
) -> Led:
    """The joint led to its target (rad or m) from where it is, by up to ``tries`` holds one after the other, and left
    there."""
    way = way_of(world, joint.name, target)
    whole = target - way.start
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
            return Led(reached, reached, kind, effort, tried, None, finite=False)
        if reached >= ARRIVED or abs(world.position(joint.name) - target) < (1.0 - ARRIVED) * abs(whole):
            break
        if displaced(recorder):
            break
    rested = 1.0 - (target - world.position(joint.name)) / whole
    return Led(reached, rested, kind, effort, tried, recorder.guards(target))


def displaced(recorder: Recorder) -> bool:
    """Whether the object lies or stands elsewhere by now."""
    (center, up), (first, upright), limits = recorder.roots[-1], recorder.roots[0], GuardSettings()
    tilted = float(up @ upright) < math.cos(limits.tilt_rad)
    return tilted or float(np.linalg.norm(center - first)) > limits.travel_m


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
    start = recorder.rows[0][0]
    share, force, slipped = follow(recorder, way, hold.body, local, lambda position: (position - start) / whole)
    wait(recorder, PAUSE_S)
    share = max(share, (world.position(way.joint) - start) / whole)
    world.grip = max(hold.half_open_m, world.settings.opening_m / 2.0 * world.scale if hold.kind == "grasp" else 0.0)
    here = frame(world.data, world.body)
    if hold.kind == "grasp":
        world.target, world.speed = here, np.zeros(6)
        wait(recorder, RELEASE_S)
    else:
        off, velocity = here.copy(), way_of(world, way.joint, way.target).velocity(here[None, :3, 3])[0]
        off[:3, 3] -= BACK_M * velocity / max(float(np.linalg.norm(velocity)), 1e-9)
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
    recorder: Recorder, way: Way, body: int, local: Array, gone: Callable[[float], float]
) -> tuple[float, float, bool]:
    """Lead the part along its measured motion until it is there or stalls: the share gone, the largest share of the
    hand's force while it stalled, and whether the hand slipped off."""
    world, settings = recorder.world, recorder.world.settings
    data, number = world.data, world.joint(way.joint)
    lever = 1.0
    if not way.slides:
        lever = max(float(np.linalg.norm(way.velocity((frame(data, body) @ local)[None, :3, 3])[0])), 0.004)
    rate = settings.speed_m_s / lever if way.slides else min(settings.turn_rad_s, settings.speed_m_s / lever)
    rate = max(rate, abs(way.target - way.start) / settings.way_s)
    ahead = settings.lead_m / lever if way.slides else max(settings.lead_m / lever, 0.05)
    reference, best, idle, slipped = world.position(way.joint), gone(world.position(way.joint)), 0, False
    most, effort, dt = abs(way.target - way.start) / rate + 4.0, 0.0, settings.timestep_s
    end = way.target + way.sign * ahead
    world.force = GENTLE
    for _ in range(world.steps(most)):
        position = world.position(way.joint)
        reference = way.sign * min(way.sign * reference + rate * dt, way.sign * position + ahead, way.sign * end)
        axis, anchor = data.xaxis[number], data.xanchor[number]
        moved = motion(way.slides, axis, anchor, reference - position)
        world.target = moved @ frame(data, body) @ local
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
            effort = max(effort, float(np.linalg.norm(data.xfrc_applied[world.body, :3])) / world.most_n)
        stalled = idle > world.steps(settings.stalled_s) + EASY_STEPS and world.force >= 1.0
        if not math.isfinite(share) or stalled or (share >= ARRIVED and idle > EASY_STEPS) or displaced(recorder):
            break
        off = data.xpos[world.body] - (frame(data, body) @ local)[:3, 3]
        if float(np.linalg.norm(off)) > 0.05 * world.scale + settings.lead_m:
            slipped = True
            break
    world.speed, world.force = np.zeros(6), 1.0
    return max(best, gone(world.position(way.joint))), effort, slipped


def glide(recorder: Recorder, first: Array, last: Array, speed_m_s: float) -> None:
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


def wait(recorder: Recorder, seconds: float) -> None:
    """Let the hand keep its target for a time."""
    for _ in range(recorder.world.steps(seconds)):
        recorder.step()


def touches(world: HandWorld, bodies: frozenset[int]) -> bool:
    """Whether the hand presses on one of these bodies."""
    data, count = world.data, world.data.ncon
    if not count:
        return False
    geoms = data.contact.geom[:count]
    hand, owners = world.hand_geoms[geoms], world.model.geom_bodyid[geoms]
    part = np.isin(owners, list(bodies))
    return bool(((hand[:, 0] & part[:, 1]) | (hand[:, 1] & part[:, 0])).any())

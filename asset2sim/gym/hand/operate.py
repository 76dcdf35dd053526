"""One way of a joint, led by the hand: to a hold, along with the part's measured motion, and off again."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asset2sim.gym.guards import Guards
from asset2sim.gym.hand.gripper import PARKED_M, HandWorld
from asset2sim.gym.hand.holds import CLEAR_M, RUB_M, HandHold, Way, axis_motion, best_holds, cross, way_of
from asset2sim.gym.hand.poses import Kind
from asset2sim.gym.hand.recorder import Recorder, is_displaced, move_hand, presses_elsewhere, wait
from asset2sim.gym.hand.surfaces import is_covered, is_flush, stands_out, surface_places
from asset2sim.gym.world import body_pose
from asset2sim.physics.arrays import Array
from schemas.overlay import JointPhysics

PAUSE_S, GRIP_S, RELEASE_S, REST_S = 0.1, 0.25, 0.15, 0.6
"""Time that the hand waits at the end, in which the fingers close and open, and for which the object is watched once it
was let go of, unless it stays as it is."""
NEAR_M, SLOWLY = 0.007, 0.2
"""How far off a hand slows down, m, and to what share of its speed: it goes 2 mm on until it is slow, and a part may
be met 3 mm ahead of the hold (an edge beside it); what is hit faster and light flies off, as a table's door of 30 g."""
BACK_M = 0.006
"""How far a hand that pushes backs off before it goes, m."""
PROGRESS = 0.005
"""Share of the way that is progress."""
ARRIVED = 0.97
"""Share of the way from which the part is where it should be; the hand leads it on to its stop."""
EDGE = 2.0
"""Times the hand's speed that a part's edge goes at most, which is led nearer its hinge: it is not struck open."""
RUNS = 1.2
"""Times the hand's speed from which a part runs away from it, as a door whose seal lets go: it is not pulled on."""
EASY_STEPS, BRISK = 10, 0.6
"""Steps without progress after which it does, and share of its speed below which it does too."""
CALM_STEPS = 15
"""Steps between two looks at whether the object rests."""
FIRMER, SLANT = 1.05, 0.8
"""Factor by which a finger that rubs with all its force is led further ahead in each step without progress, and the
most of that over how far it is led into what it rubs: friction of 1 holds, with room."""
MISSES = 2
"""Grasps that close on nothing, as what is round slips out of them, and are no try."""
LEAST = 0.1
"""Share of the way that a hold gains, or its kind is tried again only after others."""
COAST, SLOW_S = 0.2, 8.0
"""Share of its way that a part may coast that is pushed and not held, and the longest time that such a way takes, s."""
PAST = 0.1
"""Share of its way by which a part without limits is led beyond it, as its friction holds it back."""
UPRIGHT = 0.7
"""Least cosine between up and a way that leads straight up: what goes there falls back once it is let go of."""
GENTLE, HARDER, GIVEN_S = 0.15, 1.03, 0.2
"""Share of its force with which a hand begins, factor by which it grows in each step without progress, to all of it
in a quarter of a second, and time for which all of it must move nothing: 8 N move 30 kg by 5 mm in that."""


@dataclass(frozen=True)
class Led:
    """A way that a hand led a part: the share of it gone while the hand had the part, and when the part rested; by
    which kind of hold; what the joint itself ``takes`` where it stood still, over what a hand has at its edge; how
    many ``holds`` were tried, and what the guards found; the largest force, N, of a finger or the palm on the object;
    whether the part is lifted straight ``up``, whether it is ``covered``, so that no hand gets to it, or ``flush`` with
    what is around it, and whether other parts of the object were ``in_the_way`` of the hand; how much ``deeper_m`` its
    way leads than it stands out of these, 0 where a finger could press it far enough."""

    reached: float
    rested: float
    kind: Kind | None
    takes: float
    holds: int
    guards: Guards | None
    contact_n: float
    up: bool
    covered: bool = False
    in_the_way: bool = False
    deeper_m: float = 0.0
    flush: bool = False


def lead_joint(world: HandWorld, joint: JointPhysics, target: float, near: Array | None) -> Led:
    """The joint led from where it is to its target (rad or m) by up to ``tries`` holds, and left there."""
    way = way_of(world, joint.name, target)
    whole, up = target - way.start, way.slides and way.sign * float(way.axis[2]) > UPRIGHT
    recorder = Recorder(world, joint, way.bodies)
    recorder.sample()
    reached, takes, tried, in_the_way, deeper_m = 0.0, math.inf, 0, False, 0.0
    kind: Kind | None = None
    avoid, slipped = list[Array](), list[Kind]()
    while tried < world.settings.tries + min(recorder.missed, MISSES):
        way = way_of(world, joint.name, target)
        found = best_holds(world, way, near, avoid, slipped)
        if not found:
            break
        tried += 1
        avoid.append(found[0].pose[:3, 3])
        share, resists, stopped = share_by_hold(recorder, way, found[0], whole)
        takes = min(takes, resists / hand_limit(world, way, found[0].kind))
        slipped += [found[0].kind] * (share < reached + LEAST)
        if share > reached or not kind:
            in_the_way = stopped
        if share > reached:
            reached, kind = share, found[0].kind
        if not np.isfinite(world.data.qpos).all():
            return Led(reached, reached, kind, takes, tried, None, recorder.most_n, up)
        if reached >= ARRIVED or abs(world.position(joint.name) - target) < (1.0 - ARRIVED) * abs(whole):
            break
        if is_displaced(recorder) or (stopped and (tried > 1 or joint.stiffness > 0.0)):
            break
    rested = 1.0 - (target - world.position(joint.name)) / whole
    covered = not tried and is_covered(world, way.bodies)
    flush = not tried and not covered and is_flush(world, way.bodies, way.velocity)
    if in_the_way and way.slides:
        out_m = stands_out(world, way.bodies, way.sign * way.axis)
        if out_m < abs(target - world.position(joint.name)) - (1.0 - world.settings.open_share) * abs(whole):
            deeper_m = abs(target - world.position(joint.name)) - out_m
    guards = recorder.guards(target)
    return Led(reached, rested, kind, takes, tried, guards, recorder.most_n, up, covered, in_the_way, deeper_m, flush)


def share_by_hold(recorder: Recorder, way: Way, hold: HandHold, whole: float) -> tuple[float, float, bool]:
    """Share of the ``whole`` way that is gone while the hand has the part by this hold, what the joint itself took,
    N·m or N, and whether other parts stopped it. The hand is out of the way afterwards."""
    world, settings = recorder.world, recorder.world.settings
    pose = body_pose(world.data, hold.body) @ hold.pose
    before = pose.copy()
    before[:3, 3] -= CLEAR_M * world.scale * pose[:3, 2]
    world.put(world.data, before, hold.half_open_m)
    world.grip = hold.half_open_m
    near = pose.copy()
    near[:3, 3] -= NEAR_M * pose[:3, 2]
    move_hand(recorder, before, near, settings.speed_m_s)
    move_hand(recorder, near, pose, SLOWLY * settings.speed_m_s)
    local = hold.pose
    if hold.kind == "grasp":
        world.grip = -1.0
        wait(recorder, GRIP_S)
        local = np.linalg.inv(body_pose(world.data, hold.body)) @ body_pose(world.data, world.body)
    elif hold.kind == "rub":
        local = local.copy()
        local[:3, 3] += hold.into
    start, has = recorder.samples[0].position, hold.kind != "grasp" or world.touches(way.bodies)
    share, takes, stopped = -math.inf, effort_on_way(world, way), False
    if has:
        share, takes, stopped = lead_along(recorder, way, hold, local, lambda position: (position - start) / whole)
        wait(recorder, PAUSE_S)
    recorder.missed += not has
    share = max(share, (world.position(way.joint) - start) / whole)
    world.grip = max(hold.half_open_m, world.settings.opening_m / 2.0 * world.scale if hold.kind == "grasp" else 0.0)
    here = body_pose(world.data, world.body)
    if hold.kind == "grasp":
        world.target, world.speed = here, np.zeros(6)
        wait(recorder, RELEASE_S)
    else:
        off, pressed = here.copy(), way_of(world, way.joint, way.target).velocity(here[None, :3, 3])[0]
        if hold.kind == "rub":
            pressed = body_pose(world.data, hold.body)[:3, :3] @ hold.into
        off[:3, 3] -= BACK_M * pressed / max(float(np.linalg.norm(pressed)), 1e-9)
        move_hand(recorder, here, off, settings.speed_m_s)
        here = off
    after = here.copy()
    after[:3, 3] -= CLEAR_M * world.scale * here[:3, 2]
    move_hand(recorder, here, after, settings.speed_m_s)
    parked = np.eye(4)
    parked[2, 3] = PARKED_M
    world.put(world.data, parked, 0.0)
    world.target, world.speed, world.grip = parked, np.zeros(6), 0.0
    for left in range(world.steps(REST_S), 0, -1):
        recorder.step()
        if left % CALM_STEPS == 0 and world.stays(left * world.dt):
            break
    return share, takes, stopped


def lead_along(
    recorder: Recorder, way: Way, hold: HandHold, local: Array, gone: Callable[[float], float]
) -> tuple[float, float, bool]:
    """Lead the part along its measured motion until it is there or stalls: the share gone, what the joint itself took
    where it stood still, N·m or N, and whether other parts stopped the hand."""
    world, settings, body = recorder.world, recorder.world.settings, hold.body
    data, number = world.data, world.joint(way.joint)
    dof, lever = int(world.model.jnt_dofadr[number]), 1.0
    if not way.slides:
        lever = max(float(np.linalg.norm(way.velocity((body_pose(data, body) @ local)[None, :3, 3])[0])), 0.004)
    rate = rate_of(world, way, lever)
    sprung = recorder.joint.stiffness > 0.0
    if hold.kind != "grasp" and not sprung:
        rate = min(rate, speed_that_stops(world, number, COAST * abs(way.target - way.start), rate))
    brisk = max(rate, settings.speed_m_s / lever)
    ahead = settings.lead_m / lever if way.slides else max(settings.lead_m / lever, 0.05)
    firmest, rubs = ahead, hold.kind == "rub"  # then all that friction has goes into the part, none into the damper
    if rubs:
        ahead, firmest = RUB_M / 2.0 / lever, SLANT * RUB_M / lever
    reference, best, idle, given, stuck = world.position(way.joint), gone(world.position(way.joint)), 0, 0, False
    most, takes, dt = abs(way.target - way.start) / rate + 4.0, 0.0, world.dt
    free = not world.model.jnt_limited[number]
    end = way.target + way.sign * (min(ahead, PAST * abs(way.target - way.start)) if free else ahead)
    world.force = GENTLE
    for _ in range(world.steps(most)):
        position = world.position(way.joint)
        if not sprung and way.sign * float(data.qvel[dof]) > RUNS * rate:
            reference = way.sign * min(way.sign * reference, way.sign * position)
        pace = brisk if way.sign * (position - reference) > 0.0 else rate  # after what has run ahead
        reference = way.sign * min(way.sign * reference + pace * dt, way.sign * position + ahead, way.sign * end)
        axis, anchor = data.xaxis[number], data.xanchor[number]
        held = body_pose(data, body) @ local
        world.target = axis_motion(way.slides, axis, anchor, reference - position) @ held
        spin = way.sign * rate * axis
        going = spin if way.slides else cross(spin, world.target[:3, 3] - anchor)
        moving = way.sign * (reference - position) < 0.9 * ahead
        along = max(float(moving), rubs * min(max(way.sign * float(data.qvel[dof]) / rate, 0.0), 1.0))
        world.speed = np.concatenate([going, np.zeros(3) if way.slides else spin]) * along
        recorder.step()
        share = gone(world.position(way.joint))
        slow = not sprung and not moving and way.sign * float(data.qvel[dof]) < BRISK * rate
        if share > best + PROGRESS:
            best, idle, given, stuck = share, 0, 0, False
        else:
            idle += 1
            stuck = (
                sprung and idle > EASY_STEPS and presses_elsewhere(recorder)
            )  # no hand presses harder on what does not give
            takes = max(takes, effort_on_way(world, way))
        if (slow or idle > EASY_STEPS) and (share if sprung else best) < ARRIVED and not stuck:
            ahead = min(ahead * FIRMER, firmest) if world.force >= 1.0 else ahead
            world.force = min(world.force * HARDER, 1.0)
        given += world.force >= 1.0 and ahead >= firmest
        stalled = given > world.steps(GIVEN_S) or (stuck and idle > world.steps(settings.stalled_s) + EASY_STEPS)
        if not math.isfinite(share) or stalled or (share >= ARRIVED and idle > EASY_STEPS) or is_displaced(recorder):
            break
        off = data.xpos[world.body] - (body_pose(data, body) @ local)[:3, 3]
        if math.sqrt(off @ off) > 0.05 * world.scale + settings.lead_m:
            break
    world.speed, world.force = np.zeros(6), 1.0
    share = gone(world.position(way.joint))
    # What a spring brings back is where the hand holds it: a blow takes a key further than a finger does.
    return share if sprung else max(best, share), takes, share < ARRIVED and presses_elsewhere(recorder)


def rate_of(world: HandWorld, way: Way, lever: float) -> float:
    """How fast a hand leads a part by a hold so far from its axis, rad/s or m/s: at its own speed, but even the longest
    way within ``way_s``, and what turns no faster than a wrist, nor its edge than ``EDGE`` says."""
    settings = world.settings
    rate = settings.speed_m_s / lever if way.slides else min(settings.turn_rad_s, settings.speed_m_s / lever)
    rate = max(rate, abs(way.target - way.start) / settings.way_s)
    if way.slides:
        return rate
    edge_m = max(lever, world.edge_m(way.joint, surface_places(world, way.bodies)[0]))
    return min(rate, EDGE * settings.speed_m_s / edge_m)


def hand_limit(world: HandWorld, way: Way, kind: Kind) -> float:
    """The most that a hand has on a joint by a kind of hold, N·m or N: at the edge of its part, and about the wrist."""
    lever = world.edge_m(way.joint, surface_places(world, way.bodies)[0])
    twist = world.settings.torque_n_m if kind == "grasp" and not way.slides else 0.0
    return world.most_n * lever + twist


def effort_on_way(world: HandWorld, way: Way) -> float:
    """The effort that a joint, and those that follow it, take on the way where they stand still, N·m or N: by friction,
    springs and other mechanisms, and weight."""
    model, data, found = world.model, world.data, 0.0
    followers = {one.name: one.mimic[1] for one in world.about.joints if one.mimic and one.mimic[0] == way.joint}
    for name, times in {way.joint: 1.0, **followers}.items():
        dof = int(model.jnt_dofadr[world.joint(name)])
        helps = data.qfrc_passive[dof] + data.qfrc_applied[dof] - data.qfrc_bias[dof]
        found += abs(times) * float(model.dof_frictionloss[dof]) - way.sign * times * float(helps)
    return found


def speed_that_stops(world: HandWorld, number: int, most: float, rate: float) -> float:
    """The speed from which a part's friction and damping stop it within ``most``, rad or m, and at least that at which
    the whole way takes ``SLOW_S``."""
    model, dof = world.model, int(world.model.jnt_dofadr[number])
    resists = float(model.dof_frictionloss[dof] + model.dof_damping[dof] * rate / 2.0)
    return max(math.sqrt(2.0 * most * resists / float(model.dof_M0[dof])), most / COAST / SLOW_S)

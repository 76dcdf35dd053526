"""The effort check: the force at a part's edge that moves it, and whether the object tips over or slides before."""

from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.joint_groups import by_joint
from asset2sim.checks.mechanism import Mechanism, poses_at
from asset2sim.checks.opening import openings as measured_openings
from asset2sim.checks.rig import Rig
from asset2sim.checks.set_down import Clouds
from asset2sim.physics.arrays import Array
from asset2sim.physics.grip import Grip, grip_on
from asset2sim.physics.support_polygon import DOWNWARD, SupportPolygon
from schemas.interaction import Effort, Interaction, Opening
from schemas.overlay import JointPhysics
from schemas.settings import Thresholds
from schemas.support import SupportKind
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode

CENTRED_SHARE = 0.05
"""Least share of a joint's range that is left beyond where its spring is relaxed, for the part to turn both ways."""


def measure(rig: Rig) -> dict[str, object]:
    """The least efforts of every joint with the root held, or as it stands where its part is on the floor, and what
    they are at the edge of its part."""
    opened = measured_openings(rig.held.sound(), rig.item, rig.settings)
    friction, kind, support = rig.overlay.contact_friction, rig.overlay.support.kind, rig.down().support
    on_floor = rig.standing.on_floor if rig.standing is not None else ()
    found = efforts(
        rig.item,
        rig.clouds,
        [standing_opening(rig, e) if e.joint in on_floor else e for e in opened],
        support,
        friction,
        rig.limits,
        kind,
    )
    marked = tuple(item.model_copy(update={"on_floor": item.joint in on_floor}) for item in found)
    return {"openings": opened, "efforts": marked}


def standing_opening(rig: Rig, held: Opening) -> Opening:
    """The least efforts of a joint whose part is on the floor: those measured there, root free, where they are larger
    than those ``held``; its effort limit where that does not move it."""
    (seen,) = measured_openings(rig.free.sound(), rig.item, rig.settings, {held.joint}, settle_s=rig.settings.still_s)

    def larger(here: float | None, above: float | None) -> float | None:
        return above if above is None else max(above, here if here is not None else held.effort_limit or 0.0)

    ways = {"opening": larger(seen.opening, held.opening), "closing": larger(seen.closing, held.closing)}
    return held.model_copy(update=ways)


def efforts(
    item: Mechanism,
    clouds: Clouds,
    openings: Sequence[Opening],
    support: SupportPolygon | None,
    friction: float,
    limits: Thresholds,
    carried: SupportKind = SupportKind.FREESTANDING,
) -> tuple[Effort, ...]:
    """Forces that a hand needs at the edge of every joint's part, each way that it has room, from the least efforts
    that were measured with the root held, and statics on ``support`` at this Coulomb ``friction``; without one nothing
    tips, nor where the object is ``carried`` by a hand. A light object whose button is pressed sideways or from below
    is held in the other hand."""
    poses = poses_at(item, item.start)
    joints = {joint.name: joint for joint in item.joints}
    found = []
    for seen in openings:
        joint = joints[seen.joint]
        if carried is not SupportKind.FIXED and bears_the_rest(item, joint):
            continue
        grip = part_grip(item, clouds, joint, poses)
        for way, effort, sign in (
            ("opening", seen.opening, opening_sign(joint)),
            ("closing", seen.closing, -opening_sign(joint)),
        ):
            if grip is None or effort is None:
                continue
            direction = sign * grip.direction
            stands = support if carried is SupportKind.FREESTANDING else None
            braced = joint.effort_range is not None and joint.effort_range.braced
            if stands is not None and (braced or in_hand(joint, direction, stands, limits)):
                stands = None
            record = Effort(
                joint=seen.joint,
                way=way,
                effort=effort,
                lever_m=grip.lever,
                tips_at_n=None if stands is None else stands.tips_at(grip.point, direction),
                slides_at_n=None if stands is None else stands.slides_at(direction, friction),
            )
            found.append(record)
    return tuple(found)


def bears_the_rest(item: Mechanism, joint: JointPhysics) -> bool:
    """Whether the joint moves most of the object's mass: the object stands on that part, and no hand moves it."""
    moved = sum(item.bodies[link].mass for link in item.moved[joint.name])
    return moved > sum(body.mass for body in item.bodies.values()) / 2.0


def in_hand(joint: JointPhysics, direction: Array, support: SupportPolygon, limits: Thresholds) -> bool:
    """Whether a hand holds the object while another moves the part along the (3,) direction: of a light object, a part
    with a spring, or a rocker, that the table does not press back."""
    pressed = (joint.stiffness > 0.0 and not joint.holds) or joint.mechanism == "bistable"
    return pressed and support.mass < limits.held_by_hand_kg and float(direction @ support.up) > -DOWNWARD


def opening_sign(joint: JointPhysics) -> float:
    """The sign of the joint's positions towards its open end."""
    return 1.0 if joint.open >= joint.closed else -1.0


def part_grip(item: Mechanism, clouds: Clouds, joint: JointPhysics, poses: Mapping[str, Array]) -> Grip | None:
    """Where a hand moves the part of a joint, in the root's frame; None for a part without collision shapes."""
    hinge = next(entry for entry in item.tree if entry.name == joint.name)
    frame = poses[hinge.parent] @ hinge.child_to_parent
    parts = [
        clouds[link] @ poses[link][:3, :3].T + poses[link][:3, 3] for link in item.rigid[joint.name] & clouds.keys()
    ]
    points = np.vstack([np.zeros((0, 3)), *parts])
    slides = joint.type == "prismatic"
    return grip_on(points, frame[:3, :3] @ hinge.axis, frame[:3, 3], slides=slides, opens=opening_sign(joint))


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a joint, on the way that is worst."""
    return [effort_verdict(items, joints[name], seen.engine.value) for name, items in by_joint(seen.efforts)]


def effort_verdict(items: list[Effort], joint: JointPhysics, engine: str) -> CheckVerdict:
    """A part must move by a hand's force at its edge, within the range for its kind, before the object tips or slides;
    by no more whichever way it is moved, and by no less the harder way, or against its spring: where that is relaxed
    within the range, it has no force at the start, and is felt at the end."""
    worst = max(
        (effort_one_way(item, joint, engine) for item in items), key=lambda found: (not found.passed, found.value)
    )
    resisted = [item for item in items if joint.stiffness <= 0.0 or joint.holds or is_pressed(item, joint)]
    hardest = max(resisted, key=lambda item: item.force_n, default=None)
    asked = joint.effort_range
    if not worst.passed or hardest is None or asked is None:
        return worst
    if max(hardest.force_n, centred_force(hardest, joint)) >= asked.least_n:
        return worst
    said = f"{effort_in_words(hardest, engine)}; a {asked.kind} takes at least {asked.least_n:.3g} N ({asked.source})"
    force, advice = hardest.force_n, remedy_in_words(joint)
    return CheckVerdict(
        FailureMode.EFFORT, worst.subject, False, force, asked.least_n, f"{said}: {advice}", hardest.way
    )


def effort_in_words(item: Effort, engine: str) -> str:
    """The force that one way of moving a part takes, in words."""
    said = f"{item.way} joint '{item.joint}' takes {item.force_n:.3g} N at its part's edge in {engine}"
    return f"{said}, where its part is on the floor" if item.on_floor else said


def effort_one_way(item: Effort, joint: JointPhysics, engine: str) -> CheckVerdict:
    """The verdict on one way of moving a part."""
    force, asked = item.force_n, joint.effort_range
    takes = effort_in_words(item, engine)

    def verdict(passed: bool, limit: float | None, reason: str) -> CheckVerdict:
        return CheckVerdict(FailureMode.EFFORT, item.joint, passed, force, limit, reason, item.way)

    if asked is not None and force > asked.most_n:
        said = f"{takes}; a {asked.kind} takes at most {asked.most_n:.3g} N ({asked.source})"
        advice = "make the part lighter, or its joint looser"
        return verdict(False, asked.most_n, f"{said}: {advice}")
    for most, does in ((item.tips_at_n, "tips over"), (item.slides_at_n, "slides away")):
        if most is not None and force > most:
            said = f"{takes}, and the object {does} at {most:.3g} N"
            return verdict(False, most, f"{said}: fix it, or hold it down")
    tips = "" if item.tips_at_n is None else f"; the object tips over at {item.tips_at_n:.3g} N"
    return verdict(True, None if asked is None else asked.most_n, takes + tips)


def remedy_in_words(joint: JointPhysics) -> str:
    """The remedy of a person for a part that moves too lightly to feel."""
    if joint.stiffness <= 0.0 or joint.holds:
        return "give it more friction"
    if joint.armature <= 0.0 or joint.lower is None or joint.upper is None:
        return "give it a stronger spring"
    travel, unit, times = joint.upper - joint.lower, joint.unit, joint.armature / (joint.least_inertia or 1.0)
    return (
        f"give it a stronger spring; one over {travel:.2g} {unit} of travel, whose armature is {times:.2g} times what "
        "the part moves, may be all that solvers bear: then more travel, or a heavier part"
    )


def is_pressed(item: Effort, joint: JointPhysics) -> bool:
    """Whether the part is moved against its spring, from where that returns it."""
    opening = joint.open >= joint.closed
    return joint.stiffness > 0.0 and (joint.spring_reference < joint.initial_position) == (
        opening is (item.way == "opening")
    )


def centred_force(item: Effort, joint: JointPhysics) -> float:
    """The force at the part's edge, N, of a spring relaxed within the range, at the farther end; 0 without one."""
    rest = joint.spring_reference
    if joint.stiffness <= 0.0 or joint.holds or joint.lower is None or joint.upper is None:
        return 0.0
    nearer, farther = sorted((rest - joint.lower, joint.upper - rest))
    return joint.stiffness * farther / item.lever_m if nearer > CENTRED_SHARE * (joint.upper - joint.lower) else 0.0


CHECK = DeclaredCheck(
    name="effort",
    modes={
        FailureMode.EFFORT: Guide(
            "Opening it takes more or less than people expect of its kind, or tips it over first",
            "the reason has the force and the range (`efforts.csv`); say `stiff` or `light` in the guidance, or fix it",
        )
    },
    done="the least force at a part's edge that moves each joint, either way (a selector to its next click), on the "
    "floor where the part is on it",
    holds="within the range for its kind (`efforts.csv`, each with its source), and less than tips over or slides the "
    "object",
    bounds=("held_by_hand_kg",),
    measure=measure,
    judge=judge,
    place=90,
    turn=70,
    along=(FailureMode.STANDS, FailureMode.STATE),
    planted=("friction beyond a hand",),
)

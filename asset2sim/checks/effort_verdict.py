"""The verdict on what a hand needs to move a part: within the range for its kind, before the object tips or slides."""

from asset2sim.checks.check_verdict import CheckVerdict, unit_of
from schemas.interaction import Effort
from schemas.overlay import JointPhysics
from schemas.vocabulary import FailureMode


def effort_verdict(items: list[Effort], joint: JointPhysics, engine: str) -> CheckVerdict:
    """A part must move by a hand's force at its edge, within the range for its kind, before the object tips or slides,
    whichever way it is moved; the verdict is on the way that is worst."""
    return max(
        (effort_one_way(item, joint, engine) for item in items), key=lambda found: (not found.passed, found.value)
    )


def effort_one_way(item: Effort, joint: JointPhysics, engine: str) -> CheckVerdict:
    """The verdict on one way of moving a part."""
    force, asked, subject = item.force_n, joint.effort_range, item.joint
    takes = f"{item.way} joint '{item.joint}' takes {force:.3g} N at its part's edge in {engine}"
    if asked is not None and force > asked.most_n:
        said = f"{takes}; a {asked.kind} takes at most {asked.most_n:.3g} N ({asked.source})"
        advice = "make the part lighter, or its joint looser"
        return CheckVerdict(FailureMode.EFFORT, subject, False, force, asked.most_n, f"{said}: {advice}")
    if asked is not None and force < asked.least_n and pressed(item, joint):
        said = f"{takes}; a {asked.kind} takes at least {asked.least_n:.3g} N ({asked.source})"
        return CheckVerdict(FailureMode.EFFORT, subject, False, force, asked.least_n, f"{said}: {stronger(joint)}")
    for most, does in ((item.tips_at_n, "tips over"), (item.slides_at_n, "slides away")):
        if most is not None and force > most:
            said = f"{takes}, and the object {does} at {most:.3g} N"
            return CheckVerdict(FailureMode.EFFORT, subject, False, force, most, f"{said}: fix it, or hold it down")
    tips = "" if item.tips_at_n is None else f"; the object tips over at {item.tips_at_n:.3g} N"
    return CheckVerdict(FailureMode.EFFORT, subject, True, force, None if asked is None else asked.most_n, takes + tips)


def stronger(joint: JointPhysics) -> str:
    """What a person would do about a spring that is too weak to feel."""
    if joint.armature <= 0.0 or joint.lower is None or joint.upper is None:
        return "give it a stronger spring"
    travel, unit = joint.upper - joint.lower, unit_of(joint)
    return (
        f"over {travel:.2g} {unit} of travel its armature of {joint.armature:.2g} is all that solvers bear at "
        "the coarse time step, and bears no stronger spring; give it more travel"
    )


def pressed(item: Effort, joint: JointPhysics) -> bool:
    """Whether the part is moved against its spring, from where that returns it."""
    opening = joint.open >= joint.closed
    return joint.stiffness > 0.0 and (joint.spring_reference < joint.initial_position) == (
        opening is (item.way == "opening")
    )

"""Findings for joints moved and hulls cut by the refinement loop, with the reason."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from asset2sim.refinement.collision.trim import Cut
from asset2sim.refinement.context import Log, info, warning
from asset2sim.refinement.position_bands import Pose
from schemas.errors import first_words
from schemas.finding import Finding
from schemas.overlay import JointPhysics, LinkPhysics, PhysicsOverlay


def move_findings(requested: Pose, moved: Mapping[str, float], why: str) -> list[Finding]:
    """A finding for every joint whose initial position differs from the requested one."""
    findings = []
    for name, value in moved.items():
        text = f"joint '{name}' starts at {value:.4g} in place of {requested[name]:.4g}: {why}"
        findings.append(info(code="state_moved", message=text, joint=name, value=value, limit=requested[name]))
    return findings


def note_cuts(cuts: Sequence[Cut], where: str, when: str, log: Log) -> None:
    """A finding for every link whose collision hulls were cut, with the links it overlapped."""
    for link in sorted({cut.link for cut in cuts}):
        own = [cut for cut in cuts if cut.link == link]
        deepest = max(own, key=lambda cut: cut.depth_m)
        others = first_words(list(dict.fromkeys(f"'{cut.other}'" for cut in own)), 4)
        text = (
            f"collision of link '{link}' cut by up to {1e3 * deepest.depth_m:.3g} mm ({deepest.share:.0%} of a hull) "
            f"{where} {others} {when}; its looks are unchanged"
        )
        log.findings.append(warning(code="collision_cut", message=text, link=link, value=deepest.depth_m))


JOINT_TERMS = {"damping": ("N·m·s/rad", "N·s/m"), "friction": ("N·m", "N"), "stiffness": ("N·m/rad", "N/m")}
"""Joint terms that mending may change → units for hinges and sliders."""
mended = partial(info, code="mended")
"""A finding for one number that mending changed: ``value`` from ``limit``."""


def changed_numbers(before: PhysicsOverlay, after: PhysicsOverlay, why: str) -> Iterator[Finding]:
    """A finding for every number that differs; ``why`` names the check that failed before."""
    was, now = before.rolling_friction_m, after.rolling_friction_m
    if was != now:
        text = f"rolling resistance of contacts set from {1e3 * was:.3g} to {1e3 * now:.3g} mm: {why}"
        yield mended(message=text, value=now, limit=was)
    if before.turned_rad != after.turned_rad:
        angle = math.degrees(math.dist(after.turned_rad, before.turned_rad))
        yield mended(message=f"the object turned by {angle:.3g}°, to lie as it comes to rest: {why}", value=angle)
    for old_link, link in zip(before.links, after.links, strict=True):
        yield from _link(old_link, link, why)
    for old_joint, joint in zip(before.joints, after.joints, strict=True):
        yield from _joint(old_joint, joint, why)


def _link(old: LinkPhysics, new: LinkPhysics, why: str) -> Iterator[Finding]:
    if old.mass_kg != new.mass_kg:
        text = f"mass of link '{new.name}' raised from {old.mass_kg:.3g} to {new.mass_kg:.3g} kg: {why}"
        yield mended(message=text, value=new.mass_kg, limit=old.mass_kg, link=new.name)


def _joint(old: JointPhysics, new: JointPhysics, why: str) -> Iterator[Finding]:
    for term, units in JOINT_TERMS.items():
        was, now = float(getattr(old, term)), float(getattr(new, term))
        if was != now:
            unit = units[new.type == "prismatic"]
            text = f"joint '{new.name}': {term} set from {was:.3g} to {now:.3g} {unit}: {why}"
            yield mended(message=text, value=now, limit=was, joint=new.name)

"""Findings for joints moved and hulls cut by the refinement loop, with the reason."""

from collections.abc import Iterator, Mapping, Sequence

from asset2sim.refinement.bands import Pose
from asset2sim.refinement.collision.part_links import CutAttempt
from asset2sim.refinement.collision.trim import Cut
from asset2sim.refinement.context import Log
from schemas.finding import Finding
from schemas.overlay import JointPhysics, LinkPhysics, PhysicsOverlay
from schemas.vocabulary import Severity, Stage


def move_findings(requested: Pose, moved: Mapping[str, float], why: str) -> list[Finding]:
    """A finding for every joint whose initial position differs from the requested one."""
    return [
        Finding(
            stage=Stage.REFINE,
            severity=Severity.INFO,
            code="state_moved",
            message=f"joint '{name}' starts at {value:.4g} in place of {requested[name]:.4g}: {why}",
            joint=name,
            value=value,
            limit=requested[name],
        )
        for name, value in moved.items()
    ]


def note_shapes(best: CutAttempt, log: Log) -> None:
    """A finding for every link cut to clear a state, with the links it overlapped."""
    note_cuts(best.cut, "where it overlaps", "in every state near the requested one", log)


def note_cuts(cuts: Sequence[Cut], where: str, when: str, log: Log) -> None:
    """A finding for every link whose collision hulls were cut, with the links it overlapped."""
    for link in sorted({cut.link for cut in cuts}):
        own = [cut for cut in cuts if cut.link == link]
        deepest = max(own, key=lambda cut: cut.depth_m)
        others = ", ".join(f"'{cut.other}'" for cut in own[:4]) + (f" and {len(own) - 4} more" if len(own) > 4 else "")
        log.findings.append(
            Finding(
                stage=Stage.REFINE,
                severity=Severity.WARNING,
                code="collision_cut",
                message=f"collision of link '{link}' cut by up to {1e3 * deepest.depth_m:.3g} mm "
                f"({deepest.share:.0%} of a hull) {where} {others} {when}; its looks are unchanged",
                link=link,
                value=deepest.depth_m,
            )
        )


JOINT_TERMS = {"damping": ("N·m·s/rad", "N·s/m"), "friction": ("N·m", "N"), "stiffness": ("N·m/rad", "N/m")}
"""Joint terms that mending may change → units for hinges and sliders."""


def changes(before: PhysicsOverlay, after: PhysicsOverlay, why: str) -> Iterator[Finding]:
    """A finding for every number that differs; ``why`` names the check that failed before."""
    if before.contact_friction != after.contact_friction:
        yield _finding(
            f"contact friction set from {before.contact_friction:.3g} to {after.contact_friction:.3g}: {why}",
            after.contact_friction,
            before.contact_friction,
        )
    if before.rolling_friction_m != after.rolling_friction_m:
        yield _finding(
            f"rolling resistance of contacts set from {1e3 * before.rolling_friction_m:.3g} to "
            f"{1e3 * after.rolling_friction_m:.3g} mm: {why}",
            after.rolling_friction_m,
            before.rolling_friction_m,
        )
    for old, new in zip(before.links, after.links, strict=True):
        yield from _link(old, new, why)
    for was, now in zip(before.joints, after.joints, strict=True):
        yield from _joint(was, now, why)


def _link(old: LinkPhysics, new: LinkPhysics, why: str) -> Iterator[Finding]:
    if old.mass_kg != new.mass_kg:
        yield _finding(
            f"mass of link '{new.name}' raised from {old.mass_kg:.3g} to {new.mass_kg:.3g} kg: {why}",
            new.mass_kg,
            old.mass_kg,
            link=new.name,
        )
    elif old.inertia != new.inertia:
        factor = sum(new.inertia[i] for i in (0, 3, 5)) / sum(old.inertia[i] for i in (0, 3, 5))
        yield _finding(f"inertia of link '{new.name}' times {factor:.3g}: {why}", factor, 1.0, link=new.name)


def _joint(old: JointPhysics, new: JointPhysics, why: str) -> Iterator[Finding]:
    for term, units in JOINT_TERMS.items():
        was, now = float(getattr(old, term)), float(getattr(new, term))
        if was != now:
            unit = units[new.type == "prismatic"]
            yield _finding(
                f"joint '{new.name}': {term} set from {was:.3g} to {now:.3g} {unit}: {why}", now, was, joint=new.name
            )


def _finding(message: str, value: float, limit: float, link: str | None = None, joint: str | None = None) -> Finding:
    return Finding(
        stage=Stage.REFINE,
        severity=Severity.INFO,
        code="mended",
        message=message,
        link=link,
        joint=joint,
        value=value,
        limit=limit,
    )
